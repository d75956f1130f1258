"""The DBC file and the core's codec describe the same protocol: every signal, both ways, at both ends of its range.

cantools encodes, the core decodes the same bits; the core encodes what it decoded, cantools decodes the same again.
"""

import struct

import cantools
import pytest

from conftest import run
from monitor import DBC

# frames of commands and answers have no meaning of their own to the codec, nor have MACs; test_isotp.py and test_mac.py
# check what they carry
TRANSFER = ["ToNode", "ToHost", "Offer", "Part", "Held", "AnswerPart"]
MACS = ["ReadingFreshness", "ReadingCode", "ToldFreshness", "ToldCode"]
MESSAGES = [message for message in DBC.messages if message.name not in TRANSFER + MACS]

# numbers that a later version may add to: one that is not known is read all the same
REASONS = {"Reason", "Cause"}

FLOAT_BITS = {
    "largest": 0x7F7FFFFF,
    "most negative": 0xFF7FFFFF,
    "smallest subnormal": 0x00000001,
    "largest negative subnormal": 0x807FFFFF,
    "smallest normal": 0x00800000,
    "zero": 0x00000000,
    "negative zero": 0x80000000,
    "infinity": 0x7F800000,
    "negative infinity": 0xFF800000,
    "NaN": 0x7FC00000,
    "negative NaN with a payload": 0xFFC12345,
}


def float_of(bits):
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def bits_of(number):
    return struct.unpack("<I", struct.pack("<f", number))[0]


def raw(signal, value):
    """A value as the bits that travel, which tell -0.0 from 0.0 and one NaN from another."""
    return bits_of(value) if signal.is_float else value


def usual(signal, place):
    """A value that no other signal of the message has."""
    if signal.is_float:
        return 1.5 + place
    return (0x5A3C96E1 + place) % (signal.maximum + 1)


def ends(signal):
    if signal.is_float:
        return {name: float_of(bits) for name, bits in FLOAT_BITS.items()}
    return {"least": signal.minimum, "greatest": signal.maximum}


CASES = [
    pytest.param(message, signal, value, id=f"{message.name}.{signal.name}: {name}")
    for message in MESSAGES
    for signal in message.signals
    for name, value in ends(signal).items()
]


def line(message, node, data):
    return f"{message.frame_id + node:03X}#{data.hex().upper()}"


def agree(core, message, node, values):
    """Both ways, bit for bit."""
    expected = {signal.name: raw(signal, values[signal.name]) for signal in message.signals}
    frame = line(message, node, message.encode(values))
    heard = core(frame)
    assert heard["name"] == message.name and heard["node"] == node
    assert heard["signals"] == expected
    assert heard["encoded"] == frame
    identifier, digits = heard["encoded"].split("#")
    again = DBC.decode_message(int(identifier, 16) & 0x7E0, bytes.fromhex(digits), decode_choices=False)
    assert {signal.name: raw(signal, again[signal.name]) for signal in message.signals} == expected


@pytest.mark.parametrize("message, signal, value", CASES)
def test_signal_at_an_end_of_its_range(core, message, signal, value):
    values = {other.name: usual(other, place) for place, other in enumerate(message.signals)}
    agree(core, message, 7, values | {signal.name: value})


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.name)
@pytest.mark.parametrize("node", [0, 1, 30, 31])
def test_node_is_the_low_five_bits_of_the_identifier(core, message, node):
    values = {signal.name: usual(signal, place) for place, signal in enumerate(message.signals)}
    agree(core, message, node, values)


def test_message_types_of_core_and_dbc_are_the_same(core):
    assert core("protocol")["types"] == sorted(message.frame_id >> 5 for message in DBC.messages)
    assert all(message.frame_id & 0x1F == 0 for message in DBC.messages)


def test_the_file_names_the_version_that_the_core_speaks(core):
    assert DBC.version == str(core("protocol")["version"])


@pytest.mark.parametrize(
    "message, signal",
    [
        pytest.param(message, signal, id=f"{message.name}.{signal.name}")
        for message in MESSAGES
        for signal in message.signals
        if signal.choices
    ],
)
def test_named_values_are_all_that_the_core_accepts(core, message, signal):
    values = {other.name: 0 for other in message.signals}
    for value in range(1 << signal.length):
        data = message.encode(values | {signal.name: value}, strict=False)
        answer = core(line(message, 1, data))
        is_taken = value in signal.choices or signal.name in REASONS
        assert (answer == {"error": "BadValue"}) != is_taken, value
    assert list(signal.choices) == list(range(signal.maximum + 1))


@pytest.mark.parametrize("message", [m for m in MESSAGES if REASONS & {s.name for s in m.signals}], ids=lambda m: m.name)
def test_reason_of_a_newer_monitor_is_read_as_its_number(core, message):
    for signal in message.signals:
        if signal.name in REASONS:
            newer = int(signal.maximum) + 1
            values = {other.name: usual(other, place) for place, other in enumerate(message.signals)} | {signal.name: newer}
            data = message.encode(values, strict=False)
            assert message.decode(data)[signal.name] == newer
            heard = core(line(message, 1, data))
            assert heard["signals"][signal.name] == newer
            assert heard["encoded"] == line(message, 1, data)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.name)
def test_wrong_length_is_refused_but_the_version_query_takes_any(core, message):
    for length in range(8):
        answer = core(line(message, 1, bytes(length)))
        if message.name == "VersionQuery":
            assert answer["name"] == "VersionQuery"
        else:
            assert answer == {"error": "WrongLength"}, length


def test_messages_and_signals_have_comments_and_floats_units():
    for message in DBC.messages:
        assert message.comment, message.name
        for signal in message.signals:
            assert signal.comment, f"{message.name}.{signal.name}"
            if signal.is_float and signal.name != "Ratio":
                assert signal.unit in ["rpm", "um", "g.mm", "s"], f"{message.name}.{signal.name}"


def test_signals_do_not_overlap_and_reserved_bits_stay_zero(core):
    for message in MESSAGES:
        covered = [bit for signal in message.signals for bit in range(signal.start, signal.start + signal.length)]
        assert len(covered) == len(set(covered)), message.name
        greatest = {signal.name: 0 if signal.is_float else signal.maximum for signal in message.signals}
        number = int.from_bytes(message.encode(greatest), "little")
        assert number & ~sum(1 << bit for bit in covered) == 0, message.name


@pytest.mark.parametrize("node", [0, 1, 17, 30])
def test_dbc_of_node_has_its_identifiers_and_same_signals(core, node, tmp_path):
    path = tmp_path / "monitor.dbc"
    run("dbc", "--node", node, "-o", path)
    of_node = cantools.database.load_file(path)
    assert of_node.version == DBC.version
    assert [message.frame_id for message in of_node.messages] == [message.frame_id + node for message in DBC.messages]
    for own, message in zip(of_node.messages, DBC.messages):
        assert (own.name, own.comment) == (message.name, message.comment)
        assert own.cycle_time == message.cycle_time
        for signal, expected in zip(own.signals, message.signals, strict=True):
            for attribute in ["name", "start", "length", "is_signed", "is_float", "unit", "choices", "comment"]:
                assert getattr(signal, attribute) == getattr(expected, attribute), (own.name, signal.name, attribute)
    # what this file encodes, the core takes for a frame of that monitor
    for own in of_node.messages:
        if own.name not in TRANSFER + MACS:
            data = own.encode({signal.name: usual(signal, place) for place, signal in enumerate(own.signals)})
            heard = core(f"{own.frame_id:03X}#{data.hex().upper()}")
            assert (heard["name"], heard["node"]) == (own.name, node)
