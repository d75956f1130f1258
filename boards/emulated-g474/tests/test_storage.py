"""Rows 11, 12, 15, 16, 18, 19: what is stored and how it may be damaged."""

import re

import pytest

import monitor
import storage
from conftest import NODE
from g474 import VirtualTimeBus
from commands import ACKNOWLEDGE, DEPLOY, Client
from scene import KEY, SAMPLES, causes, check, log, said, start, state

JOURNAL_MARK = b"REj2"


def counter(board):
    """The replay counter with which the board started."""
    return int(re.findall(r"with counter (\d+)", log(board))[-1])


def takes_a_deployment(board):
    model = (SAMPLES / "model.bin").read_bytes()
    outcome, _ = Client(board, KEY, 10_000).ask(DEPLOY, model)
    board.run(0.2)
    return outcome, state(board)[0]


def test_a_wiped_board_says_so_sends_no_results_and_takes_a_deployment(fresh, desk):
    assert state(fresh) == ("NoModel", "NothingStored") and counter(fresh) == 0
    speed_rpm, probes = next(row for row in desk.record if None not in row[1])
    with VirtualTimeBus(fresh) as bus:
        for sequence in range(3):
            for frame in monitor.reading(NODE, sequence, speed_rpm, probes):
                bus.send(frame)
            fresh.run(0.1)
    assert not said(fresh, "Status") and not said(fresh, "Residual")
    assert takes_a_deployment(fresh) == ("accepted", "Waiting")


@pytest.fixture(scope="module")
def slot_place(deployed_flash):
    """Where the deployed model lies."""
    board = start(deployed_flash)
    (place,) = storage.find(board.chip.flash, storage.MARK)
    return place


def board_with(deployed_flash, place, data):
    """A board with another slot in the place of its own."""
    flash = bytearray(deployed_flash)
    offset = place - storage.BANK_2
    flash[offset : offset + 4096] = data + b"\xff" * (4096 - len(data))
    return start(bytes(flash))


@pytest.mark.parametrize(
    "byte, value, reason", [(0, 9, "Schema"), (5, 7, "Size"), (6, 3, "Size")], ids=["schema", "probes", "planes"]
)
def test_a_model_of_another_schema_or_too_large_leaves_none_and_keeps_the_counter(
    deployed_flash, slot_place, byte, value, reason
):
    model = bytearray(storage.model_of(start(deployed_flash).chip.flash, slot_place))
    model[byte] = value
    board = board_with(deployed_flash, slot_place, storage.slot(3, 77, bytes(model)))
    assert state(board) == ("NoModel", reason) and counter(board) == 77
    assert causes(board) == [["BOR"]]
    assert takes_a_deployment(board) == ("accepted", "Waiting")
    check(board)


def test_an_older_firmwares_counter_is_taken_over_and_its_model_is_not(deployed_flash, slot_place):
    board = board_with(deployed_flash, slot_place, storage.old_slot(3, 4711, b"\x01\x00\x00\x00" + bytes(800)))
    assert state(board) == ("NoModel", "Schema") and counter(board) == 4711
    assert takes_a_deployment(board) == ("accepted", "Waiting")
    check(board)


@pytest.mark.parametrize("offset", [storage.HEAD_BYTES, storage.HEAD_BYTES + 400], ids=["its beginning", "its middle"])
def test_a_damaged_word_of_the_only_model_leaves_none_and_keeps_the_counter(
    deployed_flash, slot_place, offset
):
    expected = counter(start(deployed_flash))
    board = start(deployed_flash, damaged=[slot_place + offset])
    assert state(board) == ("NoModel", "Damaged") and counter(board) == expected
    assert causes(board) == [["BOR"]], "an error in what is stored resets nothing"
    assert takes_a_deployment(board) == ("accepted", "Waiting")
    check(board)


def test_a_damaged_word_of_memory_leaves_the_record_before(story):
    marks = storage.find(start(story.flagged_flash).chip.flash, JOURNAL_MARK)
    board = start(story.flagged_flash, damaged=[marks[-1] + 32])
    assert "remembered: true" in log(board) and causes(board) == [["BOR"]]
    check(board)


def test_while_the_supply_sags_commands_are_refused_and_nothing_is_written(flagged_flash):
    board = start(flagged_flash)
    client = Client(board, KEY, 10_000)
    board.chip.pwr.set_supply(2.85)
    changes = len(board.chip.flash.history)
    model = (SAMPLES / "better.bin").read_bytes()
    assert client.ask(DEPLOY, model)[0] == "storage" and client.ask(ACKNOWLEDGE)[0] == "storage"
    board.run(1.0)
    assert len(board.chip.flash.history) == changes and causes(board) == [["BOR"]] and state(board)[0] == "Flagged"
    board.chip.pwr.set_supply(3.3)
    assert client.ask(ACKNOWLEDGE)[0] == "accepted" and len(board.chip.flash.history) > changes
    check(board)
