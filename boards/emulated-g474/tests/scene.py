"""What the tests share: the image that would be flashed, a board that runs it, the program that deploys to it."""

import bisect
import os
import random
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import monitor
from conftest import NODE, RELEASE, run

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from g474 import Nucleo  # noqa: E402
from g474.board import CRYSTAL_HZ  # noqa: E402
from g474.machine import Machine  # noqa: E402
from g474.slcan import SlcanServer  # noqa: E402
from light import shown  # noqa: E402

TARGET = Path(os.environ.get("CARGO_TARGET_DIR", monitor.ROOT / "boards" / "nucleo-g474re" / "target"))
IMAGE = Path(os.environ.get("NUCLEO_IMAGE", TARGET / "thumbv7em-none-eabihf" / "release" / "rotor-edge-nucleo-g474re"))
KEY = bytes([0x52]) * 32
"""Both are built into the image: ROTOR_EDGE_NODE=1, ROTOR_EDGE_KEY=5252…"""
SAMPLES = monitor.ROOT / "boards" / "sample"
LISTENS_S = 0.3
"""A node that starts listens for others with its number; long enough for its first heartbeat."""


def pytest_collection_modifyitems(items):
    """With several processes, one of them lives through the story, which takes a minute, and tells it to all that follow."""
    for item in items:
        if "story" in item.fixturenames:
            item.add_marker(pytest.mark.xdist_group("story"))


@pytest.fixture(scope="session")
def key_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("key") / "node.key"
    path.write_text(KEY.hex() + "\n")
    return path


def deploy(board, rotor, key_file, *arguments):
    """The program deploys over SLCAN, in step with the real time."""
    with SlcanServer(board) as server:
        return run("deploy", rotor, "--bus", f"slcan:127.0.0.1:{server.port}", "--node", NODE, "--key", key_file, *arguments)


@pytest.fixture(scope="session")
def deployed_flash(desk, key_file):
    """The second bank of a board that the sample's model was deployed to."""
    board = start()
    deploy(board, desk.rotor, key_file, "--counter", 1)
    return bytes(board.chip.flash.banks[1])


def start(flash=None, crystal_hz=CRYSTAL_HZ, run_s=LISTENS_S, damaged=()):
    """A board that holds something in its second bank, running since a moment."""
    board = Nucleo(IMAGE, crystal_hz=crystal_hz)
    if flash is not None:
        board.chip.flash.banks[1][:] = flash
    for address in damaged:
        board.chip.damage(address)
    board.power_on()
    board.run(run_s)
    return board


@pytest.fixture
def fresh():
    """A board whose second bank is erased."""
    board = start()
    yield board
    check(board)


@pytest.fixture
def board(deployed_flash):
    """A board that holds the sample's model."""
    board = start(deployed_flash)
    yield board
    check(board)


def check(board):
    """Nothing was used that the emulation does not know; a program that faults says so in a test that expects it."""
    assert not board.chip.unknown, board.chip.unknown
    assert not board.chip.core.faults, board.chip.core.faults


def said(board, name, since_s=0.0, sender="FDCAN1"):
    """(time, signals) of each such message of the board, from a time on."""
    kind = monitor.DBC.get_message_by_name(name)
    place = bisect.bisect_left(board.wire.log, since_s * 1e9, key=lambda entry: entry[0])
    return [
        (time_ns / 1e9, kind.decode(frame.data))
        for time_ns, by, frame in board.wire.log[place:]
        if by == sender and frame.identifier & ~monitor.NODE_BITS == kind.frame_id
    ]


def last_said(board, *names):
    """Signals of the last message of these names; ``None``: there was none."""
    kinds = {kind.frame_id: kind for kind in map(monitor.DBC.get_message_by_name, names)}
    for _, by, frame in reversed(board.wire.log):
        kind = kinds.get(frame.identifier & ~monitor.NODE_BITS)
        if by == "FDCAN1" and kind:
            return kind.decode(frame.data)
    return None


def state(board):
    """State and reason of the last heartbeat or change."""
    signals = last_said(board, "Heartbeat", "State")
    return signals and (str(signals["State"]), str(signals["Reason"])) or ("silent", "")


def until(board, condition, seconds, step_s=0.1):
    """Runs until something is true; fails if it does not become so."""
    end_s = board.now_s + seconds
    while not condition():
        assert board.now_s < end_s, f"not within {seconds} s; {state(board)}"
        board.run(step_s)
    return board.now_s


def causes(board):
    """Causes of the resets, one set after the other."""
    return [causes for _, causes in board.chip.resets]


def log(board, start=-1):
    """What the program logged since its last start, or another."""
    board.log.empty()
    command = [RELEASE / "rotor-edge-board-log", board.image]
    return subprocess.run(command, input=bytes(board.log.starts[start]), capture_output=True, check=True).stdout.decode()


@dataclass
class Story:
    """A machine that is learned, tracked, and then breaks; what was seen on the way."""

    board: Nucleo
    lights: dict
    """What LD2 showed in each state."""
    learned_flash: bytes
    flagged_flash: bytes
    flagged_changes: list
    """Writes and erasures between the two."""
    seconds: dict
    """How long it took to each state."""


@pytest.fixture(scope="session")
def story(deployed_flash, desk):
    """With the default thresholds: a minute of learning, then a bearing that shows three times what it did."""
    board = start(deployed_flash)
    lights, seconds = {"Waiting": shown(board, 2)}, {}
    speed_rpm, vectors_um = next(row for row in desk.record if None not in row[1])
    noise = random.Random(4)
    machine = Machine(board, speed_rpm, vectors_um, noise_um=lambda: noise.gauss(0, 0.3))
    turning_s = board.now_s
    for name, patience_s in [("Learning", 5.0), ("Tracking", 90.0)]:
        seconds[name] = until(board, lambda: state(board)[0] == name, patience_s) - turning_s
        lights[name] = shown(board, 2)
    flash = board.chip.flash
    learned_flash, changes = bytes(flash.banks[1]), len(flash.history)
    machine.vectors_um[2:] = [(3 * cos, 3 * sin) for cos, sin in machine.vectors_um[2:]]
    broken_s = board.now_s
    for name, patience_s in [("Suspicious", 5.0), ("Flagged", 30.0)]:
        seconds[name] = until(board, lambda: state(board)[0] == name, patience_s) - broken_s
        lights[name] = shown(board, 2)
    check(board)
    return Story(board, lights, learned_flash, bytes(flash.banks[1]), flash.history[changes:], seconds)


@pytest.fixture(scope="session")
def flagged_flash(story):
    return story.flagged_flash
