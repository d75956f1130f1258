"""Rows 13 and 14: power fails at every write and every erasure of a deployment, and of a flag's record.

The changes are recorded once, and each cut is played afterwards: what was written before it, the double word or the page
under way torn, nothing behind it. Then the board starts from that.
"""

import random
import re

import pytest

import monitor
from conftest import NODE
from commands import ACKNOWLEDGE, DEPLOY, GET_THRESHOLDS, SET_THRESHOLDS, Client
from g474.flash import Change
from scene import KEY, SAMPLES, check, log, said, start, state

VERDICT_S = 0.2
"""Past the first frames of a start: the model is tried out, then a tenth of a second listened."""
NEW_COUNTER = 1000


class Cuts:
    """One board that starts again and again."""

    def __init__(self):
        self.board = start()
        self.chip = self.board.chip

    def start_from(self, flash, run_s=VERDICT_S):
        """Power goes, and comes back with this in flash: (contents of the second bank, addresses of damaged words)."""
        contents, damaged = flash
        self.chip.power_off()
        self.chip.flash.banks[1][:] = contents
        self.chip.flash.double_errors = set(damaged)
        self.chip.power_on(seed=len(self.chip.resets))
        self.since_s = self.board.now_s
        self.board.run(run_s)


def torn(chip, before, changes, place, noise):
    """The second bank after a cut in a change: whole before it, torn in it; and which words have lost their code."""
    flash = chip.flash
    flash.banks[1][:], flash.double_errors = before, set()
    for change in changes[:place]:
        flash.apply(change)
    change = changes[place]
    if change.data is None:
        # some words are erased, some are not yet, some are neither
        for word in range(change.address, change.address + 2048, 8):
            fate = noise.randrange(3)
            if fate == 0:
                flash.apply(Change(0, word, b"\xff" * 8))
            elif fate == 1:
                flash.tear(Change(0, word, b"\xff" * 8), lambda old, new: old | noise.randrange(256))
    else:
        flash.tear(change, lambda old, new: old & (new | noise.randrange(256)))
    return bytes(flash.banks[1]), frozenset(flash.double_errors)


def checksum(board, since_s=0.0):
    return said(board, "Model", since_s)[-1][1]["Checksum"]


@pytest.fixture(scope="module")
def second_deployment(deployed_flash):
    """Before it, its changes, the model before, the model after."""
    board = start(deployed_flash)
    old = checksum(board)
    changes = len(board.chip.flash.history)
    assert Client(board, KEY, NEW_COUNTER - 1).ask(DEPLOY, (SAMPLES / "better.bin").read_bytes()) == ("accepted", NEW_COUNTER)
    board.run(1.1)
    assert checksum(board) != old
    return deployed_flash, board.chip.flash.history[changes:], old, checksum(board)


@pytest.mark.parametrize("tears", [True, False], ids=["in a change", "between two"])
def test_after_a_cut_at_any_write_of_a_deployment_there_is_the_old_model_or_the_new_one(second_deployment, tears):
    before, changes, old, new = second_deployment
    cuts, noise = Cuts(), random.Random(7)
    seen = []
    for place in range(len(changes)):
        if tears:
            flash = torn(cuts.chip, before, changes, place, noise)
        else:
            cuts.chip.flash.banks[1][:] = before
            for change in changes[:place]:
                cuts.chip.flash.apply(change)
            flash = bytes(cuts.chip.flash.banks[1]), ()
        cuts.start_from(flash)
        found = checksum(cuts.board, cuts.since_s)
        counter = int(re.findall(r"with counter (\d+)", log(cuts.board))[-1])
        assert found == new and counter == NEW_COUNTER or found == old and counter <= NEW_COUNTER, (place, found, counter)
        seen.append(found == new)
    assert not seen[0] and seen == sorted(seen), "once the new one is there, it stays"
    assert len(changes) > 50
    check(cuts.board)


def test_after_a_cut_at_any_write_of_a_flags_record_what_was_learned_is_there_with_or_without_the_flag(story):
    cuts, noise = Cuts(), random.Random(8)
    assert story.flagged_changes
    flagged = []
    for place in range(len(story.flagged_changes)):
        cuts.start_from(torn(cuts.chip, story.learned_flash, story.flagged_changes, place, noise))
        assert "remembered: true" in log(cuts.board), place
        flagged.append(state(cuts.board)[0] == "Flagged")
    assert not flagged[0] and flagged == sorted(flagged)
    check(cuts.board)


def thresholds(client):
    """Those in force, as they travel: behind the answer's head, before its code."""
    client.counter += 1
    return client.exchange(monitor.request(client.key, NODE, GET_THRESHOLDS, client.counter))[20:-16]


def test_after_a_cut_at_any_write_of_thresholds_the_flag_is_up(story):
    """Thresholds are stored beside the model, which erases and writes while the flag is up."""
    board = start(story.flagged_flash)
    client = Client(board, KEY, NEW_COUNTER)
    changes = len(board.chip.flash.history)
    assert client.ask(SET_THRESHOLDS, thresholds(client))[0] == "accepted"
    after = board.chip.flash.history[changes:]
    cuts, noise = Cuts(), random.Random(9)
    for place in range(len(after)):
        cuts.start_from(torn(cuts.chip, story.flagged_flash, after, place, noise))
        assert state(cuts.board)[0] == "Flagged", place
    check(cuts.board)


def test_after_a_cut_at_any_write_of_an_acknowledgement_the_flag_is_up_or_gone(story):
    board = start(story.flagged_flash)
    changes = len(board.chip.flash.history)
    assert Client(board, KEY, NEW_COUNTER).ask(ACKNOWLEDGE)[0] == "accepted"
    after = board.chip.flash.history[changes:]
    cuts, noise, flagged = Cuts(), random.Random(10), []
    for place in range(len(after)):
        cuts.start_from(torn(cuts.chip, story.flagged_flash, after, place, noise))
        assert "remembered: true" in log(cuts.board), place
        flagged.append(state(cuts.board)[0] == "Flagged")
    assert flagged[0] and flagged == sorted(flagged, reverse=True), "once it is gone, it stays so"
    check(cuts.board)
