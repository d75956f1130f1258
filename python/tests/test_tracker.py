"""The controller's core from Python: to the bit what `replay` says of the same record."""

import json

import numpy as np
import pytest
import rotor_edge
from conftest import TURBINE

RECORD = TURBINE / "record.csv"
DAY_S = 86_400


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    path = tmp_path_factory.mktemp("tracker") / "identified.toml"
    rotor_edge.identify(TURBINE / "rotor.toml", RECORD, runup=TURBINE / "runup-day000.csv", output=path)
    return path


def tracker_of(rotor, data, **thresholds):
    return rotor_edge.Tracker(rotor, fastest_rpm=data.speed_rpm.max(), thresholds=thresholds)


def test_it_answers_to_the_bit_what_the_replay_does(printed, identified):
    words = ["replay", "--rotor", identified, "--record", RECORD, "--identified", "--set", "age_limit_s=216000"]
    there = json.loads(printed(*words, "--answers"))
    data = rotor_edge.read_measurement(RECORD)
    tracker = tracker_of(identified, data, age_limit_s=216000)
    began_d = data["time_d"][0]
    answered, states = [], []
    for row, (day, rpm, phasors) in enumerate(zip(data["time_d"], data.speed_rpm, data.phasors_um)):
        said = tracker.read((day - began_d) * DAY_S, rpm, phasors)
        if said.result is not None:
            answered.append({"row": row, "time_d": day, **said.as_dict()["result"]})
        if not states or states[-1][1:] != (said.state, said.reason):
            states.append((day, said.state, said.reason))
    assert answered == there["answers"] and len(answered) == len(data)
    waiting, *others = [(s["time_d"], s["state"], s["reason"]) for s in there["states"]]
    assert waiting[1] == "waiting" and states == others
    assert said.state == "flagged" and said.suspect == said.result.suspect == 2
    assert said.result.unbalance_g_mm.shape == (2, 2) and said.result.probes_used == (1, 2, 3, 4)


def test_tracker_of_rotor_in_memory_follows_the_readings(identified):
    data = rotor_edge.read_measurement(RECORD)
    tracker = tracker_of(rotor_edge.read_rotor(identified), data)
    said = tracker.wait(0)
    assert (said.state, said.reason, said.result, said.age_s) == ("waiting", "no_reading", None, None)
    said = tracker.read(1.0, data.speed_rpm[0], data.phasors_um[0])
    assert said.state == "learning" and "learning" in said._repr_html_() and said.result.e_um > 0
    lost = data.phasors_um[1].copy()
    lost[2] = np.nan
    said = tracker.read(2.0, data.speed_rpm[1], lost)
    assert said.missing_probes == (3,) and said.result.probes_used == (1, 2, 4)
    said = tracker.read(3.0, 10 * data.speed_rpm.max(), data.phasors_um[1])
    assert (said.state, said.result) == ("blind", None)
    assert tracker.wait(60.0).state == "stale"


def test_what_cannot_be_is_refused_in_one_sentence(identified):
    data = rotor_edge.read_measurement(RECORD)
    with pytest.raises(rotor_edge.Error, match="^rotor.toml: .*unbalance_g_mm is missing; `rotor-edge identify`"):
        rotor_edge.Tracker(rotor_edge.read_rotor(TURBINE / "rotor.toml"))
    with pytest.raises(rotor_edge.Error, match="^there is no threshold height; there are"):
        tracker_of(identified, data, height=1)
    with pytest.raises(rotor_edge.Error, match="^the thresholds cannot be: rise"):
        tracker_of(identified, data, rise=-1)
    tracker = tracker_of(identified, data)
    with pytest.raises(rotor_edge.Error, match="^the reading has 3 probes, expected 4 as in the rotor's file"):
        tracker.read(0, 11000, data.phasors_um[0, :3])
    tracker.wait(5)
    for time_s in (4.9, -1, np.nan, np.inf):
        with pytest.raises(rotor_edge.Error, match="cannot be, expected seconds from 5 on"):
            tracker.read(time_s, 11000, data.phasors_um[0])
