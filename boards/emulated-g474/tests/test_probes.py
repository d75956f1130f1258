"""Voltages at the pins become readings on the bus: converter, DMA, timers, keyphasor, extraction, FDCAN."""

import math
import random

import pytest

from g474.machine import Machine
from scene import said

VECTORS_UM = [(12.0, -5.0), (-3.0, 8.0), (6.0, 6.0), (-9.0, 2.0)]
PROBES = ["Probe1X", "Probe1Y", "Probe2X", "Probe2Y"]
COUNT_UM = 0.85
"""One count of the converter, at the probe (README of the board)."""
NOISE_UM = 0.8
"""Of each sample, one deviation; without any, the steps of the converter repeat with each turn and do not average out."""


def tolerance_um(speed_rpm, amplitude_um):
    """Six deviations of what noise and the converter's steps leave of sixteen turns' samples, and of a mark that is known
    to the converter's step on its edge (7 V in 140 us, 6.7 mV a count)."""
    samples = 16 * 60 / speed_rpm * 20_000
    of_samples = math.hypot(NOISE_UM, COUNT_UM / math.sqrt(12)) * math.sqrt(2 / samples)
    mark_s = 6.7e-3 / (7 / 140e-6)
    return 6 * of_samples + amplitude_um * speed_rpm * math.tau / 60 * mark_s


@pytest.mark.parametrize("speed_rpm", [1500.0, 6000.0, 11000.0])
def test_amplitude_and_phase_at_the_pins_are_those_on_the_bus(board, speed_rpm):
    noise = random.Random(1)
    Machine(board, speed_rpm, VECTORS_UM, second_um=3.0, noise_um=lambda: noise.gauss(0, NOISE_UM))
    start_s = board.now_s
    board.run(0.7 + 3 * 16 * 60 / speed_rpm)
    readings = said(board, "ReadingStart", start_s + 0.5)
    assert len(readings) >= 3
    assert all(abs(reading["Speed"] / speed_rpm - 1) < 1e-4 for _, reading in readings)
    for probe, (cos, sin) in enumerate(VECTORS_UM):
        vectors = said(board, PROBES[probe], start_s + 0.5)
        allowed_um = tolerance_um(speed_rpm, math.hypot(cos, sin))
        worst_um = max(math.hypot(vector["Cos"] - cos, vector["Sin"] - sin) for _, vector in vectors)
        assert worst_um < allowed_um, f"{worst_um} of {allowed_um}"
