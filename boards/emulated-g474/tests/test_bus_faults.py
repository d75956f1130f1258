"""Rows 6 to 10: a full bus, a lonely one, a broken one, a controller that stops, another with the same number."""

import pytest

import monitor
from conftest import NODE
from g474 import Babbler, Frame, Nucleo
from g474.chip import run
from g474.machine import Machine
from g474.timeline import SECOND_NS
from light import shown
from scene import IMAGE, causes, last_said, said, start, state, until

COUNTERS = next(kind.name for kind in monitor.DBC.messages if "Overflowed" in kind.signal_tree)
VECTORS_UM = [(12.0, -5.0), (-3.0, 8.0), (6.0, 6.0), (-9.0, 2.0)]
WATCHDOG_S = 0.6


@pytest.mark.parametrize("identifier", [0x000, 0x0FF])
def test_a_bus_full_of_frames_with_precedence_resets_nothing_and_clears_no_flag(flagged_flash, identifier):
    board = start(flagged_flash)
    Machine(board, 11000.0, VECTORS_UM)
    board.run(1.0)
    babbler = board.wire.join(Babbler(Frame(identifier, b"\x55" * 8)))
    board.wire.kick()
    full_s = board.now_s
    board.run(5.0)
    assert not [name for time_ns, name, _ in board.wire.log if name == "FDCAN1" and time_ns > (full_s + 0.01) * 1e9]
    board.wire.leave(babbler)
    board.run(1.5)
    assert causes(board) == [["BOR"]] and state(board)[0] == "Flagged"
    assert said(board, "ReadingStart", full_s + 5.0), "it goes on"
    assert last_said(board, COUNTERS)["Overflowed"] > 0


def test_without_anybody_to_acknowledge_it_repeats_and_goes_on_when_somebody_is_there(board):
    board.wire.leave(board.adapter)
    alone_s = board.now_s
    board.run(5.0)
    assert causes(board) == [["BOR"]]
    board.wire.join(board.adapter)
    board.run(1.5)
    assert said(board, "Heartbeat", alone_s + 5.0) and causes(board) == [["BOR"]]


def attempts(board, since_s):
    """When the board began to send anew on a wire that lets nothing through, s after it was broken."""
    times = [time_ns / 1e9 - since_s for time_ns, name, _ in board.wire.errors if name == "FDCAN1"]
    return [time_s for before_s, time_s in zip([-1.0, *times], times) if time_s - before_s > 0.05]


def test_off_the_bus_it_waits_longer_each_time_and_joins_a_healed_one_and_starts_over(board):
    board.wire.is_shorted = True
    broken_s = board.now_s
    board.run(27.0)
    began = attempts(board, broken_s)
    waits = [after - before for before, after in zip(began, began[1:])]
    # 3 ms of recessive bits and the loop that comes round every 50 ms are on top, and a second until there is a frame
    expected = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0]
    assert all(wanted <= wait < wanted + 1.1 for wait, wanted in zip(waits, expected)), waits
    assert len(waits) >= 7 and causes(board) == [["BOR"]]
    board.wire.is_shorted = False
    healed_s = board.now_s
    until(board, lambda: said(board, "Heartbeat", healed_s), 12.0)
    board.run(61.0)
    board.wire.is_shorted = True
    broken_s = board.now_s
    board.run(3.0)
    began = attempts(board, broken_s)
    began = [time_s for time_s in began if time_s > 0]
    assert 0.1 <= began[1] - began[0] < 1.2


def test_a_controller_that_stops_sending_is_reset(board):
    board.run(0.5)
    board.chip.fdcan.is_stuck = True
    Machine(board, 11000.0, VECTORS_UM)
    stuck_s = board.now_s
    board.run(3.0)
    assert ["IWDG"] in causes(board)
    first_s = next(time_s for time_s, cause in board.chip.resets if cause == ["IWDG"])
    assert first_s - stuck_s < 2.5
    board.chip.fdcan.is_stuck = False
    resets = len(causes(board))
    board.run(2.0)
    assert len(causes(board)) <= resets + 1 and said(board, "Heartbeat", board.now_s - 1.1)


def test_two_boards_with_one_number_stay_on_the_bus_and_in_conflict_send_nothing_but_their_state(deployed_flash):
    one = start(deployed_flash)
    Machine(one, 11000.0, VECTORS_UM)
    one.run(2.0)
    other = Nucleo(IMAGE, wire=one.wire)
    other.chip.fdcan.name = "other"
    other.chip.flash.banks[1][:] = deployed_flash
    Machine(other, 6000.0, VECTORS_UM)
    other.power_on()
    met_s = one.now_s
    run([one.chip, other.chip], 5.0)
    assert causes(one) == causes(other) == [["BOR"]]
    assert not one.chip.fdcan.is_off and not other.chip.fdcan.is_off
    conflicts = {
        name: [time_s for time_s, signals in said(one, "State", met_s, name) if str(signals["State"]) == "Conflict"]
        for name in ("FDCAN1", "other")
    }
    assert any(conflicts.values())
    for name, times_s in conflicts.items():
        if times_s:
            # what was on its way goes out before
            silent_s = times_s[0] + 0.1
            assert not said(one, "ReadingStart", silent_s, name) and not said(one, "Status", silent_s, name)


def test_somebody_elses_frames_under_its_number_silence_it_and_the_light_tells(board):
    Machine(board, 11000.0, VECTORS_UM)
    board.run(1.0)
    kind = monitor.DBC.get_message_by_name("Heartbeat")
    frame = Frame(kind.frame_id + NODE, kind.encode(said(board, "Heartbeat")[-1][1] | {"Readings": 7}))

    def speak():
        board.adapter.send(frame)
        board.timeline.after(SECOND_NS // 10, speak)

    speak()
    board.run(2.0)
    assert state(board) == ("Conflict", "NumberInUse")
    silent_s = board.now_s
    assert shown(board) == "half a second on and off"
    assert not said(board, "ReadingStart", silent_s) and not said(board, "Status", silent_s)
