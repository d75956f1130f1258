"""Seals as a user's script makes and checks them: hmac over the frames, by the DBC file and docs/can-bus.md alone."""

import hmac
import struct
import time

import pytest

import monitor
from conftest import COMPRESSED, NODE

PATIENCE_S = 10


def code(key, frames):
    covered = b"".join(struct.pack("<H", frame.arbitration_id) + bytes(frame.data) for frame in frames)
    return int.from_bytes(hmac.digest(key, b"rotor-edge seal" + covered, "sha256")[:8], "little")


def sealed(key, frames, freshness):
    head = monitor.message("ReadingFreshness", NODE, Frames=len(frames), Freshness=freshness)
    return [*frames, head, monitor.message("ReadingCode", NODE, Code=code(key, [*frames, head]))]


def present_us():
    return time.time_ns() // 1000


def told(bus, key, seconds=PATIENCE_S):
    """The next result with its freshness, its seal checked here; ``None`` if there is none."""
    group, end = [], time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        received = bus.recv(left)
        decoded = received and monitor.decode(received)
        if not decoded or decoded[1] != NODE:
            continue
        name, _, signals = decoded
        if name == "Status":
            group = []
        if name in monitor.RESULT or name in ["ResultEnd", "ToldFreshness"]:
            group.append(received)
        if name == "ToldFreshness":
            freshness, frames = signals["Freshness"], signals["Frames"]
        if name == "ToldCode" and len(group) == frames + 1 > 2:
            assert signals["Code"] == code(key, group)
            return freshness
    return None


@pytest.fixture
def sealing(place, desk):
    return place.start("--rotor", desk.rotor, "--sealed", *COMPRESSED)


def test_message_codes_agree_with_python_hmac_both_ways(sealing, desk):
    bus = sealing.wire.join()
    last = 0
    for sequence, (speed_rpm, probes) in enumerate(desk.record[:5]):
        now = present_us()
        for frame in sealed(sealing.key, monitor.reading(NODE, sequence, speed_rpm, probes), now):
            bus.send(frame)
        freshness = told(bus, sealing.key)
        assert freshness is not None and freshness >= now and freshness > last
        last = freshness


def test_corrupted_unsealed_and_replayed_frames_are_rejected(sealing, desk):
    bus = sealing.wire.join()
    (speed_rpm, probes), *_ = desk.record

    def play(frames):
        for frame in frames:
            bus.send(frame)
        return told(bus, sealing.key, 0.5)

    flipped = sealed(sealing.key, monitor.reading(NODE, 2, speed_rpm, probes), present_us())
    flipped[-1].data[7] ^= 0x80
    assert play(flipped) is None
    good = sealed(sealing.key, monitor.reading(NODE, 3, speed_rpm, probes), present_us())
    assert play(good) is not None
    assert play(good) is None
    assert play(monitor.reading(NODE, 4, speed_rpm, probes)) is None
    good = sealed(sealing.key, monitor.reading(NODE, 5, speed_rpm, probes), present_us())
    assert play(good) is not None
    counts = {"Forged": 1, "Replayed": 1, "Incomplete": 1}
    names = {"Forged": "Counters7", "Replayed": "Counters7", "Incomplete": "Counters3"}
    bus.forget()
    for signal, number in counts.items():
        assert monitor.wait_for(bus, names[signal], NODE)[signal] == number, signal
