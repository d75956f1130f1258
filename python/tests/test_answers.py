"""Python answers what the program prints, letter by letter, and nothing of it is lost in the dataclasses."""

import dataclasses
import json
import math
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import rotor_edge
from conftest import KIT, ROOT, TURBINE
from rotor_edge.record import Record

ROTOR, RECORD = TURBINE / "rotor.toml", TURBINE / "record.csv"
RUNUP, LATER = TURBINE / "runup-day000.csv", TURBINE / "runup-day126.csv"
BEGIN = datetime(2024, 3, 1, 6, tzinfo=timezone(timedelta(hours=1)))


def plain(value):
    """A dataclass as the JSON it was made from."""
    if isinstance(value, Record):
        return {f.name.removesuffix("_"): plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(part) for part in value]
    if isinstance(value, np.ndarray):
        return [None if isinstance(v, float) and math.isnan(v) else v for v in value.tolist()]
    return value


def assert_whole(answer):
    """Every key of the JSON is a field with its value; fields that a JSON object leaves out are empty."""

    def compare(fields, found, at):
        if isinstance(found, dict):
            assert set(found) <= set(fields), f"{at}: no field for {set(found) - set(fields)}"
            for name, value in found.items():
                compare(fields[name], value, f"{at}.{name}")
            assert all(fields[name] is None for name in set(fields) - set(found)), at
        elif isinstance(found, list):
            assert len(fields) == len(found), at
            for i, (field, value) in enumerate(zip(fields, found)):
                compare(field, value, f"{at}[{i}]")
        else:
            assert fields == found, at

    beside = {"json", "csv", "rotor", "measurement", "measurement_2x"}
    fields = {name: value for name, value in plain(answer).items() if name not in beside}
    found = {name: value for name, value in answer.as_dict().items() if name not in beside}
    compare(fields, found, type(answer).__name__)


def test_check(printed):
    answer = rotor_edge.check(ROTOR, rpm=(9000, 11000))
    assert answer.json == printed("check", ROTOR, "--rpm", "9000..11000")
    assert_whole(answer)
    assert answer.mass_kg > 100 and answer.modes[0].whirl in ("forward", "backward", "mixed")


def test_compare(printed):
    answer = rotor_edge.compare(ROTOR, LATER)
    assert answer.json == printed("compare", ROTOR, LATER)
    assert_whole(answer)
    assert answer.verdict == "misses" and answer.determined.planes[0].interval_95.shape == (2,)


def test_diagnose(printed):
    answer = rotor_edge.diagnose(ROTOR, LATER)
    assert answer.json == printed("diagnose", ROTOR, LATER)
    assert_whole(answer)
    assert (answer.verdict, answer.candidates[0].effect, answer.candidates[0].at) == ("missing", "seal", "disk 3")


def test_add(printed, tmp_path):
    output = tmp_path / "better.toml"
    answer = rotor_edge.add(ROTOR, "seal@disk 3", LATER)
    assert answer.json == printed("add", ROTOR, "seal@disk 3", "--data", LATER, "-o", output)
    assert answer.rotor == rotor_edge.read_rotor(output)
    assert_whole(answer)


def test_improve_tells_its_progress_and_gives_the_better_model(printed, tmp_path):
    ours, theirs, steps = tmp_path / "ours.toml", tmp_path / "theirs.toml", []
    answer = rotor_edge.improve(ROTOR, LATER, output=ours, progress=lambda *step: steps.append(step))
    assert answer.json == printed("improve", ROTOR, LATER, "-o", theirs)
    assert ours.read_bytes() == theirs.read_bytes() and answer.rotor == rotor_edge.read_rotor(theirs)
    assert_whole(answer)
    assert steps == [(k + 1, None) for k in range(len(answer.steps))] and answer.verdict == "adequate"


def test_identify(printed, tmp_path):
    output = tmp_path / "identified.toml"
    answer = rotor_edge.identify(ROTOR, RECORD, days=(0, 2), runup=RUNUP)
    assert answer.json == printed("identify", ROTOR, RECORD, "--days", "0..2", "--runup", RUNUP, "-o", output)
    assert answer.rotor == rotor_edge.read_rotor(output)
    assert_whole(answer)


def test_track_and_its_progress(printed, tmp_path):
    table, steps = tmp_path / "track.csv", []
    answer = rotor_edge.track(
        ROTOR, RECORD, runup=RUNUP, growth=1.3, begin=BEGIN, progress=lambda *step: steps.append(step)
    )
    words = ["track", ROTOR, RECORD, "--runup", RUNUP, "--growth", "1.3", "--begin", BEGIN.isoformat(), "--csv", table]
    assert answer.json == printed(*words)
    assert answer.csv == table.read_text()
    assert_whole(answer)
    assert steps[-1][0] == steps[-1][1] and steps == sorted(steps)
    assert len(answer.columns["static_g_mm"]) == len(answer.estimates)
    assert answer.columns["time"][0] == answer.estimates[0].time and answer.begin == "2024-03-01T05:00:00Z"


def test_track_by_all_days_together(printed):
    records = ROOT / "tests" / "records"
    rotor, record, runup = records / "rotor.toml", records / "quiet" / "record.csv", records / "quiet" / "runup.csv"
    answer = rotor_edge.track(rotor, record, runup=runup, method="joint")
    assert answer.json == printed("track", rotor, record, "--runup", runup, "--method", "joint")
    assert_whole(answer)
    ahead = rotor_edge.forecast(answer)
    assert_whole(ahead)
    assert ahead.model == "state"
    assert answer.estimates[0].interval_95.planes[0].unbalance_g_mm.shape == (2,)


def test_forecast_of_a_track_in_memory_and_of_its_file(printed, tmp_path):
    table = tmp_path / "track.csv"
    followed = rotor_edge.track(ROTOR, RECORD, runup=RUNUP)
    table.write_text(followed.csv)
    options = {"model": "naive", "horizons": (1, 7), "days": 20, "limit": 900.0}
    answer = rotor_edge.forecast(followed, **options)
    words = ["forecast", table, "--model", "naive", "--horizons", "1,7", "--days", "20", "--limit", "900"]
    assert answer.json == rotor_edge.forecast(table, **options).json == printed(*words)
    assert_whole(answer)
    assert answer.limit.limit_g_mm == 900 and len(answer.forecast) == 20


def test_simulate(printed, tmp_path):
    readings, truth = tmp_path / "measured.csv", tmp_path / "truth.json"
    answer = rotor_edge.simulate(
        ROTOR,
        effects={"pedestal@16": {"k": 2e8, "m": 300, "c": 4e4}, "shaft_bow": {"m": 2e-6j}},
        speeds_rpm=[3000, 6000, 9000],
        weights={"trial": {"15": 400j}},
        unbalance_g_mm={"15": 500, "16": 300j},
        noise=(0.01, 0.05),
        output=readings,
        truth=truth,
    )
    words = ["--with=pedestal@16", "--set=k=2e8", "--set=m=300", "--set=c=4e4", "--with=shaft_bow", "--set=m=[0,2e-6]"]
    words += ["--speeds=3000,6000,9000", "--weight=trial:15=400@90", "--unbalance=15=500@0", "--unbalance=16=300@90"]
    assert answer.json == printed("simulate", ROTOR, "-o", readings, *words, "--noise=0.01,0.05")
    assert_whole(answer)
    assert json.loads(truth.read_text()) == answer.as_dict()["truth"]
    assert answer.truth.effects[0].parameters["k"] == 2e8 and answer.runs[1].name == "trial"
    assert len(answer.measurement["speed_rpm"]) == 6
    hidden = rotor_edge.simulate(ROTOR, hide=3)
    assert hidden.truth is None and len(hidden.measurement["speed_rpm"]) == hidden.readings


def test_plan(printed):
    answer = rotor_edge.plan(KIT / "rotor.toml", speeds=(500, 4000, 21), unbalance=5.0)
    assert answer.json == printed("plan", KIT / "rotor.toml", "--speeds", "500..4000:21", "--unbalance", "5")
    assert_whole(answer)
    assert answer.planes[0].accuracy > 0 and answer.next[0].gain > 0


def test_estimate(printed):
    rig = ROOT / "tests" / "rigs" / "rk4"
    answer = rotor_edge.estimate(rig / "rotor.toml", rig / "measured.csv")
    assert answer.json == printed("estimate", rig / "rotor.toml", rig / "measured.csv")
    assert_whole(answer)
    assert len(answer.estimates) == 84 and answer.refuted_runs[0].found[0].name
    assert answer.estimates[0].planes[0].region.covariance_g2_mm2.shape == (2, 2)
    rotor, data = KIT / "rotor.toml", KIT / "startup.csv"
    alone = rotor_edge.estimate(rotor, data, base="0 g", leave_one_out=True)
    assert alone.json == printed("estimate", rotor, data, "--base", "0 g", "--leave-one-out")


@pytest.mark.whole
def test_startup_tells_its_progress_and_gives_the_better_model(printed, tmp_path):
    ours, theirs, steps = tmp_path / "ours.toml", tmp_path / "theirs.toml", []
    answer = rotor_edge.startup(
        KIT / "rotor.toml",
        KIT / "startup.csv",
        clearance_um=120,
        speeds_rpm=(1000, 3600),
        range_rpm=(600, 4000),
        output=ours,
        progress=lambda *step: steps.append(step),
    )
    words = ["startup", KIT / "rotor.toml", KIT / "startup.csv", "--clearance-um", "120", "--speeds", "1000,3600"]
    assert answer.json == printed(*words, "--range", "600..4000", "-o", theirs)
    assert ours.read_bytes() == theirs.read_bytes() and answer.rotor == rotor_edge.read_rotor(theirs)
    assert_whole(answer)
    assert steps == [(k + 1, None) for k in range(len(answer.improved.effects))]
    assert answer.runs[0].half_power["IB x"].half_power_rpm.shape == (2,)


def test_startup_without_angles_gives_no_rotor_or_is_refused(printed, refused, tmp_path):
    """Where no weight has an angle, no run is left to fit a rotor model to."""
    rotor, data = tmp_path / "rotor.toml", tmp_path / "startup.csv"
    rotor.write_text((KIT / "rotor.toml").read_text().replace("angle_deg = 0.000\n", ""))
    lines = (KIT / "startup.csv").read_text().splitlines()
    data.write_text("\n".join([lines[0], *(line for line in lines if line.startswith("0.4 g,"))]) + "\n")
    answer = rotor_edge.startup(rotor, data, improved=False)
    assert answer.json == printed("startup", rotor, data)
    assert_whole(answer)
    assert answer.rotor is None and answer.improved is None
    with pytest.raises(rotor_edge.Error) as error:
        rotor_edge.startup(rotor, data)
    assert str(error.value) == refused("startup", rotor, data, "-o", tmp_path / "better.toml")


def test_balance(printed):
    answer = rotor_edge.balance(KIT / "rotor.toml", KIT / "startup.csv", radii_mm=[30, 40], step_g=0.05)
    words = ["balance", KIT / "rotor.toml", KIT / "startup.csv", "--radii-mm", "30,40", "--step-g", "0.05"]
    assert answer.json == printed(*words)
    assert_whole(answer)


def test_balance_with_holes_of_which_some_are_taken(printed):
    plane = rotor_edge.read_rotor(KIT / "rotor.toml").drawing["plane"][0]["name"]
    answer = rotor_edge.balance(
        KIT / "rotor.toml", KIT / "startup.csv", holes=16, taken={plane: [1, 2]}, largest_g_mm={plane: 40}, min_max=True
    )
    options = ["--holes=16", f"--taken={plane}=1", f"--taken={plane}=2", f"--largest-g-mm={plane}=40", "--min-max"]
    assert answer.json == printed("balance", KIT / "rotor.toml", KIT / "startup.csv", *options)
    assert_whole(answer)
    weight = answer.ways[0].weights[0]
    assert weight.placed and {piece.hole for piece in weight.placed}.isdisjoint({1, 2})
    assert weight.unbalance_g_mm <= 40 * (1 + 1e-9)


def test_balance_without_a_file(printed, tmp_path):
    """Two planes of a linear machine; a column of weights is as good as a file of them."""
    influence = np.array([[0.05 - 0.02j, 0.01j], [0.02 + 0.01j, 0.06 - 0.03j]])
    own = np.array([300 * np.exp(0.7j), 200 * np.exp(-1j)])
    added = {"base": [0, 0], "A": [150, 0], "B": [0, 150j]}
    vibration = np.array([influence @ (own + weights) for weights in added.values()])
    columns = {"run": list(added), "speed_rpm": [3000.0] * 3}
    for probe, name in enumerate(["P", "Q"]):
        columns |= {f"{name}_cos_um": vibration[:, probe].real, f"{name}_sin_um": -vibration[:, probe].imag}
    weights = {"run": ["A", "B"], "plane": ["left", "right"], "magnitude_g_mm": [150, 150], "angle_deg": [0, 90]}
    answer = rotor_edge.balance_by_trials(columns, weights=weights, largest_g_mm={"left": 500, "right": 400})
    data, stated = tmp_path / "data.csv", tmp_path / "weights.csv"
    for path, held in ((data, columns), (stated, weights)):
        rows = [",".join(held), *(",".join(map(str, row)) for row in zip(*held.values()))]
        path.write_text("\n".join(rows) + "\n")
    words = ["balance", "--trial-only", data, "--weights", stated, "--largest-g-mm", "left=500,right=400"]
    assert answer.json == printed(*words)
    assert_whole(answer)
    assert [round(w.magnitude_g_mm, 3) for w in answer.weights] == [300, 200]


class OfRoss:
    """What a ``ross.Rotor`` does when it is saved."""

    def __init__(self, file):
        self.file = file

    def save(self, path):
        with open(path, "wb") as saved:
            saved.write(self.file.read_bytes())


def test_a_rotor_of_ross_is_taken_as_it_is_and_from_its_file(printed, tmp_path):
    file, output = ROOT / "tests" / "data" / "ross" / "constant.toml", tmp_path / "rotor.toml"
    answer = rotor_edge.import_rotor(OfRoss(file))
    there = json.loads(printed("import-rotor", file, "-o", output))
    assert (list(answer.carried), list(answer.left)) == (there["carried"], there["left"])
    assert rotor_edge.import_rotor(file).rotor == rotor_edge.read_rotor(output)
    assert {**answer.rotor.drawing, "name": "constant"} == rotor_edge.read_rotor(output).drawing
    assert_whole(answer)


def test_extract_from_samples_in_memory_and_from_their_file(printed, tmp_path):
    rate_hz, turns = 20_000, np.arange(20_000) * 50 / 20_000
    samples = {
        "kph": ((turns % 1) < 0.1) * 5.0,
        # 10 µm at the mark, 20 µm a quarter of a turn behind it
        "15X": -10 + 7.87e-3 * 10 * np.cos(2 * np.pi * turns),
        "15Y": -9 + 7.87e-3 * 20 * np.sin(2 * np.pi * turns),
    }
    file, output = tmp_path / "samples.npz", tmp_path / "measured.csv"
    np.savez(file, **samples)
    answer = rotor_edge.extract(file, rate_hz=rate_hz, mv_um=7.87, output=output)
    words = ["extract", file, "--rate-hz", rate_hz, "--mv-um=7.87", "-o", output, "--force"]
    assert answer.json == printed(*words)
    assert_whole(answer)
    assert answer.readings == len(answer.speeds) > 1 and answer.lost == 0
    assert np.allclose(answer.speeds, 3000, rtol=1e-5)
    again = rotor_edge.extract(samples, rate_hz=rate_hz, mv_um={"15X": 7.87, "15Y": 7.87})
    for column in ["15X_cos_um", "15Y_sin_um"]:
        assert np.array_equal(again.measurement[column], answer.measurement[column])
    several = rotor_edge.extract([file, file], rate_hz=rate_hz, mv_um=7.87, run=["as found", "trial"])
    assert [of.run for of in several.files] == ["as found", "trial"]
    assert several.readings == 2 * answer.readings and set(several.measurement["run"]) == {"as found", "trial"}
    # the probe's voltage rises as the shaft comes nearer
    assert np.allclose(answer.measurement["15X_cos_um"], 10, atol=0.01)
    swept = rotor_edge.extract(file, rate_hz=rate_hz, mv_um=7.87, two_x=True, bin_rpm=50, compensate_rate=True)
    assert_whole(swept)
    # there is nothing at twice the speed
    assert np.allclose(swept.measurement_2x["15X_cos_um"], 0, atol=0.01) and answer.measurement_2x is None
    with pytest.raises(rotor_edge.Error, match="no channel is called keyphasor"):
        rotor_edge.extract({"15X": samples["15X"]}, rate_hz=rate_hz, mv_um=7.87)
