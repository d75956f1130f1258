"""Answer of ``identify``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/identify.rs``."""

from dataclasses import dataclass, field

from ..inputs import Rotor
from ..record import Answer, Record
from .findings import Determined


@dataclass(frozen=True, eq=False)
class IdentifiedCoefficient(Record):
    """A coefficient of a bearing: N/m, or N·s/m for damping."""

    bearing: str
    symbol: str
    value: float
    start: float
    relative_sd: float
    identified: bool
    """Whether the data fix it; else it stayed at its start or bound."""


@dataclass(frozen=True, eq=False)
class IdentifiedPlane(Record):
    """A plane of the first days."""

    name: str
    unbalance_g_mm: float
    angle_deg: float
    relative_sd: float


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Answer):
    """Bearings and unbalance of a machine's first days (phase I)."""

    bearings: tuple[IdentifiedCoefficient, ...]
    planes: tuple[IdentifiedPlane, ...]
    determined: Determined
    residual_um: float
    residual_ratio: float
    chi2_per_value: float
    rotor: Rotor = field(kw_only=True)
    """The identified rotor."""
