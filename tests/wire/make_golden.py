"""Writes the golden bytes from the documented layouts alone: struct, zlib and hmac, nothing of this project.

    python3 tests/wire/make_golden.py tests/wire

A version that is out in the field is never written again: its files stay as they are, and a new version gets a new
function and new files here.
"""

import hmac
import struct
import sys
import zlib
from pathlib import Path

NODE = 7
KEY = bytes([0x11] * 32)


def frame(message_type, payload):
    return (message_type * 32 + NODE, payload)


def closed(frames, end_type, sequence, count):
    checksum = zlib.crc32(b"".join(payload for _, payload in frames))
    return frames + [frame(end_type, struct.pack("<HBBI", sequence, count, 0, checksum))]


def reading(keyphasor):
    start = [frame(8, struct.pack("<HBBf", 513, 0b1111, keyphasor, 9000.5))]
    vectors = [frame(9 + i, struct.pack("<ff", 1.5 + i, -2.25 * i)) for i in range(4)]
    return closed(start + vectors, 13, 513, 4)


def result():
    pairs = [(100.5, -200.25), (300.0, 0.125), (400.5, -200.125), (-50.0, 25.5), (12.5, 0.375)]
    body = [frame(16, struct.pack("<HBBHH", 513, 0b0011, 2, 4, 0))]
    body += [frame(17 + i, struct.pack("<ff", *pair)) for i, pair in enumerate(pairs)]
    return closed(body, 22, 513, 6)


def heartbeat(version):
    return [
        frame(32, struct.pack("<BBHHH", version, 3, 1000, 2, 3)),
        frame(33, struct.pack("<HHHH", 4, 5, 6, 7)),
        frame(34, struct.pack("<HHHH", 8, 9, 10, 11)),
    ]


def protocol_1():
    return reading(0) + result() + heartbeat(1)


def protocol_2():
    return (
        reading(1)
        + result()
        + heartbeat(2)
        + [
            frame(35, struct.pack("<HHHH", 12, 13, 14, 15)),
            frame(36, struct.pack("<HHI", 16, 17, 0xDEADBEEF)),
            frame(62, struct.pack("<BBBBI", 2, 1, 1, 6, 0)),
            frame(63, b""),
        ]
    )


def floats(*numbers):
    return struct.pack(f"<{len(numbers)}f", *numbers)


def model_1():
    """Schema 1, two shapes, every kind of term once; postcard: lists and variants with a varint, options with a byte."""
    support = lambda place, k: floats(1, place, k, 0, 0, k, 300, 0, 0, 300, 0.5, 0.25, 600, 1e-5)
    probe = lambda place, c, s: floats(1, place, c, s, 1, 0, 0.5, -0.5)
    body = floats(1e3, 0, 0, 2e3) + floats(60, 3, 3, 20) + floats(0, 0, 0, 4) + floats(1e-6)
    body += b"\x02" + floats(1, -0.5) + floats(1, 0.6)
    body += b"\x02" + support(-1, 6e6) + b"\x00" + support(1, 5e6) + b"\x01" + floats(1e8, 1e4, 3)
    body += b"\x02" + floats(1, 0.1, 7, -8) + b"\x00" + floats(1, 0.2, 9, 10) + b"\x01"
    body += probe(-0.9, 1, 0) + probe(-0.9, 0, 1) + probe(0.9, 1, 0) + probe(0.9, 0, 1)
    body += floats(30, 40, -10, 20) + floats(5) + floats(600, 12000)
    return struct.pack("<IB", 1, 2) + body + struct.pack("<I", zlib.crc32(body))


def code(data):
    return hmac.new(KEY, data, "sha256").digest()[:16]


def request_1():
    signed = struct.pack("<BBBBQ", 1, 1, NODE, 0, 0x0102030405060708) + model_1()
    return signed + code(signed)


def answer_1():
    head = struct.pack("<BBBBQIBxxx", 1, 1, NODE, 5, 41, 0xDEADBEEF, 13)
    return head + code(head + request_1()[-16:])


def main(folder):
    for name, frames in [("protocol-1", protocol_1()), ("protocol-2", protocol_2())]:
        text = "".join(f"{number:03X}#{payload.hex().upper()}\n" for number, payload in frames)
        (folder / f"{name}.txt").write_text(text)
    for name, data in [("model-1", model_1()), ("request-1", request_1()), ("answer-1", answer_1())]:
        lines = [data[i : i + 32].hex() for i in range(0, len(data), 32)]
        (folder / f"{name}.hex").write_text("\n".join(lines) + "\n")


main(Path(sys.argv[1]))
