"""Every number that a function takes reaches the command line under its own name, zero too."""

import inspect
from unittest import mock

import pytest
from rotor_edge import _native, commands

FUNCTIONS = [
    f for _, f in inspect.getmembers(commands, inspect.isfunction) if f.__module__ == commands.__name__ and f.__name__[0] != "_"
]
NUMBERS = (float, int, float | None, int | None)


class Asked(Exception):
    """Ends a function once it has asked."""


def words_of(function, **options):
    """The words that a function asks the program."""
    positional = [p for p in inspect.signature(function).parameters.values() if p.kind is not p.KEYWORD_ONLY]
    required = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
    inputs = {p.name: "some.csv" for p in {p.name: p for p in positional + required}.values() if p.default is p.empty}
    known = {"planes": [], "weights": [], "speeds": (500, 4_000, 21)}
    inputs = {name: known.get(name, value) for name, value in inputs.items()}
    with mock.patch.object(_native, "answer", side_effect=Asked) as asked, pytest.raises(Asked):
        function(**inputs, **options)
    return asked.call_args.args[0]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.__name__)
@pytest.mark.parametrize("first", [0, 1_000])
def test_numbers_reach_the_command_line_under_their_names(function, first):
    parameters = inspect.signature(function).parameters.values()
    names = [p.name for p in parameters if p.annotation in NUMBERS and p.kind is p.KEYWORD_ONLY]
    options = {name: first + (number if first else 0) for number, name in enumerate(names)}
    words = words_of(function, **options)
    assert [f"--{name.replace('_', '-')}={options[name]}" for name in names] == [
        word for name in names for word in words if word.startswith(f"--{name.replace('_', '-')}=")
    ]
