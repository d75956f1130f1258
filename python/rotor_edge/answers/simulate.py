"""Answer of ``simulate``, and its truth.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/simulate.rs``."""

from dataclasses import dataclass, field

from ..inputs import Measurement
from ..record import Answer, Array, Record
from .diagnose import Parameters
from .shared import PlaneUnbalance


@dataclass(frozen=True, eq=False)
class SimulatedWeight(Record):
    """A trial weight at its place on the shaft."""

    position_m: float
    unbalance_g_mm: float
    angle_deg: float


@dataclass(frozen=True, eq=False)
class SimulatedRun(Record):
    """A run and its weights."""

    name: str
    slow_roll: bool
    weights: tuple[SimulatedWeight, ...]


@dataclass(frozen=True, eq=False)
class SimulatedProbe(Record):
    """The largest amplitude of a probe, µm zero to peak, and where it is."""

    name: str
    largest_um: float
    speed_rpm: float
    run: str | None


@dataclass(frozen=True, eq=False)
class SimulatedNoise(Record):
    """Standard deviation of each component: a part of the amplitude, and a floor, µm zero to peak."""

    relative: float
    floor_um: float


@dataclass(frozen=True, eq=False)
class SimulatedEffect(Record):
    """An effect of the machine with its parameters in SI units."""

    effect: str
    at: str | None
    parameters: Parameters
    units: dict[str, str]
    visible_sd: float | None
    """Of a hidden effect: what a fit of bearings, unbalance and drawing leaves of it in all readings, in standard deviations
    of the noise."""


@dataclass(frozen=True, eq=False)
class SimulatedDrawingChange(Record):
    """A number of the machine that differs from its drawing."""

    what: str
    """As ``[tolerance.found]`` calls it."""
    change: float
    unit: str
    """m; empty of a relative change."""
    deviations: float
    """The same in standard deviations of the tolerance."""


@dataclass(frozen=True, eq=False)
class Truth(Record):
    """What a simulated machine has in truth."""

    rotor: str
    """Name of the machine."""
    seed: int
    drawing_seed: int | None
    hidden_seed: int | None
    effects: tuple[SimulatedEffect, ...]
    """Those that the rotor's file does not state."""
    unbalance: tuple[PlaneUnbalance, ...]
    drawing: tuple[SimulatedDrawingChange, ...]
    """The machine less its drawing."""
    noise: SimulatedNoise


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Answer):
    """Readings that a machine would give."""

    measured: str
    readings: int
    speeds_rpm: Array
    """Of every run but slow rolls, rpm."""
    runs: tuple[SimulatedRun, ...]
    probes: tuple[SimulatedProbe, ...]
    critical_speeds_rpm: Array
    """Undamped, of the machine as drawn, up to its fastest reading, at least one."""
    noise: SimulatedNoise
    remarks: tuple[str, ...]
    truth: Truth | None
    """None where an effect is hidden."""
    measurement: Measurement = field(kw_only=True)
    """The readings."""
