"""Asks a command of the command line: words in, its JSON object out."""

import os
from contextlib import contextmanager
from numbers import Real
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Callable, Iterator, Sequence, TypeVar

from . import _native
from .answers import Track
from .inputs import Rotor, as_csv

R = TypeVar("R")
Progress = Callable[[int, int | None], object]
"""Called with the steps that are done, and of how many where that is known."""


class Desk:
    """A folder where what is held in memory lies for one command."""

    def __init__(self, folder: str) -> None:
        self._folder = folder

    def __truediv__(self, name: str) -> str:
        return os.path.join(self._folder, name)

    def word(self, value: Any) -> str:
        """A value as a word of the command line; what is no file yet becomes one."""
        if isinstance(value, (str, Real)):
            return str(value)
        if isinstance(value, os.PathLike):
            return str(os.fspath(value))
        if isinstance(value, Rotor):
            return self._file("rotor", ".toml", value.text)
        if isinstance(value, Track):
            return self._file("track", ".csv", value.csv)
        return self._file("measured", ".csv", as_csv(value))

    def _file(self, stem: str, ending: str, text: str) -> str:
        path, number = Path(self / (stem + ending)), 1
        while path.exists():
            number += 1
            path = path.with_name(f"{stem}-{number}{ending}")
        path.write_text(text, encoding="utf-8")
        return str(path)

    def ask(
        self,
        command: str,
        *inputs: Any,
        progress: Progress | None = None,
        in_order: Sequence[tuple[str, str]] = (),
        **options: Any,
    ) -> str:
        """The JSON that ``rotor-edge command --json`` prints. An option that is None or False is left out, one that is True
        has no value, a list is given word by word. in_order: options of which each belongs to one before it."""
        words = [command, "--json", *(f"--{name}={value}" for name, value in in_order)]
        for name, value in options.items():
            option = "--" + name.replace("_", "-")
            if value is True:
                words.append(option)
            elif value is not None and value is not False:
                values = value if isinstance(value, (list, tuple)) else [value]
                words += [f"{option}={self.word(one)}" for one in values]
        words += ["--", *map(self.word, inputs)]
        return self.own(_native.answer, words, progress)

    def own(self, function: Callable[..., R], *arguments: Any) -> R:
        """Calls a function that reads files on this desk."""
        try:
            return function(*arguments)
        except _native.Error as error:
            # where a file in memory lies for now tells its owner nothing
            raise _native.Error(str(error).replace(self._folder + os.sep, "")) from None


@contextmanager
def desk() -> Iterator[Desk]:
    """A desk that is gone afterwards, even where an interrupted command still writes to it."""
    with TemporaryDirectory(prefix="rotor-edge-", ignore_cleanup_errors=True) as folder:
        yield Desk(folder)
