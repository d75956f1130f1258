"""Rows 21 to 25: what happens to the probes, the keyphasor and the converter."""

import pytest

from conftest import NODE
from commands import DEPLOY, Client
from g474 import VirtualTimeBus
from g474.machine import OPEN_V, Machine
from light import shown
from scene import KEY, SAMPLES, causes, last_said, log, said, state, until

import monitor

AGE_LIMIT_S = 10.0


@pytest.fixture
def turning(board, desk):
    """A machine in front of the probes, as the model expects it, judged since a moment."""
    speed_rpm, vectors_um = next(row for row in desk.record if None not in row[1])
    machine = Machine(board, speed_rpm, vectors_um)
    until(board, lambda: state(board)[0] in ("Learning", "Tracking"), 5.0)
    return machine


def test_samples_lost_while_flash_is_erased_skip_one_number(board, turning):
    board.run(0.5)
    erased_s = board.now_s
    assert Client(board, KEY, 100).ask(DEPLOY, (SAMPLES / "model.bin").read_bytes())[0] == "accepted"
    board.run(1.0)
    numbers = [signals["Sequence"] for _, signals in said(board, "ReadingStart")]
    steps = [after - before for before, after in zip(numbers, numbers[1:])]
    assert steps.count(2) >= 1 and set(steps) == {1, 2}
    assert "samples were lost" in log(board) and causes(board) == [["BOR"]]
    assert said(board, "ReadingStart", erased_s + 0.6)


def test_a_converter_that_stops_resets_and_is_told(board, turning):
    board.chip.adc.break_down()
    stopped_s = board.now_s
    board.run(0.4)
    assert causes(board)[:2] == [["BOR"], ["SFT"]]
    # the last half of the ring came up to 5 ms before
    assert 0.095 <= board.chip.resets[1][0] - stopped_s < 0.15
    assert "the converter, which stopped" in log(board, 2)


def test_a_broken_cable_is_a_lost_probe_and_the_others_go_on(board, turning):
    turning.gaps_v[1] = OPEN_V
    until(board, lambda: last_said(board, "Heartbeat")["Missing"] == 0b10, 4.0)
    broken_s = board.now_s
    board.run(2.0)
    assert state(board)[0] in ("Learning", "Tracking") and said(board, "Status", broken_s)
    assert all(signals["Used"] == 0b1101 for _, signals in said(board, "Status", broken_s))


def test_with_too_few_probes_it_is_blind_and_shows_it(board, turning):
    for probe in (0, 1, 2):
        turning.gaps_v[probe] = OPEN_V
    until(board, lambda: state(board)[0] == "Blind", 4.0)
    assert shown(board, 2) == "on with two gaps"


def test_without_a_keyphasor_readings_say_so_and_it_is_blind(board, turning):
    turning.has_keyphasor = False
    lost_s = board.now_s
    until(board, lambda: state(board) == ("Blind", "Keyphasor"), 6.0)
    assert str(said(board, "ReadingStart", lost_s)[-1][1]["Keyphasor"]) == "Missing"


def test_without_a_reading_for_the_age_limit_the_verdict_is_stale_and_shown_to_be(board, desk):
    speed_rpm, probes = next(row for row in desk.record if None not in row[1])
    with VirtualTimeBus(board) as bus:
        for sequence in range(3):
            for frame in monitor.reading(NODE, sequence, speed_rpm, probes):
                bus.send(frame)
            sent_s = board.now_s
            # a frame that python-can hears ends a run
            until(board, lambda: board.now_s >= sent_s + 1.0, 2.0)
        last_s = board.now_s - 1.0
    assert state(board)[0] in ("Learning", "Tracking")
    stale_s = until(board, lambda: state(board)[0] == "Stale", AGE_LIMIT_S + 2.0)
    assert AGE_LIMIT_S - 0.2 <= stale_s - last_s <= AGE_LIMIT_S + 0.3
    assert shown(board, 2) == "on with one gap"
