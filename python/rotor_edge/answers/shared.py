"""Parts that several answers hold.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/shared.rs``."""

from dataclasses import dataclass

from ..record import Record


@dataclass(frozen=True, eq=False)
class Unbalance(Record):
    """An unbalance and where it is."""

    unbalance_g_mm: float
    angle_deg: float


@dataclass(frozen=True, eq=False)
class PlaneUnbalance(Record):
    """An unbalance, or a weight, at a plane."""

    name: str
    unbalance_g_mm: float
    angle_deg: float
