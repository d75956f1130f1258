"""Voltages at the pins become readings on the bus: converter, DMA, timers, keyphasor, extraction, FDCAN."""

import math
import random

import pytest

from g474.machine import Machine
from scene import last_said, said

VECTORS_UM = [(12.0, -5.0), (-3.0, 8.0), (6.0, 6.0), (-9.0, 2.0)]
COUNT_UM = 0.85
"""One count of the converter, at the probe (README of the board)."""
NOISE_UM = 0.8
"""Of each sample, one deviation; without any, the steps of the converter repeat with each turn and do not average out."""


def tolerance_um(speed_rpm, amplitude_um, mark_s):
    """Six deviations of what noise and the converter's steps leave of sixteen turns' samples, and of a mark that is known
    to so many seconds."""
    samples = 16 * 60 / speed_rpm * 20_000
    of_samples = math.hypot(NOISE_UM, COUNT_UM / math.sqrt(12)) * math.sqrt(2 / samples)
    return 6 * of_samples + amplitude_um * speed_rpm * math.tau / 60 * mark_s


@pytest.mark.parametrize("is_compared", [False, True], ids=["mark at PC2", "mark at PB10"])
@pytest.mark.parametrize("speed_rpm", [1500.0, 11000.0])
def test_amplitude_and_phase_at_the_pins_are_those_on_the_bus(board, speed_rpm, is_compared):
    noise = random.Random(1)
    # of an edge as steep as this one the converter would know the instant to half a scan
    edge_s = 1e-6 if is_compared else 140e-6
    machine = Machine(
        board, speed_rpm, VECTORS_UM, second_um=3.0, edge_s=edge_s, noise_um=lambda: noise.gauss(0, NOISE_UM)
    )
    if is_compared:
        machine.compare()
    start_s = board.now_s
    board.run(0.7 + 3 * 16 * 60 / speed_rpm)
    readings = said(board, "ReadingStart", start_s + 0.7)
    assert len(readings) >= 2
    assert all(abs(reading["Speed"] / speed_rpm - 1) < 1e-4 for _, reading in readings)
    # a step of the converter on the edge, or of the timer's clock
    mark_s = 6e-9 if is_compared else 6.7e-3 / (7 / edge_s)
    for probe, (cos, sin) in enumerate(VECTORS_UM, 1):
        vectors = said(board, f"Probe{probe}", start_s + 0.7)
        allowed_um = tolerance_um(speed_rpm, math.hypot(cos, sin), mark_s)
        worst_um = max(math.hypot(vector["Cos"] - cos, vector["Sin"] - sin) for _, vector in vectors)
        assert worst_um < allowed_um, f"{worst_um} of {allowed_um}"


def test_gap_voltages_at_the_proximitors_travel(board):
    gaps_v = (-9.0, -10.0, -11.0, -12.0)
    Machine(board, 11000.0, VECTORS_UM, gaps_v=gaps_v)
    board.run(1.0)
    found = last_said(board, "Gaps1To4")
    assert all(abs(found[f"Gap{probe}"] / 1000 - gap_v) < 0.007 for probe, gap_v in enumerate(gaps_v, 1))
