"""Answer of ``track``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/track.rs``."""

from dataclasses import dataclass, field
from typing import Any

from ..inputs import columns_of
from ..record import Answer, Array, Record
from .compare import Residual
from .shared import PlaneUnbalance, Unbalance
from .track_conditions import Condition


@dataclass(frozen=True, eq=False)
class AroundEvent(Record):
    """Mean residual, of the features."""

    before_event: float | None
    after_event: float | None


@dataclass(frozen=True, eq=False)
class Reduction(Record):
    """By how much the residual is smaller than with constant bearings."""

    whole: float | None
    after_event: float | None


@dataclass(frozen=True, eq=False)
class Flag(Record):
    """A residual that stayed high; ``cause`` is model, unbalance or instrument."""

    since_d: float
    time_d: float
    time: str | None
    """The same as a date (ISO 8601), where it is known when day 0 was."""
    suspect: str
    cause: str


@dataclass(frozen=True, eq=False)
class Case(Record):
    """One of the ways in which bearings may have changed."""

    case: int
    residual_um: float
    unknowns: int
    criterion: float
    bearings: dict[str, float]
    planes: tuple[PlaneUnbalance, ...]


@dataclass(frozen=True, eq=False)
class Reidentified(Record):
    """Bearings that were identified anew, SI units."""

    since_d: float
    time_d: float
    case: int
    bearing: str
    bearings: dict[str, float]
    cases: tuple[Case, ...]


@dataclass(frozen=True, eq=False)
class PlaneInterval(Record):
    """Ends of a plane's 95 % interval."""

    name: str
    unbalance_g_mm: Array
    angle_deg: Array


@dataclass(frozen=True, eq=False)
class EstimateInterval(Record):
    """Ends of the 95 % intervals of an estimate; bearings in SI units."""

    planes: tuple[PlaneInterval, ...]
    bearings: dict[str, Array]


@dataclass(frozen=True, eq=False)
class Estimate(Record):
    """A day."""

    time_d: float
    time: str | None
    planes: tuple[PlaneUnbalance, ...]
    static: Unbalance
    dynamic: Unbalance
    residual_um: float
    residual_ratio: float
    flagged: bool
    interval_95: EstimateInterval | None


@dataclass(frozen=True, eq=False)
class Event(Record):
    """Something that changed the machine."""

    time_d: float
    time: str | None
    interval_95_d: Array
    changed: str
    kind: str
    """machine, restart (bearings and unbalance are new after an outage), probe gain or keyphasor."""
    gain: float | None
    """Gain of the probe after it over that before, of a probe gain."""
    turn_deg: float | None
    """Angle by which all probes are turned, of a keyphasor."""
    stated: bool
    """Whether it is an outage that was stated; its evidence is not judged and is 0."""
    log_evidence: float


@dataclass(frozen=True, eq=False)
class PossibleEvent(Record):
    """An event with too little evidence to be claimed; intervals are the mixture with it and without it."""

    event: Event
    probability: float


@dataclass(frozen=True, eq=False)
class Constant(Record):
    """The constant part of a number of a bearing, SI unit."""

    name: str
    value: float
    relative_sd: float
    """Standard deviation over the value."""
    interval_95: Array
    """Least and most."""
    from_data: bool


@dataclass(frozen=True, eq=False)
class State(Record):
    """Bearings from a day on."""

    since_d: float
    bearings: tuple[Constant, ...]


@dataclass(frozen=True, eq=False)
class SecondSpeed(Record):
    """What a second reading a day at another speed would give after some days of readings. Half-widths (95 %) are those of a
    component of the planes' unbalance, rms over the planes."""

    speed_rpm: float
    days: float
    half_width_g_mm: float
    without_g_mm: float
    """The same with readings at the record's speed alone."""
    gain_g_mm: float


@dataclass(frozen=True, eq=False)
class Joint(Record):
    """What all days together say."""

    events: tuple[Event, ...]
    possible_events: tuple[PossibleEvent, ...]
    states: tuple[State, ...]
    wander_relative_sd: dict[str, float]
    """Standard deviation of what comes and goes over the value."""
    wander_days: float
    left_out_d: Array
    effects: tuple[str, ...]
    conditions: tuple[Condition, ...]
    """One for each condition of operation that the record has and that changes."""
    second_speed: SecondSpeed | None
    """The second speed that helps most; None where the record has several, or none helps."""


@dataclass(frozen=True, eq=False, repr=False)
class Track(Answer):
    """The unbalance of a long record while bearings change."""

    method: str
    begin: str | None
    """When day 0 was (ISO 8601)."""
    readings: int
    residual_um: Residual
    amplitude_convention: str
    """What lengths in µm of the motion are: zero to peak."""
    residual_ratio: AroundEvent
    event_d: float | None
    reduction_against_fixed: Reduction
    flags: tuple[Flag, ...]
    reidentified: tuple[Reidentified, ...]
    estimates: tuple[Estimate, ...]
    sampling: dict[str, Any] | None
    """How good the samples of bayes are."""
    joint: Joint | None
    undiagnosed_since_d: float | None
    remarks: tuple[str, ...]
    csv: str = field(kw_only=True, repr=False)
    """Every estimate as a table, the file that ``forecast`` reads."""

    @property
    def columns(self) -> dict[str, Array]:
        """The same table as arrays by name."""
        return columns_of(self.csv)
