"""The dataclasses of the answers are those of the program's own types."""

import subprocess
import sys

import pytest
from conftest import ROOT

GENERATOR = ROOT / "python" / "generate_answers.py"


def test_dataclasses_of_the_answers_are_up_to_date():
    if not GENERATOR.exists():
        pytest.skip("the generator is not beside the tests")
    done = subprocess.run([sys.executable, GENERATOR, "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
