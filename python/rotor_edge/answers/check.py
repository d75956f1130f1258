"""Answer of ``check``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/check.rs``."""

from dataclasses import dataclass

from ..record import Answer, Array, Record
from .shared import PlaneUnbalance


@dataclass(frozen=True, eq=False)
class Mode(Record):
    """A damped mode at a speed."""

    speed_rpm: float
    frequency_rpm: float
    log_decrement: float
    """Negative for a mode that grows, zero for an undamped one."""
    whirl: str
    """forward, backward or mixed."""


@dataclass(frozen=True, eq=False)
class WithoutAmplitude(Record):
    """A critical speed that has no amplitude; margins are in percent."""

    speed_rpm: float
    excited: bool
    """Whether unbalance excites it."""
    margin_percent: float | None
    """Distance from the running range; negative inside."""
    needed_percent: float | None
    """As API 617 asks of a peak without damping."""
    margin_kept: bool | None


@dataclass(frozen=True, eq=False)
class CriticalSpeedMap(Record):
    """Forward critical speeds if every bearing had this stiffness."""

    stiffness_n_m: Array
    own_n_m: float
    """Mean stiffness as drawn."""
    speeds_rpm: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class StabilityThreshold(Record):
    """Where the machine becomes unstable."""

    speed_rpm: float
    frequency_rpm: float
    """Zero for a root that grows without oscillation."""
    from_the_first: bool
    """Whether it is unstable at the first speed of the range already."""


@dataclass(frozen=True, eq=False)
class Coefficients(Record):
    """A bearing at a speed: k in N/m, c in N·s/m."""

    speed_rpm: float
    kxx: float
    kxy: float
    kyx: float
    kyy: float
    cxx: float
    cxy: float
    cyx: float
    cyy: float
    eccentricity_ratio: float | None
    attitude_deg: float | None


@dataclass(frozen=True, eq=False)
class CheckedBearing(Record):
    """A bearing, its static load and what it is over speed."""

    name: str
    load_n: float | None
    eccentricity_ratio: float | None
    """At the fastest speed."""
    attitude_deg: float | None
    """At the fastest speed."""
    coefficients: tuple[Coefficients, ...]


@dataclass(frozen=True, eq=False)
class Peak(Record):
    """A resonance; margins are in percent."""

    speed_rpm: float
    amplitude_um: float
    """Zero to peak."""
    amplitude_convention: str
    """What `amplitude_um` is: zero to peak."""
    amplitude_um_pk_pk: float
    critical_speed_rpm: float | None
    """Critical speed of the mode that resonates; None for a maximum between resonances."""
    amplification: float | None
    """By the half-power points; None where one is not reached, or without a resonance."""
    margin_percent: float | None
    """Distance from the running range; negative inside. None where no margin is needed."""
    needed_percent: float | None
    """As API 617 asks."""
    margin_kept: bool | None


@dataclass(frozen=True, eq=False)
class ProbePeaks(Record):
    """Resonances that a probe sees."""

    name: str
    peaks: tuple[Peak, ...]


@dataclass(frozen=True, eq=False)
class TrialResponse(Record):
    """The response to an assumed unbalance."""

    trial: str
    """static, couple or own."""
    basis: str
    """What the unbalance is: balance_grade or api_617, twice as much as permitted; or rotor_file."""
    planes: tuple[PlaneUnbalance, ...]
    probes: tuple[ProbePeaks, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Check(Answer):
    """What a machine's drawing alone says."""

    name: str
    mass_kg: float
    centre_of_gravity_m: float
    """From the left end."""
    largest_sag_m: float | None
    """None where the weight cannot be shared out."""
    range_rpm: Array
    running_range_rpm: Array | None
    """Speeds that margins refer to; None where neither the command nor the rotor states them."""
    stability: str
    """stable, unstable or not_judged, in the range."""
    undamped: bool
    """Whether no mode has enough damping to state an amplitude."""
    critical_speeds_rpm: Array
    """Undamped."""
    critical_speeds_forward: Array
    """The share of the motion that turns forward."""
    damped_critical_speeds: tuple[Mode, ...]
    """Within the range."""
    damped_critical_speeds_outside: tuple[Mode, ...]
    """Below the range, and above it up to 1.3 times the fastest speed."""
    critical_speeds_without_amplitude: tuple[WithoutAmplitude, ...]
    """Critical speeds of modes without damping."""
    critical_speed_map: CriticalSpeedMap
    modes: tuple[Mode, ...]
    """At 25 speeds of the range, ascending; of a range of one speed, at this one."""
    overdamped_roots_rad_s: Array
    """Roots that do not oscillate, at the fastest speed, as rates of growth; negative for decay."""
    stability_threshold: StabilityThreshold | None
    """From the slowest speed of the range to 1.3 times the fastest."""
    bearings: tuple[CheckedBearing, ...]
    unbalance: tuple[TrialResponse, ...]
    warnings: tuple[str, ...]
