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
VCAN = "vcan0"
NODE = 1


def pytest_collection_modifyitems(items):
    def exists(item):
        parameters = getattr(item, "callspec", None) and item.callspec.params or {}
        return parameters.get("other") != "kernel" or parameters["wires"] == "vcan"

    items[:] = filter(exists, items)


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
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@dataclass
class Desk:
    """The sample as the desk knows it."""

    rotor: Path
    record: list
    answers: dict = field(repr=False)
    """The desktop's JSON, by row: `replay --json --answers`, in process."""


def answers_of(rotor):
    replayed = run("replay", "--identified", "--rotor", rotor, "--record", SAMPLE / "record.csv", "--json", "--answers")
    return {answer["row"]: answer for answer in json.loads(replayed)["answers"]}


@pytest.fixture(scope="session")
def desk(tmp_path_factory):
    rotor = tmp_path_factory.mktemp("desk") / "identified.toml"
    runup = SAMPLE / "runup-day000.csv"
    run("identify", SAMPLE / "rotor.toml", SAMPLE / "record.csv", "--days", "0..2", "--runup", runup, "-o", rotor)
    return Desk(rotor, monitor.read_record(SAMPLE / "record.csv"), answers_of(rotor))


@dataclass
class Wire:
    """A bus, for both sides: what to give to `--bus`, and how python-can joins it."""

    spec: str
    arguments: dict
    joined: list = field(default_factory=list)

    def join(self):
        bus = can.Bus(**self.arguments)
        if self.arguments["interface"] == "slcan":
            # pyserial leaves small packets to wait for each other, which costs 40 ms a reading
            bus.serialPortOrig._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.joined.append(bus)
        return bus

    def leave(self):
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
    counter: int = 0

    def next_counter(self):
        self.counter += 1
        return self.counter


@pytest.fixture
def node(wire, desk, tmp_path):
    """A fresh monitor that holds the sample's model; its own last words must be those of a clean end."""
    key = secrets.token_bytes(32)
    key_file = tmp_path / "monitor.key"
    key_file.write_text(key.hex() + "\n")
    state = tmp_path / "monitor.state"
    command = [PROGRAM, "node", "--bus", wire.spec, "--rotor", desk.rotor, "--key", key_file, "--state", state]
    watcher = wire.join()
    with subprocess.Popen(
        [*command, "--node", str(NODE), "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        try:
            answers = lambda heartbeat: heartbeat["State"] not in ["Listening", "Conflict"]
            monitor.wait_for(watcher, "Heartbeat", NODE, 60, answers)
            yield Monitor(wire, key, key_file, state)
        finally:
            program.send_signal(signal.SIGINT)
            _, complaint = program.communicate(timeout=20)
        assert program.returncode == 0, complaint
