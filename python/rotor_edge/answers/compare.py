"""Answer of ``compare``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/compare.rs``."""

from dataclasses import dataclass

from ..record import Answer, Record
from .findings import Determined, Noise


@dataclass(frozen=True, eq=False)
class Residual(Record):
    """Σ|model − measured| over all components, µm: of all readings, and of one on average."""

    sum: float
    mean: float


@dataclass(frozen=True, eq=False)
class Neighbours(Record):
    """How alike neighbouring speeds are missed; noise would be zero."""

    correlation: float
    z_score: float
    p_value: float


@dataclass(frozen=True, eq=False)
class Worst(Record):
    """The reading that is missed most."""

    probe: str
    speed_rpm: float
    run: str | None
    error_um: float
    error_sigmas: float


@dataclass(frozen=True, eq=False)
class ByProbe(Record):
    """A probe."""

    probe: str
    residual_um: float
    relative_error: float
    chi2_per_value: float


@dataclass(frozen=True, eq=False)
class BySpeed(Record):
    """A speed of a run."""

    run: str | None
    speed_rpm: float
    readings: int
    residual_um: float
    chi2_per_value: float


@dataclass(frozen=True, eq=False)
class ByRun(Record):
    """A run."""

    run: str | None
    readings: int
    residual_um: float
    relative_error: float
    chi2_per_value: float


@dataclass(frozen=True, eq=False)
class WhirlPart(Record):
    """What turns one way."""

    measured_um: float
    model_um: float
    error_um: float
    error_sigmas: float


@dataclass(frozen=True, eq=False)
class Whirl(Record):
    """Both senses of whirl at a bearing."""

    bearing: str
    forward: WhirlPart
    backward: WhirlPart


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Answer):
    """A model, at its best bearings and planes, against the data; ``verdict`` is adequate or misses."""

    readings: int
    residual_um: Residual
    amplitude_convention: str
    """What lengths in µm of the motion are: zero to peak."""
    residual_ratio: float
    relative_error: float
    chi2_per_value: float
    chi2_p_value: float
    neighbours: Neighbours
    verdict: str
    noise: Noise
    determined: Determined
    reversed: bool
    """Whether the phases are those of a shaft that turns the other way."""
    worst: Worst | None
    by_probe: tuple[ByProbe, ...]
    by_speed: tuple[BySpeed, ...]
    by_run: tuple[ByRun, ...]
    whirl: tuple[Whirl, ...]
    remarks: tuple[str, ...]
    nothing_missing: float | None
    """Probability that noise is all there is; an upper bound where it is below one in a million."""
