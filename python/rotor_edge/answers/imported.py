"""Answers of ``import`` and ``import-rotor``.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/imported.rs``."""

from dataclasses import dataclass, field

from ..inputs import Measurement, Rotor
from ..record import Answer, Array, Record

CosineSine = Array
"""Cosine and sine component, µm zero to peak."""


@dataclass(frozen=True, eq=False, repr=False)
class ImportedRotor(Answer):
    """A drawing from a rotor of ROSS, what was carried over and what was left, a sentence each."""

    rotor: Rotor
    """The drawing."""
    carried: tuple[str, ...]
    left: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ImportedColumn(Record):
    """A column, counted from 1, and what it was taken for: its unit, and what makes µm zero to peak, degrees of lag, rpm or
    V."""

    file: str
    column: int
    from_: str
    to: str
    unit: str
    factor: float
    offset: float | None = None
    """What is added after the factor, of temperatures that count from another zero."""


@dataclass(frozen=True, eq=False)
class LeftColumn(Record):
    """A column that is not needed, or not understood."""

    column: int
    from_: str
    why: str


@dataclass(frozen=True, eq=False)
class MarkedValues(Record):
    """Values that are lost, by what was wrong with them."""

    no_measurement: int
    stale: int
    outliers: int


@dataclass(frozen=True, eq=False)
class SkippedRows(Record):
    """Rows that are no readings."""

    standstill: int
    without_speed: int
    other_machines: int
    other_points: int
    no_data: int
    first: tuple[str, ...]
    """Of each kind the first row, and why it was left out."""


@dataclass(frozen=True, eq=False, repr=False)
class Import(Answer):
    """Readings from exports of another system, and what its columns were taken for."""

    measured: str | None
    columns: tuple[ImportedColumn, ...]
    left: tuple[LeftColumn, ...]
    rows: int
    lost: int
    """Values of single probes that are lost."""
    marked: MarkedValues
    turned: int
    """Readings that were turned back to the phase reference before."""
    skipped: SkippedRows
    sorted: bool
    """Whether the rows had to be sorted by time."""
    start: str | None
    """When day 0 was, local to the export."""
    remarks: tuple[str, ...]
    """What was concluded of times and dates from the order of the rows, and which rows were joined: a sentence each."""
    runout_um: tuple[CosineSine, ...] | None
    """Runout that was taken off each probe."""
    measurement: Measurement | None = field(kw_only=True)
    """The readings; None if nothing was to be written."""
