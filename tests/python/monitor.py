"""The protocol as a user's script speaks it: python-can, the DBC file, zlib and hmac; nothing of rotor-edge's code."""

import binascii
import csv
import hashlib
import hmac
import struct
import time
from pathlib import Path

import can
import cantools

ROOT = Path(__file__).resolve().parents[2]
DBC = cantools.database.load_file(ROOT / "core" / "rotor-edge.dbc")
NODE_BITS = 0x1F
EVERYBODY = 31
MOST_PROBES = 8
COUNTERS = [f"Counters{pair}" for pair in range(1, 11)]


def result_of(planes):
    """The frames of a result before its end."""
    of_planes = [f"UnbalancePlane{plane}" for plane in range(1, planes + 1)]
    return ["Status", *of_planes, "StaticUnbalance", "DynamicUnbalance", "Residual", "Limits"]


RESULT = set(result_of(4))

WIRE_VERSION = 2
DEPLOY, RESTART, ACKNOWLEDGE, SET_THRESHOLDS, GET_THRESHOLDS = range(1, 6)
OUTCOMES = ["accepted", "malformed", "no key", "forged", "replayed", "model", "storage", "counter", "thresholds"]
CODE_BYTES = 16
THRESHOLDS = struct.Struct("<B13f2B")
"""Version, then the fields in their order."""


def message(name, node, **signals):
    """A frame to send."""
    kind = DBC.get_message_by_name(name)
    return can.Message(
        arbitration_id=kind.frame_id + node, data=kind.encode(signals), is_extended_id=False, dlc=kind.length
    )


def decode(received, **options):
    """Name, node and signals of a frame; ``None`` if it is none of ours."""
    if received.is_extended_id or received.is_error_frame or received.is_remote_frame:
        return None
    try:
        kind = DBC.get_message_by_frame_id(received.arbitration_id & ~NODE_BITS)
    except KeyError:
        return None
    return kind.name, received.arbitration_id & NODE_BITS, kind.decode(received.data, **options)


def checksum(messages):
    return binascii.crc32(b"".join(bytes(m.data) for m in messages))


def reading(node, sequence, speed_rpm, probes, keyphasor="Locked", gaps_v=None):
    """The frames of a reading; ``probes`` is [(cos, sin) or None] in um in the order of the model, ``gaps_v`` [V or None]."""
    lost = (float("nan"), float("nan"))
    there = [*probes, *[None] * (MOST_PROBES - len(probes))]
    valid = {f"Probe{number}Valid": int(probe is not None) for number, probe in enumerate(there, 1)}
    start = {"Sequence": sequence, "Keyphasor": keyphasor, "Probes": len(probes), "Speed": speed_rpm}
    frames = [message("ReadingStart", node, **start, **valid)]
    for number, probe in enumerate(probes, 1):
        cos, sin = probe or lost
        frames.append(message(f"Probe{number}", node, Cos=cos, Sin=sin))
    gaps_mv = [-32768 if gap is None else round(1000 * gap) for gap in gaps_v or []]
    gaps_mv += [-32768] * (MOST_PROBES - len(gaps_mv))
    for first in [0, 4]:
        four = {f"Gap{first + k + 1}": gaps_mv[first + k] for k in range(4)}
        if any(gap != -32768 for gap in four.values()):
            frames.append(message(f"Gaps{first + 1}To{first + 4}", node, **four))
    end = message("ReadingEnd", node, Sequence=sequence, Frames=len(frames), Checksum=checksum(frames))
    return frames + [end]


class Results:
    """Puts the results of one monitor together."""

    def __init__(self, node):
        self.node, self.frames = node, {}

    def take(self, received):
        """The result that this frame completes."""
        decoded = decode(received, decode_choices=False)
        if decoded is None or decoded[1] != self.node:
            return None
        name, _, signals = decoded
        if name == "Status":
            self.frames = {}
        if name in RESULT:
            self.frames[name] = received, signals
        if name != "ResultEnd":
            return None
        planes = sum(name.startswith("UnbalancePlane") for name in self.frames)
        expected = result_of(planes)
        assert list(self.frames) == expected, f"result {signals['Sequence']} came as {list(self.frames)}"
        assert signals["Checksum"] == checksum(frame for frame, _ in self.frames.values())
        assert signals["Sequence"] == self.frames["Status"][1]["Sequence"] and signals["Frames"] == len(expected)
        return {name: parts for name, (_, parts) in self.frames.items()}


def read_record(path):
    """Speed and probes of each row, in the order of the file's columns; ``None`` for a probe that was lost."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = [name for name in rows[0] if name.endswith("_um")]
    record = []
    for row in rows:
        numbers = [float(row[name]) if row[name] else None for name in columns]
        pairs = list(zip(numbers[0::2], numbers[1::2]))
        record.append((float(row["speed_rpm"]), [None if None in pair else pair for pair in pairs]))
    return record


def wait_for(bus, name, node, seconds=10.0, accept=lambda signals: True):
    """The next such message of a monitor."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        received = bus.recv(left)
        decoded = received and decode(received)
        if decoded and decoded[:2] == (name, node) and accept(decoded[2]):
            return decoded[2]
    raise TimeoutError(f"no {name} of monitor {node} within {seconds} s")


def collect(bus, node, last, seconds=20.0):
    """Results by the number of their reading, until that of reading ``last``; {sequence: result}."""
    results, answers, last_of = Results(node), {}, {}
    end = time.monotonic() + seconds
    while last not in answers:
        if time.monotonic() > end:
            heard = [decode(message) for message in last_of.values()]
            raise TimeoutError(f"no answer to reading {last}, only to {list(answers)}; last heard of each: {heard}")
        received = bus.recv(1.0)
        result = received and results.take(received)
        if received:
            last_of[received.arbitration_id] = received
        if result:
            answers[result["Status"]["Sequence"]] = result
    return answers


UNANSWERED_S = 0.1
"""A monitor has judged a reading within this time."""


def play(bus, node, rows, answered=None):
    """Sends each reading and waits for its answer; {row: result}.

    ``answered``: the rows that are answered; if absent, all rows with a probe.
    """
    answers = {}
    for row, (speed_rpm, probes) in enumerate(rows):
        for frame in reading(node, row, speed_rpm, probes):
            bus.send(frame)
        if any(probes) if answered is None else row in answered:
            answers |= collect(bus, node, row)
        elif any(probes):
            time.sleep(UNANSWERED_S)
    return answers


def request(key, node, command, counter, body=b""):
    """The bytes of a command."""
    signed = struct.pack("<BBBBQ", WIRE_VERSION, command, node, 0, counter) + body
    return signed + code(key, b"rotor-edge request" + signed)


def code(key, data):
    return hmac.new(key, data, hashlib.sha256).digest()[:CODE_BYTES]


def answer(key, node, command, outcome, counter, model_checksum, to, detail=(0, 0, 0), body=b""):
    """The bytes of a monitor's answer to a request."""
    head = struct.pack("<BBBBQI", WIRE_VERSION, command, node, OUTCOMES.index(outcome), counter, model_checksum)
    head += bytes([*detail, 0]) + body
    return head + code(key, b"rotor-edge answer" + head + to[-CODE_BYTES:])


def open_answer(key, data, to):
    """Outcome, last counter accepted and checksum of the model in use; the answer must be the monitor's own."""
    return open_whole_answer(key, data, to)[:3]


def open_whole_answer(key, data, to):
    """The same, then what the outcome says in detail (error, asked, held), and the body."""
    signed, given = data[:-CODE_BYTES], data[-CODE_BYTES:]
    expected = code(key, b"rotor-edge answer" + signed + to[-CODE_BYTES:])
    assert hmac.compare_digest(given, expected), "not the monitor's own answer"
    version, _, _, outcome, counter, model_checksum = struct.unpack("<BBBBQI", signed[:16])
    assert version == WIRE_VERSION
    return OUTCOMES[outcome], counter, model_checksum, tuple(signed[16:19]), signed[20:]
