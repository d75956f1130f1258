"""Readings that cannot be trusted, sent to the emulated board: it judges them as the host does, to the bit, and never tracks."""

import cmath
import csv
import math
import random

import pytest

import monitor
from conftest import NODE, SAMPLE, answers_of
from test_firmware import assert_same, board  # noqa: F401

HEALTHY = 100
FAULTY = 30


def turned(probes, angle_deg, factor=1.0):
    turn = cmath.rect(factor, math.radians(angle_deg))
    products = [turn * complex(*probe) for probe in probes]
    return [(product.real, product.imag) for product in products]


def slipping(number, probes):
    return turned(probes, random.Random(number).uniform(-180, 180))


def walking(number, probes):
    return turned(probes, 720 * (number + 1) / FAULTY)


def reversed_at_times(number, probes):
    return [turned(probes[:1], 180)[0], *probes[1:]] if number % 3 else probes


FAULTS = {
    "phase jumps": (lambda number, probes: turned(probes, 150), {"Keyphasor"}),
    "phase slips": (slipping, {"Keyphasor", "Jump", "Scatter"}),
    "phase walks": (walking, {"Keyphasor", "Jump", "Scatter"}),
    "gains fall": (lambda number, probes: turned(probes, 0, 0.4), {"Scale"}),
    "a probe is reversed at times": (reversed_at_times, {"Rise", "Ratio", "Probe", "Jump", "Intermittent"}),
}


def written(rows, path):
    """The rows as a record with the sample's columns, and as it is read again."""
    with open(SAMPLE / "record.csv", newline="") as file:
        header = next(csv.reader(file))
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(header)
        for day, (speed_rpm, probes) in enumerate(rows):
            table.writerow([day, speed_rpm, *(repr(part) for probe in probes for part in probe)])
    return monitor.read_record(path)


def told_after(board, desk, rows, path):
    """The state after the rows, which the board judges as the host does."""
    record, expected = written(rows, path), answers_of(desk.rotor, path)
    board.deploy(desk.rotor, "--restart")
    board.take_milliseconds_for_days()
    assert_same(board.play(record, expected), expected)
    board.wire.leave()
    return monitor.wait_for(board.wire.join(), "State", NODE, 5.0)


def first_rows(desk, count):
    return [row for row in desk.record if None not in row[1]][:count]


@pytest.mark.parametrize("name", FAULTS)
def test_instrument_fault_raises_the_flag_that_the_host_raises(name, board, desk, tmp_path):  # noqa: F811
    fault, causes = FAULTS[name]
    rows = first_rows(desk, HEALTHY + FAULTY)
    spoilt = [(speed_rpm, fault(number, probes)) for number, (speed_rpm, probes) in enumerate(rows[HEALTHY:])]
    told = told_after(board, desk, [*rows[:HEALTHY], *spoilt], tmp_path / "record.csv")
    assert told["State"] == "Flagged" and str(told["Cause"]) in causes, told


@pytest.mark.parametrize("factor, reasons", [(1, {"Repeated"}), (0, {"Probes", "Repeated"})], ids=["frozen", "zero"])
def test_readings_that_repeat_or_are_zero_are_no_evidence(factor, reasons, board, desk, tmp_path):  # noqa: F811
    rows = first_rows(desk, HEALTHY)
    speed_rpm, probes = rows[-1]
    frozen = speed_rpm, [(factor * cos, factor * sin) for cos, sin in probes]
    told = told_after(board, desk, [*rows, *[frozen] * FAULTY], tmp_path / "record.csv")
    assert str(told["State"]) in {"Blind", "Stale"} and str(told["Reason"]) in reasons, told
