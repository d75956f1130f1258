"""How the package behaves in a program that does other things as well."""

import inspect
import os
import re
import signal
import subprocess
import sys
import threading
import time
from importlib.metadata import requires
from typing import get_type_hints

import pytest
import rotor_edge
from conftest import TURBINE

ROTOR, RECORD, RUNUP = TURBINE / "rotor.toml", TURBINE / "record.csv", TURBINE / "runup-day126.csv"


def test_other_threads_go_on_during_work():
    """Were the interpreter held, the other thread would count nothing between the beginning and the end."""
    seen, done = [], threading.Event()

    def count():
        while not done.is_set():
            seen.append(time.perf_counter())
            time.sleep(0.001)

    counting = threading.Thread(target=count)
    begun = time.perf_counter()
    counting.start()
    rotor_edge.improve(ROTOR, RUNUP)
    ended = time.perf_counter()
    done.set()
    counting.join()
    longest = max(b - a for a, b in zip([begun, *seen], [*seen, ended]))
    assert longest < (ended - begun) / 4


@pytest.fixture
def ctrl_c():
    """A process in the background may have been begun with Ctrl-C ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_the_waiting_at_once(ctrl_c):
    timer = threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    begun = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        # some 20 s of work
        rotor_edge.track(ROTOR, RECORD, method="joint", later_runup=[RUNUP])
    assert time.perf_counter() - begun < 5


def test_work_that_nobody_waits_for_ends_at_its_next_step():
    """A process is at its end when its last thread does no more: the processor's time tells."""
    script = (
        "import resource, rotor_edge, sys, time\n"
        "def enough(done, of):\n"
        "    raise RuntimeError('enough')\n"
        "try:\n"
        "    rotor_edge.track(sys.argv[1], sys.argv[2], method='joint', progress=enough)\n"
        "except RuntimeError as error:\n"
        "    print(error)\n"
        "time.sleep(0.5)\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_utime\n"
        "time.sleep(1)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, ROTOR, RECORD], capture_output=True, text=True, timeout=60)
    said, worked_s = done.stdout.split()
    assert (said, done.stderr) == ("enough", "") and float(worked_s) < 0.3


def test_nothing_is_printed(capfd):
    rotor_edge.improve(ROTOR, RUNUP)
    assert capfd.readouterr() == ("", "")


def test_numpy_is_all_it_needs():
    assert [re.split(r"\W", needed)[0] for needed in requires("rotor-edge")] == ["numpy"]


def test_functions_have_docstrings_and_resolvable_annotations():
    for name in rotor_edge.__all__:
        member = getattr(rotor_edge, name)
        if inspect.isfunction(member):
            assert member.__doc__ and "return" in get_type_hints(member), name
