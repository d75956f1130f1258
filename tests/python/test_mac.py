"""Message authentication codes made and checked by a user's script: hmac, the DBC file and docs/can-bus.md alone."""

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


def authenticated(key, frames, nonce):
    head = monitor.message("ReadingFreshness", NODE, Frames=len(frames), Freshness=nonce)
    return [*frames, head, monitor.message("ReadingCode", NODE, Code=code(key, [*frames, head]))]


def present_us():
    return time.time_ns() // 1000


def told(bus, key, seconds=PATIENCE_S):
    """The next result with its nonce, its code checked here; ``None`` if there is none."""
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
            nonce, frames = signals["Freshness"], signals["Frames"]
        if name == "ToldCode" and len(group) == frames + 1 > 2:
            assert signals["Code"] == code(key, group)
            return nonce
    return None


@pytest.fixture
def authenticating(place, desk):
    return place.start("--rotor", desk.rotor, "--sealed", *COMPRESSED)


def test_message_codes_agree_with_python_hmac_both_ways(authenticating, desk):
    bus = authenticating.wire.join()
    last = 0
    for sequence, (speed_rpm, probes) in enumerate(desk.record[:5]):
        now = present_us()
        for frame in authenticated(authenticating.key, monitor.reading(NODE, sequence, speed_rpm, probes), now):
            bus.send(frame)
        nonce = told(bus, authenticating.key)
        assert nonce is not None and nonce >= now and nonce > last
        last = nonce


def test_corrupted_unauthenticated_and_replayed_frames_rejected(authenticating, desk):
    bus = authenticating.wire.join()
    (speed_rpm, probes), *_ = desk.record

    def play(frames):
        for frame in frames:
            bus.send(frame)
        return told(bus, authenticating.key, 0.5)

    flipped = authenticated(authenticating.key, monitor.reading(NODE, 2, speed_rpm, probes), present_us())
    flipped[-1].data[7] ^= 0x80
    assert play(flipped) is None
    good = authenticated(authenticating.key, monitor.reading(NODE, 3, speed_rpm, probes), present_us())
    assert play(good) is not None
    assert play(good) is None
    assert play(monitor.reading(NODE, 4, speed_rpm, probes)) is None
    good = authenticated(authenticating.key, monitor.reading(NODE, 5, speed_rpm, probes), present_us())
    assert play(good) is not None
    counts = {"Forged": 1, "Replayed": 1, "Incomplete": 1}
    names = {"Forged": "Counters7", "Replayed": "Counters7", "Incomplete": "Counters3"}
    bus.forget()
    for signal, number in counts.items():
        assert monitor.wait_for(bus, names[signal], NODE)[signal] == number, signal
