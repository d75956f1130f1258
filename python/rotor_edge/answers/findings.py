"""What data determine besides the verdict: the noise as it was found, the planes with their intervals, a cause outside the
list of effects, runs whose stated weights are refuted.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/findings.rs``."""

from dataclasses import dataclass

from ..record import Array, Record


@dataclass(frozen=True, eq=False)
class Noise(Record):
    """The noise as it was found."""

    scale: float
    """Times what is stated."""
    correlation: float
    """From reading to reading."""
    between_runs: float
    """What runs differ by, of the response."""


@dataclass(frozen=True, eq=False)
class DeterminedPlane(Record):
    """A plane and how well the data know it."""

    name: str
    unbalance_g_mm: float
    angle_deg: float
    interval_95: Array
    """Least and most, g·mm."""
    angle_95_deg: float
    """The angle is known to so much either way."""
    region: Array
    """Half axes of the 95 % region, g·mm, and the direction of the first, degrees."""
    determined: bool
    """Whether the region leaves zero out."""


@dataclass(frozen=True, eq=False)
class Determined(Record):
    """The planes as the data determine them; ``why`` says it where they do not, or where the model is rejected."""

    model_adequate: bool
    """Whether the model describes the data; if not, no interval of its bearings and planes holds."""
    planes: tuple[DeterminedPlane, ...] | None = None
    condition: Array | None = None
    """Condition number of the planes: a 1 % model error can become this many percent in the unbalance."""
    why: str | None = None


@dataclass(frozen=True, eq=False)
class UnknownCause(Record):
    """Something that no known effect is."""

    acts_like: str
    """force, bearings, stiffness or drawing."""
    drawing: str | None
    position_m: float
    place_probability: float
    probability: float
    growth: str | None
    whirl: str | None
    forward_share: float | None
    speed_rpm: float | None
    force_n: float | None
    looks_like: str


@dataclass(frozen=True, eq=False)
class StatedWeight(Record):
    """A weight as the rotor's file has it."""

    plane: str
    magnitude_g_mm: float
    angle_deg: float


@dataclass(frozen=True, eq=False)
class FoundWeight(Record):
    """A weight as the data have it."""

    plane: str
    magnitude_g_mm: float
    angle_deg: float
    interval_95: Array
    """Least and most, g·mm."""
    angle_95_deg: float
    account: str | None
    """What would make one of the other."""


@dataclass(frozen=True, eq=False)
class RefutedRun(Record):
    """A run whose stated weights are not true."""

    run: str
    probability: float
    stated: tuple[StatedWeight, ...]
    found: tuple[FoundWeight, ...]
    model_adequate: bool
    """Whether the model that finds them describes the data; if not, no interval holds."""
