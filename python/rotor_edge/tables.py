"""Records as a notebook shows them: tables in tables, long lists cut short."""

from dataclasses import fields, is_dataclass
from html import escape
from typing import Any

import numpy as np

MOST_ROWS = 8


def of_pairs(caption: str, pairs: list[tuple[str, Any]]) -> str:
    """A table of names and values."""
    rows = (f"<tr><th>{escape(name)}</th><td>{cell(value)}</td></tr>" for name, value in pairs)
    return f"<table><caption>{escape(caption)}</caption>{''.join(rows)}</table>"


def shown(record: Any) -> list[tuple[str, Any]]:
    """Names and values of a record, but for those that only programs read."""
    return [(f.name, getattr(record, f.name)) for f in fields(record) if f.repr]


def cell(value: Any) -> str:
    """A value in a table."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if hasattr(value, "drawing"):
        return escape(repr(value))
    if is_dataclass(value):
        return of_pairs("", shown(value))
    if isinstance(value, dict):
        return of_pairs("", [(str(name), part) for name, part in value.items()])
    if isinstance(value, (tuple, np.ndarray)):
        return _list(list(value))
    return escape(str(value))


def _list(values: list[Any]) -> str:
    cut = f"… {len(values)} in all" if len(values) > MOST_ROWS else ""
    values = values[:MOST_ROWS]
    if not any(map(is_dataclass, values)):
        return ", ".join([*map(cell, values), *([cut] if cut else [])])
    names = "".join(f"<th>{escape(name)}</th>" for name, _ in shown(values[0]))
    rows = ("".join(f"<td>{cell(part)}</td>" for _, part in shown(value)) for value in values)
    return f"<table><tr>{names}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>{cut}"
