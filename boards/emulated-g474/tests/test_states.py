"""A machine that is learned, tracked and breaks, with the probes turning in front of it; what LD2 shows in each state."""

from scene import causes, said, start, state


def test_a_minute_of_learning_then_tracking_and_a_bearing_that_breaks_is_flagged_in_time(story):
    assert 60.0 <= story.seconds["Learning"] + story.seconds["Tracking"] <= 75.0 or 60.0 <= story.seconds["Tracking"] <= 75.0
    assert story.seconds["Suspicious"] < 3.0
    assert 10.0 <= story.seconds["Flagged"] <= 15.0
    assert causes(story.board) == [["BOR"]]


def test_the_light_tells_the_states_apart(story):
    assert story.lights == {
        "Waiting": "three short flashes",
        "Learning": "two short flashes",
        "Tracking": "one short flash",
        "Suspicious": "flickers",
        "Flagged": "on",
    }


def test_the_flag_is_up_again_before_the_first_frame_after_a_restart(flagged_flash):
    board = start(flagged_flash, run_s=1.2)
    states = {str(signals["State"]) for _, signals in said(board, "Heartbeat") + said(board, "State")}
    assert states <= {"Flagged", "Listening"} and state(board)[0] == "Flagged"
    board.chip.reset_pin()
    reset_s = board.now_s
    board.run(1.2)
    assert {str(signals["State"]) for _, signals in said(board, "Heartbeat", reset_s)} <= {"Flagged", "Listening"}


def test_what_was_learned_is_known_after_a_restart(story):
    board = start(story.learned_flash, run_s=1.2)
    assert state(board)[0] == "Waiting"
