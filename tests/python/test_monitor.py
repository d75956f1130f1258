"""A monitor as a user's script meets it: features encoded from the DBC file, sent, answered, compared with the desk."""

import struct

import pytest

import monitor
from conftest import NODE


def f32_bits(number):
    return struct.pack("<f", number)


def same_to_the_bit(result, answer):
    """A result that was put together here against the desktop's JSON."""
    vectors = {f"UnbalancePlane{plane}": pair for plane, pair in enumerate(answer["unbalance_g_mm"], 1)}
    vectors |= {"StaticUnbalance": answer["static_g_mm"], "DynamicUnbalance": answer["dynamic_g_mm"]}
    assert sum(name.startswith("UnbalancePlane") for name in result) == len(answer["unbalance_g_mm"])
    for name, pair in vectors.items():
        got = [result[name]["Cos"], result[name]["Sin"]]
        assert list(map(f32_bits, got)) == list(map(f32_bits, pair)), (answer["row"], name)
    residual = result["Residual"]
    assert f32_bits(residual["Sum"]) == f32_bits(answer["e_um"]), answer["row"]
    assert f32_bits(residual["Ratio"]) == f32_bits(answer["ratio"]), answer["row"]
    limits = result["Limits"]
    assert f32_bits(limits["Floor"]) == f32_bits(answer["floor_um"]), answer["row"]
    assert f32_bits(limits["Level"]) == f32_bits(answer["level_um"]), answer["row"]
    status = result["Status"]
    flags = ["Suspicious", "Flagged", "AtBound1", "AtBound2", "AtBound3", "AtBound4"]
    assert sum(status[flag] << bit for bit, flag in enumerate(flags)) == answer["flags"]
    assert (status["Suspect"], status["Streak"]) == (answer["suspect"] or 0, answer["streak"])
    assert status["Used"] == sum(1 << probe - 1 for probe in answer["probes_used"])


def test_record_over_bus_equals_in_process_to_the_bit(node, desk):
    answers = monitor.play(node.wire.join(), NODE, desk.record)
    assert sorted(answers) == sorted(desk.answers)
    assert len(answers) == sum(any(probes) for _, probes in desk.record)
    assert any(None in probes for _, probes in desk.record), "the record has a lost probe"
    for row, result in answers.items():
        same_to_the_bit(result, desk.answers[row])
    # the record has what the comparison is for: a flag, a suspect, a plane on its bound
    statuses = [result["Status"] for result in answers.values()]
    for signal in ["Suspicious", "Flagged", "Suspect"]:
        assert any(status[signal] for status in statuses) and not all(status[signal] for status in statuses)


def next_heartbeat(bus):
    """All frames of the next heartbeat, as one."""
    bus.forget()
    signals = {}
    for name in ["Heartbeat", "State", *monitor.COUNTERS, "Model"]:
        signals |= monitor.wait_for(bus, name, NODE)
    return signals


def test_what_cannot_be_believed_is_counted_and_not_answered(node, desk):
    bus = node.wire.join()
    rows = iter(desk.record)

    def frames(sequence, **changes):
        speed_rpm, probes = next(rows)
        return monitor.reading(NODE, sequence, **{"speed_rpm": speed_rpm, "probes": probes} | changes)

    forged = frames(1)
    forged[-1].data[-1] ^= 1
    flipped = frames(2)
    flipped[2].data[0] ^= 0x10
    incomplete = frames(3)
    del incomplete[4]
    sent = [
        frames(0),
        forged,
        flipped,
        incomplete,
        frames(4, keyphasor="Missing"),
        frames(5, keyphasor="Unsteady"),
        frames(6, probes=[None] * 4),
        frames(7, speed_rpm=183.0),
        frames(8, speed_rpm=float("nan")),
        frames(10, keyphasor="NotStated"),
        frames(10),
        frames(4),
    ]
    for reading in sent:
        for frame in reading:
            bus.send(frame)
    assert list(monitor.collect(bus, NODE, last=10)) == [0, 10]
    counted = next_heartbeat(bus)
    assert counted["Readings"] == 2
    # checksum of two readings, speed of two others
    assert counted["Rejected"] == 4
    assert counted["Skipped"] == 3
    assert counted["Incomplete"] == 1
    # 1 and 2 were rejected before they counted as arrived, 3 was not whole, 9 was never sent
    assert counted["Lost"] == 4
    assert (counted["Repeated"], counted["Late"]) == (1, 1)
    assert counted["Protocol"] == int(monitor.DBC.version)


@pytest.mark.parametrize("to", [NODE, monitor.EVERYBODY])
def test_version_is_told_to_who_asks(node, core, to):
    bus = node.wire.join()
    bus.send(monitor.message("VersionQuery", to))
    version = monitor.wait_for(bus, "Version", NODE)
    assert version["Protocol"] == core("protocol")["version"]
    assert 1 <= version["OldestProtocol"] <= version["Protocol"]
    assert (version["Shapes"], version["ProbesHeld"], version["PlanesHeld"]) == (6, 8, 4)


def test_other_nodes_and_foreign_frames_are_left_alone(node, desk):
    bus = node.wire.join()
    speed_rpm, probes = desk.record[0]
    for frame in monitor.reading(NODE + 1, 0, speed_rpm, probes):
        bus.send(frame)
    # the same identifiers with 29 bits, and types that nobody knows
    for frame in monitor.reading(NODE, 0, speed_rpm, probes):
        frame.is_extended_id = True
        bus.send(frame)
    for message_type in [0, 7, 47, 54, 61]:
        frame = monitor.message("VersionQuery", NODE)
        frame.arbitration_id = message_type * 32 + NODE
        bus.send(frame)
    (answer,) = monitor.play(bus, NODE, desk.record[:1]).values()
    same_to_the_bit(answer, desk.answers[0])
    counted = next_heartbeat(bus)
    quiet = ["Lost", "Rejected", "Repeated", "Late", "Incomplete", "Stray", "Skipped", "Conflicts"]
    assert counted["Readings"] == 1 and not any(counted[name] for name in quiet), counted
