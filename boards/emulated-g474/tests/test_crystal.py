"""Rows 4 and 5: a crystal that does not start, and one that stops."""

from g474.board import CRYSTAL_HZ
from g474.wire import ACKNOWLEDGE, Frame
from light import shown
from scene import causes, log, said, start


def silent(board, seconds):
    """Sends nothing and acknowledges nothing, and the watchdog is content."""
    sent, resets = len(board.wire.log), len(causes(board))
    board.run(seconds)
    assert len(board.wire.log) == sent and len(causes(board)) == resets
    board.adapter.send(Frame(0x101, bytes(8)))
    board.run(0.01)
    assert board.wire.errors[-1][1:] == ("host", ACKNOWLEDGE)
    board.adapter.queue.clear()


def test_without_a_crystal_it_is_silent_and_shows_it_and_starts_when_it_swings(deployed_flash):
    board = start(deployed_flash, crystal_hz=0)
    assert "the crystal does not swing" in log(board)
    silent(board, 3.0)
    assert shown(board) == "on with four gaps"
    board.chip.rcc.revive_hse(CRYSTAL_HZ)
    back_s = board.now_s
    board.run(0.5)
    assert causes(board) == [["BOR"], ["SFT"]] and board.chip.resets[-1][0] - back_s < 0.1
    assert "swings again" in log(board) and said(board, "Heartbeat", back_s)


def test_a_crystal_that_stops_later_resets_at_once_and_is_told(board):
    board.chip.rcc.kill_hse()
    stopped_s = board.now_s
    board.run(0.5)
    assert causes(board) == [["BOR"], ["SFT"]] and board.chip.resets[-1][0] - stopped_s < 1e-3
    assert "the crystal, which stopped" in log(board)
    silent(board, 2.0)


def test_without_a_crystal_a_flag_of_before_stays_lit(flagged_flash):
    board = start(flagged_flash, crystal_hz=0)
    silent(board, 1.0)
    assert shown(board) == "on"
