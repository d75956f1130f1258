"""What the tests share: the image that would be flashed, a board that runs it, the program that deploys to it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import monitor
from conftest import NODE, RELEASE, run

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from g474 import Nucleo, VirtualTimeBus  # noqa: E402
from g474.slcan import SlcanServer  # noqa: E402

TARGET = Path(os.environ.get("CARGO_TARGET_DIR", monitor.ROOT / "boards" / "nucleo-g474re" / "target"))
IMAGE = Path(os.environ.get("NUCLEO_IMAGE", TARGET / "thumbv7em-none-eabihf" / "release" / "rotor-edge-nucleo-g474re"))
KEY = bytes([0x52]) * 32
"""Both are built into the image: ROTOR_EDGE_NODE=1, ROTOR_EDGE_KEY=5252…"""
LISTENS_S = 0.3
"""A node that starts listens for others with its number; long enough for its first heartbeat."""


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
    board = Nucleo(IMAGE).power_on()
    board.run(LISTENS_S)
    deploy(board, desk.rotor, key_file)
    return bytes(board.chip.flash.banks[1])


@pytest.fixture
def fresh():
    """A board whose second bank is erased, running since a moment."""
    board = Nucleo(IMAGE).power_on()
    board.run(LISTENS_S)
    yield board
    check(board)


@pytest.fixture
def board(deployed_flash):
    """A board that holds the sample's model, running since a moment."""
    board = Nucleo(IMAGE)
    board.chip.flash.banks[1][:] = deployed_flash
    board.power_on()
    board.run(LISTENS_S)
    yield board
    check(board)


def check(board):
    """Nothing was used that the emulation does not know; a program that faults says so in a test that expects it."""
    assert not board.chip.unknown, board.chip.unknown
    assert not board.chip.core.faults, board.chip.core.faults


def said(board, name, since_s=0.0):
    """(time, signals) of each such message of the board, from a time on."""
    found = []
    for time_ns, sender, frame in board.wire.log:
        if sender == "FDCAN1" and time_ns >= since_s * 1e9:
            try:
                kind = monitor.DBC.get_message_by_frame_id(frame.identifier & ~monitor.NODE_BITS)
            except KeyError:
                continue
            if kind.name == name:
                found.append((time_ns / 1e9, kind.decode(frame.data)))
    return found


def causes(board):
    """Causes of the resets, one set after the other."""
    return [causes for _, causes in board.chip.resets]


def log(board, start=-1):
    """What the program logged since its last start, or another."""
    board.log.empty()
    command = [RELEASE / "examples" / "firmware_log", board.image]
    return subprocess.run(command, input=bytes(board.log.starts[start]), capture_output=True, check=True).stdout.decode()
