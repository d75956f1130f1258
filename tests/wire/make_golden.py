"""Writes the golden bytes from the documented layouts alone: struct, zlib and hmac, nothing of this project.

    python3 tests/wire/make_golden.py tests/wire

A version that the core still speaks is never written again: its files stay as they are, and a new version gets a new
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


def closed(frames, end_type, sequence):
    checksum = zlib.crc32(b"".join(payload for _, payload in frames))
    return frames + [frame(end_type, struct.pack("<HBBI", sequence, len(frames), 0, checksum))]


def reading(keyphasor):
    """Five probes, of which the second gave no value; gap voltages of the first two and the fifth."""
    start = [frame(8, struct.pack("<HBBf", 513, 0b11101, keyphasor | 5 << 4, 9000.5))]
    vectors = [frame(9 + i, struct.pack("<ff", 1.5 + i, -2.25 * i)) for i in range(5)]
    gaps = [frame(17, struct.pack("<hhhh", -9000, -10500, -32768, -32768)), frame(18, struct.pack("<hhhh", 125, *[-32768] * 3))]
    return closed(start + vectors + gaps, 19, 513)


def result():
    """Three planes; suspicious and flagged, plane 3 on its bound; bearing 2 suspected; redundancy 2, probes 1, 3, 4, 5."""
    pairs = [(100.5, -200.25), (300.0, 0.125), (-7.5, 8.0)]
    body = [frame(20, struct.pack("<HBBHBB", 513, 0b010011, 2 | 2 << 4, 4, 0b11101, 10))]
    body += [frame(21 + i, struct.pack("<ff", *pair)) for i, pair in enumerate(pairs)]
    others = [(400.5, -200.125), (-50.0, 25.5), (12.5, 0.375), (3.25, 6.5)]
    body += [frame(25 + i, struct.pack("<ff", *pair)) for i, pair in enumerate(others)]
    return closed(body, 29, 513)


def protocol_3():
    counters = [frame(34 + i, struct.pack("<II", 70000 + 2 * i, 70001 + 2 * i)) for i in range(10)]
    return (
        reading(1)
        + result()
        + [frame(32, struct.pack("<BBBBI", 3, 3, 3, 0b10, 100000))]
        + [frame(33, struct.pack("<BBBBf", 3, 3, 0b10, 10 | 2 << 5, 0.5))]
        + counters
        + [frame(44, struct.pack("<IBBH", 0xDEADBEEF, 5, 3, 0))]
        + [frame(62, struct.pack("<BBBBBBH", 3, 3, 2, 6, 8, 4, 0)), frame(63, b"")]
    )


def floats(*numbers):
    return struct.pack(f"<{len(numbers)}f", *numbers)


def model_3():
    """Schema 3, two shapes, three probes, two planes, every kind of term once; postcard: lists and variants with a varint,
    options with a byte."""
    def support(place, k, table, pedestal):
        head = floats(1, place, k, 0, 0, k, 300, 0, 0, 300, 0.5, 0.25, 600)
        return head + table + floats(1e-5) + pedestal

    def knot(speed, k):
        return floats(speed, k, 1, 2, k, 10, 0, 0, 20)

    def probe(place, c, s, bearing, mount):
        return floats(1, place, c, s, 1, 0, 0.5, -0.5) + bytes([bearing]) + mount

    body = bytes([0xC0, 0xFF, 0xEE, 0x01]) + floats(1e3, 0, 0, 2e3) + floats(60, 3, 3, 20) + floats(0, 0, 0, 4) + floats(1e-6)
    body += b"\x02" + floats(1, -0.5) + floats(1, 0.6)
    body += b"\x02" + support(-1, 6e6, b"\x00", b"\x00")
    body += support(1, 5e6, b"\x01\x00\x02", b"\x01" + floats(1e8, 2e8, 1e4, 2e4, 3, 4))
    body += b"\x02" + knot(100, 1e5) + knot(1000, 2e5)
    body += b"\x02" + floats(1, 0.1, 7, -8) + b"\x00" + floats(1, 0.2, 9, 10) + b"\x01"
    body += b"\x03" + probe(-0.9, 1, 0, 0, b"\x00") + probe(-0.9, 0, 1, 0, b"\x00") + probe(0.9, 1, 0, 1, b"\x01\x01")
    body += b"\x02" + floats(30, 40, -10, 20) + floats(5) + floats(0.0625, 0.25) + floats(600, 12000)
    return struct.pack("<IBBB", 3, 2, 3, 2) + body + struct.pack("<I", zlib.crc32(body))


def model_4():
    """Schema 4, two modes, three probes of which the second is masked, two planes, every kind of term once. A place has its
    shape in the modes of forward whirl, supports and probes that in those of backward whirl after it."""
    def forward(place):
        return floats(3e-4, 3e-4 * place)

    def both(place):
        return forward(place) + floats(3e-4, 2.5e-4 * place)

    def support(place, k, table, pedestal):
        head = both(place) + floats(k, 0, 0, k, 300, 0, 0, 300, 0.5, 0.25, 600)
        return head + table + floats(1e-5) + pedestal

    def knot(speed, k):
        return floats(speed, k, 1, 2, k, 10, 0, 0, 20)

    def probe(place, c, s, bearing, mount):
        return both(place) + floats(c, s, 1, 0, 0.5, -0.5) + bytes([bearing]) + mount

    body = bytes([0xC0, 0xFF, 0xEE, 0x01])
    body += floats(5e-6, 1.5e-6) + floats(5.5e-6, 2e-6) + b"\x02" + floats(6e6, 7e6) + floats(1e-6)
    body += b"\x02" + forward(-0.5) + forward(0.6)
    body += b"\x02" + support(-1, 6e6, b"\x00", b"\x00")
    body += support(1, 5e6, b"\x01\x00\x02", b"\x01" + floats(1e8, 2e8, 1e4, 2e4, 3, 4))
    body += b"\x02" + knot(100, 1e5) + knot(1000, 2e5)
    body += b"\x02" + forward(0.1) + floats(7, -8) + b"\x00" + forward(0.2) + floats(9, 10) + b"\x01"
    body += b"\x03" + probe(-0.9, 1, 0, 0, b"\x00") + probe(-0.9, 0, 1, 0, b"\x00") + probe(0.9, 1, 0, 1, b"\x01\x01")
    body += b"\x02"
    body += b"\x02" + floats(30, 40, -10, 20) + floats(5) + floats(0.0625, 0.25) + floats(600, 12000)
    return struct.pack("<IBBB", 4, 2, 3, 2) + body + struct.pack("<I", zlib.crc32(body))


def thresholds_1():
    numbers = floats(0.25, 0.5, 0.125, 1.5, 2, 20, 86400, 90, 1.25, 43200, 30, -17, -3)
    return struct.pack("<B", 1) + numbers + struct.pack("<BB", 4, 12)


def code(domain, data):
    return hmac.new(KEY, domain + data, "sha256").digest()[:16]


def request_2():
    signed = struct.pack("<BBBBQ", 2, 4, NODE, 0, 0x0000030405060708) + thresholds_1()
    return signed + code(b"rotor-edge request", signed)


def refusal_2():
    """A model of eight probes for a firmware of four."""
    head = struct.pack("<BBBBQIBBBx", 2, 1, NODE, 5, 41, 0xDEADBEEF, 14, 8, 4)
    return head + code(b"rotor-edge answer", head + request_2()[-16:])


def answer_2():
    signed = struct.pack("<BBBBQIBBBx", 2, 5, NODE, 0, 41, 0xDEADBEEF, 0, 0, 0) + thresholds_1()
    return signed + code(b"rotor-edge answer", signed + request_2()[-16:])


def main(folder):
    text = "".join(f"{number:03X}#{payload.hex().upper()}\n" for number, payload in protocol_3())
    (folder / "protocol-3.txt").write_text(text)
    for name, data in [("model-3", model_3()), ("model-4", model_4()), ("request-2", request_2()), ("refusal-2", refusal_2()), ("answer-2", answer_2())]:
        lines = [data[i : i + 32].hex() for i in range(0, len(data), 32)]
        (folder / f"{name}.hex").write_text("\n".join(lines) + "\n")


main(Path(sys.argv[1]))
