"""What the tests share: where things are, the DBC file, and the core's own codec."""

import json
import os
import subprocess
from pathlib import Path

import cantools
import pytest

ROOT = Path(__file__).resolve().parents[2]
RELEASE = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"


@pytest.fixture(scope="session")
def dbc():
    return cantools.database.load_file(ROOT / "core" / "rotor-edge.dbc")


@pytest.fixture(scope="session")
def core():
    """Asks the core what a frame means: ``core("101#0700")``; see codec.rs."""
    with subprocess.Popen(
        [RELEASE / "examples" / "codec"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as codec:

        def ask(line):
            codec.stdin.write(line + "\n")
            return json.loads(codec.stdout.readline())

        yield ask
        codec.stdin.close()
