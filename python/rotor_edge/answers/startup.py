"""Answer of ``startup``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/startup.rs``."""

from dataclasses import dataclass

from ..inputs import Rotor
from ..record import Answer, Array, Record
from .diagnose import Parameters
from .dimensions import Dimension
from .identify import IdentifiedCoefficient

ByDirection = dict[str, float | None]
"""A figure by the direction that a pair of probes or a probe looks in."""
Errors = dict[str, dict[str, dict[str, float]]]
"""Percent of the clearance by speed (rpm), bearing and run."""


@dataclass(frozen=True, eq=False)
class Number(Record):
    """A number, its standard deviation, and the 95 % interval, which holds where ``two_degree_adequate``."""

    value: float
    sd: float
    interval_95: Array


@dataclass(frozen=True, eq=False)
class MethodEstimate(Record):
    """The two-degree model as one method has it."""

    natural_rpm: Number
    damping_ratio: Number
    damping_n_s_m: Number
    stiffness_n_m: Number
    bearing_stiffness_n_m: Number | None


@dataclass(frozen=True, eq=False)
class Line(Record):
    """How a figure changes with the size of the motion."""

    small_motion: Number
    at_largest: float
    sigmas: float


@dataclass(frozen=True, eq=False)
class Shift(Record):
    """What changes with the size of the motion."""

    natural_rpm: Line
    damping_ratio: Line
    largest_um: float


@dataclass(frozen=True, eq=False)
class DirectionEstimates(Record):
    """A direction: half_power, circle and least_squares, as far as they can."""

    methods: dict[str, MethodEstimate | None]
    shift: Shift | None


@dataclass(frozen=True, eq=False)
class HalfPower(Record):
    """A run along a direction, as marked in its Bode plot; ``why_not`` says why it has no marks."""

    natural_rpm: float | None = None
    natural_rpm_sd: float | None = None
    damping_ratio: float | None = None
    damping_ratio_sd: float | None = None
    damping_ratio_taken_as_light: float | None = None
    peak_rpm: float | None = None
    peak_um: float | None = None
    half_power_rpm: Array | None = None
    why_not: str | None = None


@dataclass(frozen=True, eq=False)
class StartupRun(Record):
    """A run."""

    run: str
    added_g_mm: float
    half_power: dict[str, HalfPower]


@dataclass(frozen=True, eq=False)
class OwnUnbalance(Record):
    """The disk's own unbalance, g·mm and degrees."""

    g_mm: float
    angle_deg: float
    sd_g_mm: float
    sd_deg: float
    interval_95: Array
    """Least and most, g·mm; it holds where ``model_adequate``."""
    angle_95_deg: float
    """The angle is known to so much either way."""
    model_adequate: bool
    """Whether the model that it comes from describes the data."""
    modal_mass_kg: float | None = None


@dataclass(frozen=True, eq=False)
class StageAtSpeed(Record):
    """The largest error at a speed, and the noise there."""

    speed_rpm: float
    error_percent_of_clearance: float
    noise_percent_of_clearance: float


@dataclass(frozen=True, eq=False)
class Stage(Record):
    """A model on the way from the simple one to the one that fits."""

    model: str
    chi2_per_value: float | None
    error_percent_of_clearance: Errors
    largest_error_percent_of_clearance: float
    by_speed: tuple[StageAtSpeed, ...]


@dataclass(frozen=True, eq=False)
class AddedEffect(Record):
    """An effect that was added; the uncertainty is standard deviations."""

    effect: str
    at: str | None
    parameters: Parameters
    uncertainty: Parameters
    uncertainty_kind: str
    """What ``uncertainty`` is: one standard deviation."""
    interval_95: Parameters
    """Least and most of each number; they hold where ``model_adequate``."""


@dataclass(frozen=True, eq=False)
class PedestalResonance(Record):
    """Where a pedestal resonates, and the standard deviation, rpm."""

    at: str
    rpm: float
    sd: float
    interval_95: Array


@dataclass(frozen=True, eq=False)
class BowNotAdded(Record):
    """A bow of the shaft that was looked at and not added."""

    delta_bic: float
    """The old name of ``twice_log_bayes_factor``."""
    twice_log_bayes_factor: float
    """Twice the logarithm of the Bayes factor over the model without it."""
    probability: float


@dataclass(frozen=True, eq=False)
class ImprovedStartup(Record):
    """What mends the model; the verdict is that of a diagnosis."""

    verdict: str
    summary: str
    effects: tuple[AddedEffect, ...]
    own_unbalance: tuple[OwnUnbalance, ...]
    bearings: tuple[IdentifiedCoefficient, ...]
    """As fitted, with all effects."""
    dimensions: tuple[Dimension, ...]
    """The drawing as fitted, with all effects; none of an exact one."""
    model_adequate: bool
    """Whether the model describes the data; if not, no interval of its numbers holds."""
    pedestal_resonance_rpm: tuple[PedestalResonance, ...]
    shaft_bow_not_added: BowNotAdded | None


@dataclass(frozen=True, eq=False, repr=False)
class Startup(Answer):
    """A single-disk rotor from its start-up: the two-degree model, where it fails, and what mends it."""

    damping_ratio: ByDirection
    natural_rpm: ByDirection
    stiffness_n_m: ByDirection
    bearing_stiffness_n_m: ByDirection
    damping_n_s_m: ByDirection
    error_percent_of_clearance: Errors
    """Of the simple model."""
    mass_kg: float
    effective_mass_kg: float
    shaft_stiffness_n_m: float
    clearance_um: float
    clearance_assumed: bool
    """Whether nobody stated it."""
    amplitude_convention: str
    """What lengths in µm of the motion are: zero to peak."""
    two_degree_adequate: bool
    """Whether the two-degree model describes the data; if not, no interval of its numbers holds."""
    estimates: dict[str, DirectionEstimates]
    runs: tuple[StartupRun, ...]
    own_unbalance_two_degree: OwnUnbalance | None
    stages: tuple[Stage, ...]
    improved: ImprovedStartup | None
    remarks: tuple[str, ...]
    rotor: Rotor | None
    """The improved model, where one was asked for."""
