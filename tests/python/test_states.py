"""What a monitor says of itself, as a user's script sees it: no verdict outlives its evidence, and nothing is forgotten.

python-can and the DBC file send readings, hear the states and command the monitor; times are real here.
"""

import time

import pytest

import monitor
from conftest import COMPRESSED, NODE, SECONDS, run
from test_isotp import TO_HOST, TO_NODE, PyPi
from test_monitor import next_heartbeat

QUICK = ["--set", "age_limit_s=2", "--set", "learning_readings=3", "--set", "learning_s=0"]
"""After the others, so that these count."""


class Commander:
    """Commands over can-isotp."""

    def __init__(self, place):
        self.place, self.link = place, PyPi(place.wire, TO_NODE, TO_HOST)
        self.close = self.link.close

    def command(self, what, body=b""):
        """Outcome, detail and body of the answer."""
        data = monitor.request(self.place.key, NODE, what, self.place.next_counter(), body)
        self.link.send(data)
        outcome, _, _, detail, body = monitor.open_whole_answer(self.place.key, self.link.receive(), data)
        return outcome, detail, body


@pytest.fixture
def commander(place):
    opened = []

    def open_one():
        opened.append(Commander(place))
        return opened[-1]

    yield open_one
    for commander in opened:
        commander.close()


def send(bus, row, speed_rpm, probes, **more):
    for frame in monitor.reading(NODE, row, speed_rpm, probes, **more):
        bus.send(frame)


def told(bus, state, **signals):
    """Waits for this state; all of its signals."""
    expected = {"State": state, **signals}
    return monitor.wait_for(bus, "State", NODE, SECONDS, lambda heard: expected.items() <= heard.items())


def healthy(bus, desk, count, first=0):
    for row in range(first, first + count):
        send(bus, row, *desk.record[row])
    monitor.collect(bus, NODE, last=first + count - 1)


def misfit(speed_rpm, probes):
    """The probes of one bearing the other way round: no unbalance explains that."""
    return speed_rpm, [*probes[:2], *((-cos, -sin) for cos, sin in probes[2:])]


def test_state_is_learning_then_tracking_then_stale_in_silence(place, desk):
    place.start("--rotor", desk.rotor, *COMPRESSED, *QUICK)
    bus = place.wire.join()
    healthy(bus, desk, 1)
    told(bus, "Learning", Reason="Learning")
    healthy(bus, desk, 5, first=1)
    judged = time.monotonic()
    told(bus, "Tracking", Reason="None")
    heard = told(bus, "Stale", Reason="Age")
    assert 1.5 <= time.monotonic() - judged <= 4.0
    assert 2.0 <= heard["Age"] <= 2.5
    healthy(bus, desk, 1, first=6)
    told(bus, "Tracking", Reason="None")


def test_lost_probe_is_named_and_remaining_probes_are_used(place, desk):
    place.start("--rotor", desk.rotor, *COMPRESSED, *QUICK)
    bus = place.wire.join()
    healthy(bus, desk, 5)
    told(bus, "Tracking", Reason="None")
    speed_rpm, probes = desk.record[5]
    send(bus, 5, speed_rpm, [probes[0], None, *probes[2:]])
    told(bus, "Tracking", Reason="Probes", Missing=0b0010)
    send(bus, 6, speed_rpm, [None, None, *probes[2:]])
    told(bus, "Blind", Missing=0b0011)
    send(bus, 7, speed_rpm, probes, gaps_v=[-9.0, -9.5, -1.0, -9.0])
    told(bus, "Tracking", Reason="Gap", Missing=0b0100)
    send(bus, 8, speed_rpm, probes, keyphasor="Missing")
    told(bus, "Blind", Reason="Keyphasor")
    # readings go on, and none of them is evidence
    for row in range(9, 40):
        send(bus, row, speed_rpm, [None] * 4)
        time.sleep(0.1)
    told(bus, "Stale", Reason="Probes", Missing=0b1111)
    send(bus, 40, speed_rpm, probes[:3])
    told(bus, "Stale", Reason="ProbeCount")


def test_flag_survives_power_cut_until_acknowledged(place, desk, commander):
    options = ["--rotor", desk.rotor, *COMPRESSED, *QUICK]
    place.start(*options)
    bus = place.wire.join()
    healthy(bus, desk, 20)
    for row in range(20, 26):
        send(bus, row, *misfit(*desk.record[row]))
    flagged = told(bus, "Flagged")
    assert flagged["Cause"] in ["Rise", "Ratio"] and flagged["CauseSuspect"] > 0
    kept = {name: flagged[name] for name in ["Cause", "CauseSuspect"]}
    place.cut_power()
    place.wire.leave()
    place.start(*options)
    bus = place.wire.join()
    assert told(bus, "Flagged", **kept)["Age"] == float("inf")
    # what fits again does not lower it
    healthy(bus, desk, 5)
    told(bus, "Flagged", Reason="None", **kept)
    boss = commander()
    assert boss.command(monitor.ACKNOWLEDGE)[0] == "accepted"
    told(bus, "Tracking", Cause="None")
    boss.close()
    place.cut_power()
    place.wire.leave()
    place.start(*options)
    bus = place.wire.join()
    assert told(bus, "Waiting")["Cause"] == "None"


def test_thresholds_are_told_set_and_refused_with_the_key(place, desk, commander):
    place.start("--rotor", desk.rotor)
    boss = commander()
    outcome, _, body = boss.command(monitor.GET_THRESHOLDS)
    values = list(monitor.THRESHOLDS.unpack(body))
    assert outcome == "accepted" and values[0] == 1 and values[1] == 0.5
    values[1] = 0.75
    assert boss.command(monitor.SET_THRESHOLDS, monitor.THRESHOLDS.pack(*values))[0] == "accepted"
    assert boss.command(monitor.GET_THRESHOLDS)[2] == monitor.THRESHOLDS.pack(*values)
    spoilt = [*values]
    spoilt[1] = -1.0
    outcome, detail, _ = boss.command(monitor.SET_THRESHOLDS, monitor.THRESHOLDS.pack(*spoilt))
    assert outcome == "thresholds" and detail[0] == 2
    assert boss.command(monitor.SET_THRESHOLDS, b"short")[0] == "thresholds"
    assert boss.command(monitor.GET_THRESHOLDS)[2] == monitor.THRESHOLDS.pack(*values)
    said = run("thresholds", "--bus", place.wire.spec, "--node", NODE, "--key", place.key_file)
    assert "rise" in said and "0.75" in said


def test_monitor_without_model_waits_for_deployment(place, desk):
    place.start()
    bus = place.wire.join()
    told(bus, "NoModel", Reason="NothingStored")
    send(bus, 0, *desk.record[0])
    counted = next_heartbeat(bus)
    assert (counted["Unmodelled"], counted["Readings"], counted["Checksum"]) == (1, 0, 0)
    run("deploy", desk.rotor, "--bus", place.wire.spec, "--node", NODE, "--key", place.key_file, "--restart")
    told(bus, "Waiting")
    answers = monitor.play(bus, NODE, desk.record[1:2])
    assert list(answers) == [0]
