"""What is in memory is as good as a file, and is refused in the same words."""

import numpy as np
import pytest
import rotor_edge
from conftest import TURBINE

ROTOR, RUNUP = TURBINE / "rotor.toml", TURBINE / "runup-day126.csv"


class Frame:
    """What pandas and polars have in common: names of columns, and columns by name."""

    def __init__(self, columns):
        self._columns = columns
        self.columns = list(columns)

    def __getitem__(self, name):
        return self._columns[name]


def structured(columns):
    kinds = [(name, "U20" if name == "run" else float) for name in columns]
    return np.array(list(zip(*columns.values())), dtype=kinds)


def test_readings_in_memory_are_those_of_the_file():
    rotor, data = rotor_edge.read_rotor(ROTOR), rotor_edge.read_measurement(RUNUP, ROTOR)
    from_file = rotor_edge.compare(ROTOR, RUNUP).json
    assert rotor_edge.compare(rotor, data).json == from_file
    for held in (dict(data.columns), Frame(data.columns), structured(data.columns)):
        assert rotor_edge.compare(rotor, held).json == from_file


def test_a_measurement_is_arrays():
    data = rotor_edge.read_measurement(RUNUP)
    assert data.probes == ("15X", "15Y", "16X", "16Y") and data.phasors_um.shape == (len(data), 4)
    assert data["run"][0] == "day 126" and data["15X_cos_um"][0] == 0.12716
    assert data.phasors_um[0, 0] == 0.12716 + 0.05089j
    assert "15X" in data._repr_html_()


def test_a_lost_reading_is_no_number_and_stays_lost(tmp_path):
    columns = dict(rotor_edge.read_measurement(RUNUP).columns)
    lost = columns["15X_cos_um"].copy()
    lost[3] = np.nan
    columns["15X_cos_um"] = lost
    lines = RUNUP.read_text().splitlines()
    cells = lines[4].split(",")
    cells[2] = ""
    path = tmp_path / "lost.csv"
    path.write_text("\n".join([*lines[:4], ",".join(cells), *lines[5:]]) + "\n")
    assert rotor_edge.compare(ROTOR, columns).json == rotor_edge.compare(ROTOR, path).json
    assert np.isnan(rotor_edge.read_measurement(path)["15X_cos_um"]).sum() == 1


def test_gap_voltages_are_read_and_taken(tmp_path):
    lines = [line for line in RUNUP.read_text().splitlines() if not line.startswith("#")]
    gaps = ["16X_gap_v", *["-9.5", "", *["-9.25"] * (len(lines) - 3)]]
    path = tmp_path / "gaps.csv"
    path.write_text("\n".join(f"{line},{gap}" for line, gap in zip(lines, gaps)) + "\n")
    data = rotor_edge.read_measurement(path, ROTOR)
    assert data.probes == ("15X", "15Y", "16X", "16Y") and data.gaps_v.shape == (len(data), 4)
    assert np.array_equal(data.gaps_v[:3, 2], [-9.5, np.nan, -9.25], equal_nan=True)
    assert np.isnan(data.gaps_v[:, [0, 1, 3]]).all() and "-9.5 to -9.25" in data._repr_html_()
    assert rotor_edge.read_measurement(RUNUP).gaps_v is None
    assert rotor_edge.compare(ROTOR, data).json == rotor_edge.compare(ROTOR, path).json
    columns = {**data.columns, "16X_gap_v": np.full(len(data), 9.5)}
    with pytest.raises(rotor_edge.Error, match="9.5 is no gap voltage, expected -30 to 0 V"):
        rotor_edge.compare(ROTOR, columns)


def test_a_rotor_is_its_text(tmp_path):
    rotor = rotor_edge.read_rotor(ROTOR)
    rotor.write(tmp_path / "rotor.toml")
    assert rotor_edge.Rotor.parse(rotor.text) == rotor == rotor_edge.read_rotor(tmp_path / "rotor.toml")
    assert rotor.name == "turbine" and rotor.drawing["disk"][2]["name"] == "disk 3"
    assert rotor_edge.check(rotor).json == rotor_edge.check(ROTOR).json
    assert "turbine" in rotor._repr_html_()


def test_a_command_refuses_in_the_words_of_the_program(refused, tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text(RUNUP.read_text().replace("0.12716", "much"))
    for words, call in [
        (["compare", ROTOR, broken], lambda: rotor_edge.compare(ROTOR, broken)),
        (["check", tmp_path / "none.toml"], lambda: rotor_edge.check(tmp_path / "none.toml")),
        (["compare", RUNUP, RUNUP], lambda: rotor_edge.compare(RUNUP, RUNUP)),
        (["track", ROTOR, RUNUP, "--growth", "0.5"], lambda: rotor_edge.track(ROTOR, RUNUP, growth=0.5)),
        (
            ["add", ROTOR, "gremlin", "--data", RUNUP, "-o", tmp_path / "x"],
            lambda: rotor_edge.add(ROTOR, "gremlin", RUNUP),
        ),
        (
            ["improve", ROTOR, RUNUP, "-o", tmp_path / "none" / "x"],
            lambda: rotor_edge.improve(ROTOR, RUNUP, output=tmp_path / "none" / "x"),
        ),
    ]:
        with pytest.raises(rotor_edge.Error) as error:
            call()
        assert str(error.value) == refused(*words)


def test_what_is_read_is_not_overwritten(tmp_path):
    rotor = tmp_path / "rotor.toml"
    rotor.write_bytes(ROTOR.read_bytes())
    with pytest.raises(rotor_edge.Error, match="is read and would be overwritten"):
        rotor_edge.improve(rotor, RUNUP, output=rotor)
    assert rotor.read_bytes() == ROTOR.read_bytes()


def test_columns_in_memory_are_refused_by_their_names_alone():
    data = rotor_edge.read_measurement(RUNUP)
    columns = {name: column for name, column in data.columns.items() if name != "16Y_sin_um"}
    with pytest.raises(rotor_edge.Error, match="^measured.csv: header: the column 16Y_sin_um of rotor"):
        rotor_edge.compare(ROTOR, columns)
    with pytest.raises(rotor_edge.Error, match="^column 16Y_sin_um: 50 values, expected 51 as in column run"):
        rotor_edge.compare(ROTOR, {**columns, "16Y_sin_um": data["16Y_sin_um"][1:]})
    with pytest.raises(TypeError, match="int has no named columns|expected a path"):
        rotor_edge.compare(ROTOR, object())
    with pytest.raises(rotor_edge.Error, match="^rotor.toml: line 1"):
        rotor_edge.Rotor.parse("= nothing")


def test_words_that_make_no_sense_are_refused_in_one_line():
    with pytest.raises(rotor_edge.Error) as error:
        rotor_edge.track(ROTOR, RUNUP, method="guess")
    assert "guess" in str(error.value) and "adaptive" in str(error.value) and "\n" not in str(error.value)
