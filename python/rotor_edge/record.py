"""Frozen records, made from JSON objects by their annotations."""

import json
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Callable, Mapping, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from . import tables

R = TypeVar("R", bound="Record")
Array = np.ndarray
"""Numbers; one that is not there is not a number."""


@dataclass(frozen=True, eq=False)
class Record:
    """Part of an answer; its fields are the keys of the command line's JSON, those that are words of Python with a ``_`` behind."""

    @classmethod
    def of(cls: type[R], found: Mapping[str, Any], **more: Any) -> R:
        """The record of a JSON object, with what the object does not hold."""
        held = {name: (name.removesuffix("_"), hint) for name, hint in _hints(cls).items() if name not in more}
        return cls(
            **{name: _converted(hint, found[key]) for name, (key, hint) in held.items() if key in found}, **more
        )


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Record):
    """What a command answers."""

    json: str = field(kw_only=True, default="", repr=False)
    """The JSON object, letter by letter as the command line prints it."""

    def as_dict(self) -> dict[str, Any]:
        """The whole JSON object."""
        return dict(json.loads(self.json))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={_brief(value)}' for name, value in tables.shown(self))})"

    def _repr_html_(self) -> str:
        return tables.of_pairs(type(self).__name__, tables.shown(self))


def _brief(value: Any) -> str:
    """A value in one line; of long ones, what they are."""
    text = repr(value)
    if len(text) <= 80 or isinstance(value, str):
        return text
    return f"<{len(value)} of them>" if isinstance(value, (tuple, dict, Array)) else f"{type(value).__name__}(…)"


_hints: Callable[[type], dict[str, Any]] = cache(get_type_hints)


def _converted(hint: Any, value: Any) -> Any:
    """A JSON value as its annotation wants it."""
    if value is None:
        return None
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is Array:
        return np.asarray(value, dtype=float)
    if origin is tuple:
        return tuple(_converted(arguments[0], part) for part in value)
    if origin is dict:
        return {name: _converted(arguments[1], part) for name, part in value.items()}
    if type(None) in arguments:
        return _converted(Union[tuple(a for a in arguments if a is not type(None))], value)
    if isinstance(hint, type) and issubclass(hint, Record):
        return hint.of(value)
    return value
