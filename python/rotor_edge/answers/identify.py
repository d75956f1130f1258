"""Answer of ``identify``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/identify.rs``."""

from dataclasses import dataclass, field

from ..inputs import Rotor
from ..record import Answer, Array, Record
from .findings import Determined


@dataclass(frozen=True, eq=False)
class IdentifiedCoefficient(Record):
    """A coefficient of a bearing, or a parameter of its film or table, in the SI ``unit``."""

    bearing: str
    symbol: str
    unit: str
    value: float
    start: float
    relative_sd: float | None
    """Standard deviation over the value; over the unit where the value may be zero. None where it is not known."""
    interval_95: Array | None
    """Least and most, where the model is adequate; None at a bound."""
    identified: bool
    """Whether the data fix it; else it stayed at its start or bound."""


@dataclass(frozen=True, eq=False)
class IdentifiedPlane(Record):
    """A plane of the first days."""

    name: str
    unbalance_g_mm: float
    angle_deg: float
    relative_sd: float
    """Standard deviation over the size; ``determined`` has the 95 % intervals."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Answer):
    """Bearings and unbalance of a machine's first days (phase I)."""

    bearings: tuple[IdentifiedCoefficient, ...]
    planes: tuple[IdentifiedPlane, ...]
    determined: Determined
    residual_um: float
    amplitude_convention: str
    """What lengths in µm of the motion are: zero to peak."""
    residual_ratio: float
    chi2_per_value: float
    remarks: tuple[str, ...]
    """What was assumed, and what is odd in the data, one sentence each."""
    rotor: Rotor = field(kw_only=True)
    """The identified rotor."""


@dataclass(frozen=True, eq=False)
class Departure(Record):
    """A number of a bearing that the data contradict, in the SI ``unit``: the 95 % interval does not reach the stated 95 %
    range."""

    bearing: str
    symbol: str
    unit: str
    value: float
    """By the data alone, without the stated number."""
    interval_95: Array
    stated: float
    stated_interval_95: Array
    """Least and most of the stated number by its tolerance."""
