"""A rotor of ROSS itself, as it is in memory: in an environment of its own, since the package needs no ROSS."""

import importlib.util
import json
import sys

import numpy as np
import pytest
import rotor_edge
from conftest import ROOT

MADE = ROOT / "tests" / "data" / "ross"


@pytest.fixture(scope="module")
def rotors():
    """The rotors whose files are beside the script that makes them."""
    found = importlib.util.spec_from_file_location("make_ross_rotors", MADE / "make_ross_rotors.py")
    module = importlib.util.module_from_spec(found)
    sys.modules[found.name] = module
    found.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name, ending", [("constant", "toml"), ("table", "json")])
def test_a_rotor_in_memory_is_what_its_file_is(rotors, name, ending):
    answer = rotor_edge.import_rotor(getattr(rotors, name)())
    from_file = rotor_edge.import_rotor(MADE / f"{name}.{ending}")
    assert (answer.carried, answer.left) == (from_file.carried, from_file.left)
    assert {**answer.rotor.drawing, "name": name} == from_file.rotor.drawing


def test_critical_speeds_are_those_of_the_rotor_in_ross(rotors):
    answer = rotor_edge.import_rotor(rotors.constant())
    ours = rotor_edge.check(answer.rotor).critical_speeds_rpm * np.pi / 30
    theirs = json.loads((MADE / "expected.json").read_text())["constant.toml"]["critical_speeds"]
    # those of the same shaft in finer elements
    assert len(theirs) >= 3 and np.allclose(ours[: len(theirs)], theirs, rtol=5e-4)
