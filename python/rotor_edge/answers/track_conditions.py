"""What conditions of operation change, as ``track --method joint`` answers it.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/track_conditions.rs``."""

from dataclasses import dataclass

from ..record import Record


@dataclass(frozen=True, eq=False)
class RelativeChange(Record):
    """A change for a step of a condition, percent, with the half-width of its 95 % interval."""

    percent: float
    half_width_percent: float


@dataclass(frozen=True, eq=False)
class CoefficientChange(Record):
    """Change of a bearing coefficient for a step of a condition."""

    name: str
    percent: float
    half_width_percent: float


@dataclass(frozen=True, eq=False)
class BearingEffect(Record):
    """What a step of a condition changes at a bearing: its direct stiffness and damping on average over x and y, and each
    coefficient."""

    name: str
    stiffness: RelativeChange
    damping: RelativeChange
    coefficients: tuple[CoefficientChange, ...]


@dataclass(frozen=True, eq=False)
class PlaneEffect(Record):
    """What a step of a condition adds to the unbalance of a plane on the last day; the half-width (95 %) is that of a
    component."""

    name: str
    change_g_mm: float
    angle_deg: float
    half_width_g_mm: float


@dataclass(frozen=True, eq=False)
class OtherEffect(Record):
    """Another part of the machine that may follow a condition: unbalance or bearings. Intervals are the mixture of both."""

    part: str
    probability: float


@dataclass(frozen=True, eq=False)
class Condition(Record):
    """What a condition of operation changes, for a step of it in its unit."""

    name: str
    unit: str
    mean: float
    """Mean over the record; the constants of the bearings are those at the mean."""
    step: float
    used: bool
    """Whether bearings or unbalance follow it."""
    log_evidence: float
    """Logarithm of how much more probable the record is with its likeliest effect, less that of the number of trials; used
    from 4.6 on."""
    bearings: tuple[BearingEffect, ...]
    planes: tuple[PlaneEffect, ...]
    other: OtherEffect | None
    """Another part of the machine that may follow it instead; None if that is improbable."""
