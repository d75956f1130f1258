"""What the tests share: the sample machines, and the program that Python has to agree with."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TURBINE = ROOT / "host-sim" / "sample" / "turbine"
KIT = ROOT / "host-sim" / "sample" / "kit"
PROGRAM = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "rotor-edge"
WIDE = {**os.environ, "COLUMNS": "10000"}
"""A sentence of the program is one line."""


def program(*words):
    """Runs the program."""
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=120, env=WIDE)


@pytest.fixture
def printed():
    """The JSON that the program prints for a command line."""

    def ask(*words):
        done = program(*words, "--json")
        assert done.returncode == 0, done.stderr
        return done.stdout.rstrip("\n")

    return ask


@pytest.fixture
def refused():
    """The sentence with which the program refuses a command line."""

    def ask(*words):
        done = program(*words)
        assert done.returncode == 1, done.stdout + done.stderr
        return done.stderr.rstrip("\n").removeprefix("rotor-edge: ")

    return ask
