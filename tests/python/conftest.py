"""What the tests share: the program, the buses it can be met on, a monitor with its key, the desktop's own answers."""

import json
import os
import secrets
import signal
import socket
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable

import can
import pytest

import monitor

SAMPLE = monitor.ROOT / "host-sim" / "sample" / "turbine"
RELEASE = Path(os.environ.get("CARGO_TARGET_DIR", monitor.ROOT / "target")) / "release"
PROGRAM = RELEASE / "rotor-edge"
WIDE = {**os.environ, "COLUMNS": "10000"}
"""A sentence of the program is one line."""
VCAN = "vcan0"
NODE = 1
SECONDS = 20
"""Patience with a machine that is busy."""
TIME_CONSTANTS_S = {"average_s": 1, "persistence_s": 10, "level_s": 864_000, "learning_s": 60, "growth_s": 86_400}
COMPRESSED = [part for name, s in TIME_CONSTANTS_S.items() for part in ["--set", f"{name}={s * 2.0**-36!r}"]]
"""A record of days is sent in milliseconds: every time constant shrinks by a power of two, so that a reading is as far from the
last as a day is, and no bit changes."""


def pytest_collection_modifyitems(items):
    def is_wanted(item):
        parameters = getattr(item, "callspec", None) and item.callspec.params or {}
        if parameters.get("wires") == "vcan":
            # what a file holds does not depend on the bus, and conversion is slow in an emulator
            return parameters.get("kind") not in ["asc", "blf"]
        # the kernel's ISO-TP is on the kernel's bus alone
        return parameters.get("other") != "kernel"

    items[:] = filter(is_wanted, items)


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


def run(*arguments):
    """What a command of the program says; it must succeed."""
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, env=WIDE)
    assert done.returncode == 0, done.stderr
    return done.stdout


@dataclass
class Desk:
    """The sample as the desk knows it."""

    rotor: Path
    record: list
    answers: dict = field(repr=False)
    """The desktop's JSON, by row: `replay --json --answers`, in process."""


def answers_of(rotor, record, *options):
    """What `replay` says of every reading; in process unless the options say otherwise."""
    arguments = ["--identified", "--rotor", rotor, "--record", record, "--json", "--answers", *options]
    return {answer["row"]: answer for answer in json.loads(run("replay", *arguments))["answers"]}


def first_readings(number, folder):
    """A record of the sample's first readings."""
    short = folder / "short.csv"
    with open(SAMPLE / "record.csv") as rows:
        short.write_text("".join(next(rows) for _ in range(number + 1)))
    return short


@pytest.fixture(scope="session")
def desk(tmp_path_factory):
    """Made once for a session; `run` hands what it made to the emulated machine, which is slow."""
    folder = Path(os.environ.get("ROTOR_EDGE_DESK") or tmp_path_factory.mktemp("desk"))
    # tests side by side make it side by side
    folder = folder / os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    folder.mkdir(exist_ok=True)
    rotor, answers = folder / "identified.toml", folder / "answers.json"
    if not answers.exists():
        runup = SAMPLE / "runup-day000.csv"
        run("identify", SAMPLE / "rotor.toml", SAMPLE / "record.csv", "--days", "0..2", "--runup", runup, "-o", rotor)
        answers.write_text(json.dumps(list(answers_of(rotor, SAMPLE / "record.csv").values())))
    by_row = {answer["row"]: answer for answer in json.loads(answers.read_text())}
    return Desk(rotor, monitor.read_record(SAMPLE / "record.csv"), by_row)


class Participant:
    """A python-can bus that is always heard, so that no buffer of the system overflows meanwhile."""

    def __init__(self, bus):
        self.reader = can.BufferedReader()
        self.notifier = can.Notifier(bus, [self.reader])
        self.send = bus.send
        self.recv = self.reader.get_message

    def forget(self):
        """Drops what was heard so far."""
        while self.recv(0):
            pass

    def stop(self):
        self.notifier.stop()


@dataclass
class Wire:
    """A bus, for both sides: what to give to `--bus`, and how python-can joins it."""

    spec: str
    arguments: dict
    joined: list = field(default_factory=list)
    heard: list = field(default_factory=list)

    def join(self):
        self.heard.append(Participant(self.bus()))
        return self.heard[-1]

    def bus(self):
        bus = can.Bus(**self.arguments)
        if self.arguments["interface"] == "slcan":
            # pyserial leaves small packets to wait for each other, which costs 40 ms a reading
            bus.serialPortOrig._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # nothing says that the channel is open, but what comes after does
            assert bus.get_version(SECONDS)[0] is not None, "no answer over SLCAN"
        self.joined.append(bus)
        return bus

    def leave(self):
        while self.heard:
            self.heard.pop().stop()
        while self.joined:
            self.joined.pop().shutdown()


def first_object(stream):
    """The JSON object that a program prints first, over several lines."""
    text = ""
    for line in stream:
        text += line
        if line == "}\n":
            break
    return json.loads(text)


@pytest.fixture(scope="session", params=["socketcand", "slcan", pytest.param("vcan", marks=pytest.mark.vcan)])
def wires(request):
    """One bus of each kind for the whole session."""
    if request.param == "vcan":
        yield Wire(f"socketcan:{VCAN}", {"interface": "socketcan", "channel": VCAN})
        return
    command = [PROGRAM, "bus", "--json", "--slcan", "0", "--socketcand", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as program:
        opened = first_object(program.stdout)
        slcan, socketcand = opened["slcan_port"], opened["socketcand_port"]
        if request.param == "slcan":
            channel = f"socket://127.0.0.1:{slcan}"
            yield Wire(opened["slcan"], {"interface": "slcan", "channel": channel, "sleep_after_open": 0})
        else:
            there = {"interface": "socketcand", "host": "127.0.0.1", "port": socketcand, "channel": VCAN, "tcp_tune": True}
            yield Wire(opened["socketcand"], there)
        program.send_signal(signal.SIGINT)
        assert program.wait(10) == 0


@pytest.fixture
def wire(wires):
    """A bus that everybody leaves at the end of the test."""
    yield wires
    wires.leave()


@dataclass
class Monitor:
    """A monitor in a process of its own."""

    wire: Wire
    key: bytes
    key_file: Path
    state: Path
    program: subprocess.Popen = None
    counter: int = 0

    def start(self, *options):
        """In a process of its own, until it has listened."""
        watcher = self.wire.join()
        command = [PROGRAM, "node", "--bus", self.wire.spec, "--node", str(NODE), "--json"]
        command += ["--key", self.key_file, "--state", self.state, *options]
        self.program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        monitor.wait_for(watcher, "State", NODE, 60)
        return self

    def cut_power(self):
        """Without a word."""
        self.program.kill()
        self.program.communicate(timeout=20)

    def end(self):
        """Its own last words must be those of a clean end."""
        self.program.send_signal(signal.SIGINT)
        _, complaint = self.program.communicate(timeout=20)
        assert self.program.returncode == 0, complaint

    def next_counter(self):
        self.counter += 1
        return self.counter


@pytest.fixture
def place(wire, tmp_path):
    """A monitor that is not running yet, with its key and its state file."""
    key = secrets.token_bytes(32)
    key_file = tmp_path / "monitor.key"
    key_file.write_text(key.hex() + "\n")
    monitor_here = Monitor(wire, key, key_file, tmp_path / "monitor.state")
    yield monitor_here
    if monitor_here.program and monitor_here.program.poll() is None:
        monitor_here.end()


@pytest.fixture
def node(place, desk):
    """A fresh monitor that holds the sample's model and takes readings in quick succession for those of days."""
    return place.start("--rotor", desk.rotor, *COMPRESSED)
