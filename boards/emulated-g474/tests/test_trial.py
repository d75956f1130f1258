"""Row 27: a model on trial is in memory alone, and the one before comes back by a reset, at its time or with the power."""

import random
import re
import struct

import pytest

from commands import DEPLOY, Client
from scene import KEY, SAMPLES, causes, check, log, said, start
from test_power_cut import NEW_COUNTER, Cuts, checksum, torn

TRIAL = 7
TRIAL_S = 3


def better():
    return (SAMPLES / "better.bin").read_bytes()


def try_out(board):
    """A client whose trial the board has begun."""
    client = Client(board, KEY, NEW_COUNTER - 1)
    assert client.ask(TRIAL, struct.pack("<I", TRIAL_S) + better()) == ("accepted", NEW_COUNTER)
    return client


def on_trial(board):
    """Of the last heartbeat, with the model's checksum."""
    signals = said(board, "Model")[-1][1]
    return signals["OnTrial"], signals["Checksum"]


def test_what_is_not_confirmed_is_taken_back_at_its_time_and_the_log_says_so(board):
    old = on_trial(board)
    assert old[0] == 0
    try_out(board)
    began_s = board.now_s
    board.run(TRIAL_S - 0.5)
    assert on_trial(board)[0] == 1 and on_trial(board)[1] != old[1] and len(causes(board)) == 1
    board.run(1.0)
    assert causes(board) == [["BOR"], ["SFT"]]
    assert board.chip.resets[-1][0] == pytest.approx(began_s + TRIAL_S, abs=0.1)
    assert on_trial(board) == old
    assert f"with counter {NEW_COUNTER}," in log(board) and "a trial, whose model was not confirmed" in log(board)


def test_what_is_confirmed_stays_without_a_reset_and_over_a_loss_of_power(board):
    client = try_out(board)
    board.run(1.1)
    tried = on_trial(board)
    assert client.ask(DEPLOY, better())[0] == "accepted"
    board.run(TRIAL_S + 1.0)
    assert on_trial(board) == (0, tried[1]) and len(causes(board)) == 1
    again = start(bytes(board.chip.flash.banks[1]))
    assert on_trial(again) == (0, tried[1])
    check(again)


def test_after_a_cut_at_any_write_of_a_trial_there_is_the_old_model(deployed_flash):
    board = start(deployed_flash)
    old, changes = checksum(board), len(board.chip.flash.history)
    try_out(board)
    changes = board.chip.flash.history[changes:]
    assert 0 < len(changes) < 50, "a record of the counter, no model"
    cuts, noise, counters = Cuts(), random.Random(11), []
    for place in range(len(changes)):
        cuts.start_from(torn(cuts.chip, deployed_flash, changes, place, noise))
        assert checksum(cuts.board, cuts.since_s) == old, place
        counters.append(int(re.findall(r"with counter (\d+)", log(cuts.board))[-1]))
    assert all(counter <= NEW_COUNTER for counter in counters) and counters == sorted(counters)
    check(cuts.board)
