"""Faults that all probes share, with the probes turning in front of the board: they end tracking, and their name is told."""

import cmath
import math
import random

import pytest
from g474.machine import Machine
from scene import check, last_said, start, state, until

AGE_LIMIT_S = 10.0
"""Of the default thresholds."""


def changed(vectors_um, factor, angle_deg):
    turn = cmath.rect(factor, math.radians(angle_deg))
    products = [turn * complex(cos, sin) for cos, sin in vectors_um]
    return [(product.real, product.imag) for product in products]


@pytest.mark.parametrize(
    "factor, angle_deg, reason", [(1.0, -150.0, "Keyphasor"), (0.4, 0.0, "Scale")], ids=["phase jumps", "gains fall"]
)
def test_change_of_all_probes_ends_tracking_and_is_named(story, desk, factor, angle_deg, reason):
    board = start(story.learned_flash)
    speed_rpm, vectors_um = next(row for row in desk.record if None not in row[1])
    noise = random.Random(9)
    machine = Machine(board, speed_rpm, vectors_um, noise_um=lambda: noise.gauss(0, 0.3))
    until(board, lambda: state(board)[0] == "Tracking", 10.0)
    # what was trusted outlives the loss of power, the vectors do not
    board.run(2.0)
    machine.vectors_um[:] = changed(vectors_um, factor, angle_deg)
    until(board, lambda: state(board)[0] != "Tracking", AGE_LIMIT_S)
    until(board, lambda: state(board)[0] == "Flagged", 20.0)
    assert state(board)[1] == reason
    assert str(last_said(board, "State")["Cause"]) == reason
    check(board)
