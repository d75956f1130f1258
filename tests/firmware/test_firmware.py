"""The firmware in the emulator, met with python-can over SLCAN as any adapter, against the core on the host: the same bits.

Rust does not contract multiplications and additions, square roots are libm's on both, and the random numbers are integers:
so nothing may differ, and nothing is allowed to.
"""

import os
import random
import re
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

import monitor
from conftest import COMPRESSED, NODE, SAMPLE, Wire, answers_of, run
from test_monitor import next_heartbeat, same_to_the_bit

KEY = bytes([0x52]) * 32
SECONDS = 60

# The seal acts from day 125 on, and the record has more days than these after it.
DAYS_AFTER = 300


@dataclass
class Board:
    wire: Wire
    key_file: Path
    log_file: Path
    console: Path

    def log(self):
        return self.log_file.read_text()

    def wait_for_log(self, pattern, seconds=SECONDS):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := re.findall(pattern, self.log()):
                return found
            time.sleep(0.05)
        raise TimeoutError(f"no {pattern!r} in the log:\n{self.log()}")

    def deploy(self, rotor, *arguments):
        """The program takes the wire for itself: a serial line has one other end."""
        self.wire.leave()
        run("deploy", rotor, "--bus", self.wire.spec, "--node", NODE, "--key", self.key_file, *arguments)

    def take_milliseconds_for_days(self):
        """The record's readings arrive in quick succession, and are to be judged as those of days."""
        self.wire.leave()
        run("thresholds", "--bus", self.wire.spec, "--node", NODE, "--key", self.key_file, *COMPRESSED)

    def play(self, record, answered=None):
        return monitor.play(self.wire.join(), NODE, record, answered)

    def reset(self):
        """As the reset button does it: memory keeps what it holds."""
        self.wire.leave()
        with socket.socket(socket.AF_UNIX) as console:
            console.connect(str(self.console))
            console.sendall(b"system_reset\n")
            time.sleep(0.2)


def free_port():
    """A port that nobody has, below the ephemeral ports of Linux, which outgoing connections take (from 32768 on)."""
    while True:
        port = random.randrange(20000, 32768)
        with socket.socket() as trial:
            try:
                trial.bind(("127.0.0.1", port))
            except OSError:
                continue
        return port


@pytest.fixture
def board(tmp_path):
    port = free_port()
    there = {"interface": "slcan", "channel": f"socket://127.0.0.1:{port}", "sleep_after_open": 0}
    wire = Wire(f"slcan:127.0.0.1:{port}", there)
    board = Board(wire, tmp_path / "key", tmp_path / "log", tmp_path / "console")
    board.key_file.write_text(KEY.hex() + "\n")
    command = [monitor.ROOT / "boards" / "emulator", str(port)]
    console = f"unix:{board.console},server=on,wait=off"
    with open(board.log_file, "w") as log:
        with subprocess.Popen(command, stdout=log, stdin=subprocess.DEVNULL, env=os.environ | {"MONITOR": console}) as program:
            try:
                board.wait_for_log("Start")
                yield board
            finally:
                wire.leave()
                program.terminate()
    assert "panic" not in board.log() and "fault" not in board.log(), board.log()


@pytest.fixture(scope="session")
def better(tmp_path_factory):
    """The model with the seal that acts from day 125 on."""
    rotor = tmp_path_factory.mktemp("better") / "better.toml"
    run("improve", SAMPLE / "rotor.toml", SAMPLE / "runup-day126.csv", "-o", rotor)
    return rotor


def assert_same(answers, expected):
    assert sorted(answers) == sorted(expected)
    for row, result in answers.items():
        same_to_the_bit(result, expected[row])


def test_whole_record_and_improved_model_equal_host_to_the_bit(board, desk, better, tmp_path):
    board.deploy(desk.rotor, "--restart")
    board.take_milliseconds_for_days()
    assert_same(board.play(desk.record), desk.answers)
    # before the event the better model misfits, and what a monitor does not trust bounds nothing
    header, *rows = (SAMPLE / "record.csv").read_text().splitlines(keepends=True)
    after_event = tmp_path / "after-event.csv"
    after_event.write_text("".join([header, *rows[-DAYS_AFTER:]]))
    record = desk.record[-DAYS_AFTER:]
    # the shapes of a model with effects are chosen for a range of speeds; `replay` takes the record's
    board.deploy(better, "--restart", "--fastest-rpm", max(speed_rpm for speed_rpm, _ in record))
    expected = answers_of(better, after_event)
    answers = board.play(record)
    assert_same(answers, expected)
    after = sum(result["Residual"]["Ratio"] for result in answers.values()) / len(answers)
    days_after = sorted(desk.answers)[-DAYS_AFTER:]
    before = sum(desk.answers[row]["ratio"] for row in days_after) / len(days_after)
    assert after < before / 5, "the better model fits what came after the event"


def test_model_and_counter_outlive_a_reset(board, desk):
    board.deploy(desk.rotor, "--counter", 41)
    deployed = next_heartbeat(board.wire.join())
    board.reset()
    board.wait_for_log(r"Start \{ counter: 41, model: Ok\(\(\)\)")
    after = next_heartbeat(board.wire.join())
    assert after["Checksum"] == deployed["Checksum"] and after["Accepted"] == 0
    with pytest.raises(AssertionError, match="(?i)counter|replay"):
        board.deploy(desk.rotor, "--counter", 41)
    board.deploy(desk.rotor, "--counter", 42)


def test_the_serial_line_answers_as_adapters_do(board):
    with socket.create_connection(("127.0.0.1", int(board.wire.spec.rpartition(":")[2]))) as line:
        line.settimeout(5)

        def ask(text, answer):
            line.sendall(text)
            got = b""
            while len(got) < len(answer):
                got += line.recv(len(answer) - len(got))
            assert got == answer, text

        ask(b"C\r", b"\r")
        ask(b"S6\r", b"\r")
        ask(b"V\r", b"V1013\r")
        ask(b"nonsense\r", b"\a")
        ask(b"t0000\r", b"\a")  # closed
        ask(b"x" * 1000 + b"\r", b"\a")
        line.settimeout(1.5)
        with pytest.raises(TimeoutError):
            line.recv(1)  # heartbeats of a second stay inside
        line.settimeout(5)
        line.sendall(b"O\r")
        assert line.recv(1) == b"\r"
        assert line.recv(1) == b"t"
