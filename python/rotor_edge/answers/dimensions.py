"""The drawing as fitted.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/dimensions.rs``."""

from dataclasses import dataclass

from ..record import Array, Record


@dataclass(frozen=True, eq=False)
class Dimension(Record):
    """How far a dimension is from the drawing: in m where ``unit`` says so, else as a share of the drawn value."""

    name: str
    """As ``[tolerance.found]`` of a rotor file calls it."""
    unit: str
    difference: float
    """Fitted minus drawn."""
    interval_95: Array
    """Least and most; it holds where the model describes the data."""
    tolerance_95: float
    """Half-width of the range that the tolerance allows with 95 %."""
    identified: bool
    """Whether the data know it at least twice as well as the tolerance does."""
