"""What commands are asked about: a rotor, measurements of it."""

import csv
import io
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Mapping, Protocol

import numpy as np

from . import _native, tables

FilePath = str | os.PathLike[str]
TEXTS = ("run", "session", "time")
"""Columns that hold no numbers."""


@dataclass(frozen=True)
class Rotor:
    """A rotor as its file describes it: a drawing, and what was found out about it."""

    text: str
    """The file, ``rotor.toml``, with every table that lay beside it."""
    drawing: Mapping[str, Any] = field(compare=False)
    """The same as a dictionary; units are in the names."""

    @classmethod
    def parse(cls, text: str) -> "Rotor":
        """The rotor that the text of a ``rotor.toml`` describes."""
        with TemporaryDirectory(prefix="rotor-edge-") as folder:
            path = Path(folder, "rotor.toml")
            path.write_text(text, encoding="utf-8")
            try:
                return read_rotor(path)
            except _native.Error as error:
                raise _native.Error(str(error).replace(folder + os.sep, "")) from None

    @property
    def name(self) -> str:
        """What the machine is called in reports."""
        return str(self.drawing["name"])

    def write(self, path: FilePath) -> None:
        """Writes the file."""
        Path(path).write_text(self.text, encoding="utf-8")

    def __repr__(self) -> str:
        return f"Rotor({self.name!r})"

    def _repr_html_(self) -> str:
        parts = [(name, len(part)) for name, part in self.drawing.items() if isinstance(part, list)]
        return tables.of_pairs(self.name, parts)


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """1x vibration, a row a reading, as ``u(t) = cos · cos Ωt + sin · sin Ωt`` zero to peak, t = 0 at the keyphasor's mark."""

    columns: Mapping[str, np.ndarray]
    """``run``, ``session`` and ``time_d`` (days) if there are any, ``speed_rpm``, then ``<probe>_cos_um`` and
    ``<probe>_sin_um`` of every probe (µm), perhaps ``<probe>_gap_v`` (V) and conditions of operation such as ``load_mw``; a
    lost reading is not a number."""

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]

    def __len__(self) -> int:
        return len(self.speed_rpm)

    @property
    def speed_rpm(self) -> np.ndarray:
        """Speed of rotation of every reading, rpm."""
        return self.columns["speed_rpm"]

    @property
    def probes(self) -> tuple[str, ...]:
        """Names of the probes."""
        end = "_cos_um"
        return tuple(name[: -len(end)] for name in self.columns if name.endswith(end))

    @property
    def phasors_um(self) -> np.ndarray:
        """Phasors ``cos − i sin``, µm zero to peak: a row a reading, a column a probe."""
        return np.column_stack([self[f"{p}_cos_um"] - 1j * self[f"{p}_sin_um"] for p in self.probes])

    @property
    def gaps_v(self) -> np.ndarray | None:
        """Gap voltages, V: a row a reading, a column a probe, not a number where none was read; None if there are none at all."""
        columns = [self.columns.get(f"{p}_gap_v") for p in self.probes]
        if all(column is None for column in columns):
            return None
        missing = np.full(len(self), np.nan)
        return np.column_stack([missing if column is None else column for column in columns])

    def __repr__(self) -> str:
        return f"Measurement({len(self)} readings of {', '.join(self.probes)})"

    def _repr_html_(self) -> str:
        slowest, fastest = np.nanmin(self.speed_rpm), np.nanmax(self.speed_rpm)
        pairs = [("readings", len(self)), ("probes", self.probes), ("speed_rpm", f"{slowest:g} to {fastest:g}")]
        gaps_v = self.gaps_v
        if gaps_v is not None and np.isfinite(gaps_v).any():
            pairs.append(("gap_v", f"{np.nanmin(gaps_v):g} to {np.nanmax(gaps_v):g}"))
        return tables.of_pairs("Measurement", pairs)


class Frame(Protocol):
    """What data frames have in common."""

    @property
    def columns(self) -> Any:
        """Names of the columns."""

    def __getitem__(self, name: str, /) -> Any:
        """A column."""


RotorLike = FilePath | Rotor
"""A file, or a rotor in memory."""
DataLike = FilePath | Measurement | Mapping[str, Any] | np.ndarray | Frame
"""A file, a measurement, or its columns by name: a dictionary of arrays, a structured array, a data frame."""


def read_rotor(path: FilePath) -> Rotor:
    """Reads and checks a ``rotor.toml``."""
    text, drawing = _native.rotor(os.fspath(path))
    return Rotor(text, json.loads(drawing))


def read_measurement(path: FilePath, rotor: FilePath | None = None) -> Measurement:
    """Reads and checks a ``measured.csv``; with the file of a rotor, one whose probes and runs are that rotor's.

    Slow rolls stay in it: commands take them off. When day 0 was, as a comment in the file may say, does not: ``track`` takes it
    as ``begin``."""
    text = _native.measurement(os.fspath(path), None if rotor is None else os.fspath(rotor))
    return Measurement(columns_of(text))


def columns_of(text: str) -> dict[str, np.ndarray]:
    """The columns of a table in CSV."""
    names, *rows = csv.reader(io.StringIO(text))
    return {name: _column(name, cells) for name, cells in zip(names, zip(*rows))}


def _column(name: str, cells: tuple[str, ...]) -> np.ndarray:
    if name in TEXTS:
        return np.array(cells)
    return np.array([float(cell) if cell else np.nan for cell in cells])


def as_csv(data: Any) -> str:
    """The text of the file that columns would be read from."""
    columns = data.columns if isinstance(data, Measurement) else data
    names = _names(columns)
    cells = [_cells(np.asarray(columns[name])) for name in names]
    for name, column in zip(names, cells):
        if len(column) != len(cells[0]):
            raise _native.Error(
                f"column {name}: {len(column)} values, expected {len(cells[0])} as in column {names[0]}"
            )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_cell(value) for value in row] for row in zip(*cells))
    return text.getvalue()


def _cells(column: np.ndarray) -> list[Any]:
    """Moments as text: in an array they are numbers of nobody knows which unit."""
    if column.dtype.kind != "M":
        return list(column.tolist())
    return [None if moment == "NaT" else moment for moment in np.datetime_as_string(column).tolist()]


def _names(columns: Any) -> list[str]:
    if isinstance(columns, np.ndarray) and columns.dtype.names:
        return list(columns.dtype.names)
    names = getattr(columns, "columns", None)
    if names is None and isinstance(columns, Mapping):
        names = columns
    if names is None:
        raise TypeError(
            f"{type(columns).__name__} has no named columns; expected a path, a measurement or columns by name"
        )
    return list(names)


def _cell(value: Any) -> Any:
    """Empty where there is no number; digits that give the same number again."""
    return "" if value is None or value != value else value
