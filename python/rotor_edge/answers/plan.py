"""Answer of ``plan``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/plan.rs``."""

from dataclasses import dataclass

from ..record import Answer, Array, Record
from .shared import PlaneUnbalance


@dataclass(frozen=True, eq=False)
class PlannedNoise(Record):
    """Noise of the readings: a share of the amplitude and a floor."""

    relative: float
    floor_um: float


@dataclass(frozen=True, eq=False)
class PlannedParameter(Record):
    """A parameter of an effect; of a phasor its magnitude."""

    name: str
    unit: str
    """SI unit."""
    value: float


@dataclass(frozen=True, eq=False)
class PlannedSize(Record):
    """An effect of a certain size."""

    parameters: tuple[PlannedParameter, ...]
    """Those that grow with the effect."""
    change: float
    """By how much it changes the vibration, of the vibration, root mean square over the readings."""
    found: float
    """Probability that it is found, alone or in a group."""
    alone: float
    """Probability that it is named alone."""


@dataclass(frozen=True, eq=False)
class Imitation(Record):
    """A candidate that imitates an effect."""

    effect: str
    """``effect@place``."""
    left_sd: float
    """What it leaves unexplained, in standard deviations of the noise."""


@dataclass(frozen=True, eq=False)
class PlannedEffect(Record):
    """What the measurements would show of an effect at a place."""

    effect: str
    at: str | None
    smallest: PlannedSize | None
    """The smallest that is found, alone or in a group; none if none is."""
    smallest_alone: PlannedSize | None
    """The smallest that is named alone; none if none is."""
    relevant: PlannedSize
    """The size that matters: it changes the vibration by a tenth, or by as much as it can."""
    found: bool
    """Whether it is found at the size that matters, or at all where it has no size."""
    confused_with: tuple[Imitation, ...]
    """Candidates that a diagnosis would not tell from it at the smallest size."""
    imitations: tuple[Imitation, ...]
    """The candidates that imitate it best, told from it or not."""


@dataclass(frozen=True, eq=False)
class PlannedPlane(Record):
    """The unbalance of a plane as the measurements would know it."""

    name: str
    unbalance_g_mm: float
    accuracy: float | None
    """95 % half-width in the direction in which it is known least, g·mm; none if it is not known at all."""
    angle_95_deg: float
    """95 % half-width of the angle."""


@dataclass(frozen=True, eq=False)
class NextMeasurement(Record):
    """A measurement beyond the planned ones."""

    measurement: str
    gain: float
    """Expected information on what is missing and on the unbalance, bits."""
    found_more: int
    """By how many more effects are found at the size that matters."""
    named_alone_more: int
    """By how many more are named alone there, rivals taken as linear."""
    accuracy_ratio: Array
    """95 % half-width of each plane's unbalance with it, of that without."""


@dataclass(frozen=True, eq=False)
class Decision(Record):
    """Which further measurement decides between effects that a diagnosis cannot tell apart."""

    effects: tuple[str, ...]
    """``effect@place`` of each."""
    measurement: str | None
    """The measurement, or two together, that decide most probably; none if none could be tried."""
    probability: float
    """With which one of the effects, of the size that matters, is named alone then, on average over them."""
    probability_without: float
    """The same by the planned measurements alone."""


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Answer):
    """What measurements could show before they are made."""

    machine: str
    """The machine as its file calls it."""
    readings: int
    """Readings of all runs together."""
    runs: tuple[str, ...]
    """Names of the runs; none for a single one without a name."""
    range_rpm: Array
    """Slowest and fastest speed."""
    probability: float
    """With which an effect of the smallest size is found."""
    unbalance: tuple[PlaneUnbalance, ...]
    """The unbalance that the machine is taken with."""
    noise: PlannedNoise
    saturated: str | None
    """Why nothing can be found, if bearings and planes use up what the readings hold."""
    found: int
    """Effects that are found at the size that matters, and those that are named alone there."""
    named_alone: int
    effects: tuple[PlannedEffect, ...]
    planes: tuple[PlannedPlane, ...]
    next: tuple[NextMeasurement, ...]
    """Further measurements, those that help most first."""
    between: Decision | None
    """What would decide between the effects of ``--between``; none if nothing is to be decided."""
    remarks: tuple[str, ...]
