"""Recordings: what the program writes, python-can's own tools convert and play, and the numbers stay."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import can
import pytest

import monitor
from conftest import NODE, answers_of, first_readings, run
from test_monitor import same_to_the_bit

# 14 frames each with its answer, which all fit a kernel's receive buffer (208 KiB, 768 bytes a frame), and so none is lost
# however slowly somebody listens
READINGS = 16
FRAMES_OF_A_READING = 6
FIRST_ANSWER = monitor.DBC.get_message_by_name("Status").frame_id
GAP_S = 0.0005


def tool(name, *arguments):
    """One of python-can's own tools."""
    command = [sys.executable, "-m", f"can.{name}", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def record(desk, folder, *options):
    """What `replay` writes of the first readings; its own numbers must be those of the desk."""
    log = folder / "recorded.log"
    answers = answers_of(desk.rotor, first_readings(READINGS, folder), "--log", log, *options)
    assert answers == {row: desk.answers[row] for row in range(READINGS)}
    return log


def content(path):
    """Identifier and bytes of every frame, through python-can's reader."""
    return [(message.arbitration_id, bytes(message.data)) for message in can.LogReader(path)]


def test_a_recording_survives_every_format_of_python_can(desk, tmp_path):
    recorded = record(desk, tmp_path)
    original = content(recorded)
    results, answers = monitor.Results(NODE), {}
    for message in can.LogReader(recorded):
        result = results.take(message)
        if result:
            answers[result["Status"]["Sequence"]] = result
    assert sorted(answers) == list(range(READINGS))
    for row, result in answers.items():
        same_to_the_bit(result, desk.answers[row])
    said = numbers(run("decode", recorded, "--json"))
    assert said["frames"] == len(original)
    for kind in ["asc", "blf"]:
        converted = tmp_path / f"converted.{kind}"
        tool("logconvert", recorded, converted)
        assert content(converted) == original, kind
        # and back, into a log that python-can wrote and the program reads
        again = tmp_path / f"from-{kind}.log"
        tool("logconvert", converted, again)
        assert content(again) == original, kind
        assert numbers(run("decode", again, "--json")) == said, kind


def numbers(said):
    """What `decode` says, without times, which ASC rounds."""
    decoded = json.loads(said)
    for node in decoded["nodes"]:
        for result in node["results"]:
            del result["time_s"]
    return decoded


@pytest.fixture
def recorded(wire, desk, tmp_path):
    """Recorded over this bus, before there is a monitor on it that would have the same number."""
    return record(desk, tmp_path, "--bus", wire.spec)


@pytest.mark.parametrize("kind", ["log", "asc", "blf"])
def test_a_recording_played_onto_the_bus_gives_the_same_numbers(recorded, node, desk, tmp_path, kind):
    # a player that also played the monitor's own frames would be a second monitor with its number
    readings = tmp_path / "readings.log"
    lines = [line for line in recorded.read_text().splitlines(True) if int(line.split()[2].split("#")[0], 16) < FIRST_ANSWER]
    assert len(lines) == READINGS * FRAMES_OF_A_READING
    readings.write_text("".join(lines))
    played = tmp_path / f"played.{kind}"
    if kind != "log":
        tool("logconvert", readings, played)
    else:
        readings.rename(played)
    listener = node.wire.join()
    there = dict(node.wire.arguments)
    where = ["-i", there.pop("interface"), "-c", there.pop("channel")]
    more = ["--bus-kwargs", *(f"{name}={value}" for name, value in there.items())] if there else []
    # heard while it is played: a kernel's socket keeps only so many frames
    with ThreadPoolExecutor(1) as other:
        playing = other.submit(tool, "player", *where, *more, "--ignore-timestamps", "-g", GAP_S, played)
        answers = monitor.collect(listener, NODE, last=READINGS - 1, seconds=120)
        playing.result()
    assert list(answers) == list(range(READINGS))
    for row, result in answers.items():
        same_to_the_bit(result, desk.answers[row])
