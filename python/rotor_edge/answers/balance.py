"""Answers of ``balance``, with a rotor's file and without.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/balance.rs``."""

from dataclasses import dataclass

from ..record import Answer, Array, Record


@dataclass(frozen=True, eq=False)
class Vector(Record):
    """An unbalance and where it is."""

    magnitude_g_mm: float
    angle_deg: float


@dataclass(frozen=True, eq=False)
class Piece(Record):
    """A weight as it is put in."""

    magnitude_g_mm: float | None
    """None where weights are masses whose radius is not stated."""
    magnitude: float
    """In the unit of the weights."""
    angle_deg: float
    hole: int | None
    mass_g: float | None
    radius_mm: float | None


@dataclass(frozen=True, eq=False)
class Weight(Record):
    """A weight to add, wanted and as it can be placed."""

    plane: str
    unbalance_g_mm: float
    sd_g_mm: float
    angle_deg: float
    angle_sd_deg: float
    interval_95: Array
    """Least and most, g·mm; it holds where ``model_adequate``."""
    angle_95_deg: float
    """The angle is known to so much either way."""
    mass_g: float | None
    """Of one piece; None where a weight is split, or no radius is known."""
    radius_mm: float | None
    placed_g_mm: float
    placed: tuple[Piece, ...]


@dataclass(frozen=True, eq=False)
class Vibration(Record):
    """Root mean square over probes and speeds, µm zero to peak."""

    before: float
    after: float
    after_sd: float
    after_interval_95: Array
    """Least and most with the weights; it holds where ``model_adequate``."""
    reduction: float


@dataclass(frozen=True, eq=False)
class VibrationAtSpeed(Record):
    """The same at a speed."""

    speed_rpm: float
    before_um: float
    after_um: float
    after_sd_um: float


@dataclass(frozen=True, eq=False)
class Grade(Record):
    """Balance quality grade of ISO 21940-11, mm/s."""

    before: float
    after: float
    after_at_most: float


@dataclass(frozen=True, eq=False)
class Way(Record):
    """Weights by one way: the identified model, or trial runs alone."""

    by: str
    weights: tuple[Weight, ...]
    vibration_um: Vibration
    by_speed: tuple[VibrationAtSpeed, ...]
    grade_mm_s: Grade
    chi2_per_value: float | None
    chance: float | None
    model_adequate: bool
    """Whether noise explains the misfit; if not, no interval holds."""


@dataclass(frozen=True, eq=False, repr=False)
class Balance(Answer):
    """Correction weights of a machine that has a file."""

    angles: str
    """In which direction they count."""
    range_rpm: Array
    service_rpm: float
    amplitude_convention: str
    """What lengths in µm of the motion are: zero to peak."""
    ways: tuple[Way, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class TrialWeight(Record):
    """The weight of a plane; intervals in g·mm and degrees either way."""

    plane: str
    magnitude_g_mm: float | None
    """None where weights are masses whose radius is not stated, as ``interval_95`` then is."""
    magnitude: float
    """In the unit of the weights."""
    magnitude_interval_95: Array | None
    angle_deg: float
    interval_95: Array | None
    angle_95_deg: float | None
    placed: tuple[Piece, ...]
    text: str


@dataclass(frozen=True, eq=False)
class Left(Record):
    """Vibration of a probe at a speed; without a unit in the name it is in the unit of the data."""

    probe: str
    speed_rpm: float
    before_um: float | None
    after_um: float | None
    after_at_most_um: float | None
    before: float
    after: float
    after_at_most: float | None


@dataclass(frozen=True, eq=False)
class StaticCouple(Record):
    """Static part and couple of the weights of two planes."""

    static: Vector
    couple: Vector


@dataclass(frozen=True, eq=False, repr=False)
class TrialBalance(Answer):
    """Correction weights of a machine that has no file."""

    angles: str
    unit: str
    amplitude_convention: str
    """What amplitudes are: zero to peak."""
    criterion: str
    weight_unit: str
    """Unit of the weights, as the file of trial weights states it."""
    onto: str | None
    noise: str
    weights: tuple[TrialWeight, ...]
    static_couple: StaticCouple | None
    left: tuple[Left, ...]
    doubts: tuple[str, ...]
