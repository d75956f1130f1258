"""Answer of ``estimate``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/estimate.rs``."""

from dataclasses import dataclass

from ..record import Answer, Array, Record
from .shared import PlaneUnbalance


@dataclass(frozen=True, eq=False)
class Region(Record):
    """What holds a plane's unbalance with 95 %: half axes, g·mm, and the direction of the first, degrees."""

    semi_axes_g_mm: Array
    major_deg: float
    covariance_g2_mm2: Array
    """Of both components, cosine first."""


@dataclass(frozen=True, eq=False)
class EstimatedPlane(Record):
    """A plane of a run."""

    name: str
    unbalance_g_mm: float
    angle_deg: float
    interval_95: Array
    """Least and most, g·mm."""
    region: Region


@dataclass(frozen=True, eq=False)
class Influence(Record):
    """The same by influence coefficients, where they can."""

    planes: tuple[PlaneUnbalance, ...] | None


@dataclass(frozen=True, eq=False)
class RunEstimate(Record):
    """A run beyond the base run."""

    run: str
    session: str | None
    """As the measurement states it."""
    speed_rpm: Array
    planes: tuple[EstimatedPlane, ...]
    influence: Influence
    stated: tuple[PlaneUnbalance, ...] | None
    """As the rotor's file has it."""


@dataclass(frozen=True, eq=False)
class Condition(Record):
    """How far the planes can be told apart at a speed, at all together where there is none; ``whitened`` beside the
    noise."""

    speed_rpm: float | None
    condition: float | None
    whitened: float | None


@dataclass(frozen=True, eq=False)
class PlanesDetermined(Record):
    """How well the data know the planes."""

    poorly: bool
    worst_sd_g_mm: float | None
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Sessions(Record):
    """Sessions of measurement, and how far base and scale shift between them (standard deviations)."""

    source: str
    """``stated``, by ``pauses`` between times, by ``blocks`` of consecutive runs, or one session ``assumed``."""
    learned_from: int
    """Sessions or blocks with stated weights that the shift is learned from; of one it is assumed."""
    new_runs: int
    """Runs that count as new sessions."""
    base_shift: float
    """Shift of the base, in units of the scatter between mountings."""
    scale_shift: float
    """Shift of the scale of a plane, relative."""
    half_width_g_mm: float | None
    """Mean 95 % half-width of the new runs, g·mm; none without new runs."""
    half_width_same_session_g_mm: float | None
    """The same if they were of the session of the base run."""
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class RefutedWeights(Record):
    """A run whose stated weights cannot be true."""

    run: str
    probability: float
    stated: tuple[PlaneUnbalance, ...]
    found: tuple[PlaneUnbalance, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Estimates(Answer):
    """The unbalance of each run relative to a base run."""

    base: str
    estimates: tuple[RunEstimate, ...]
    condition: tuple[Condition, ...]
    determined: PlanesDetermined
    sessions: Sessions
    refuted_runs: tuple[RefutedWeights, ...]
    remarks: tuple[str, ...]
