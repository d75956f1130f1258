"""Exports of other systems, from files and from data frames, as the program reads them."""

import numpy as np
import pytest
import rotor_edge
from conftest import TURBINE
from test_answers import assert_whole

EXPORT = """Unit 2;;;;
Time;Speed [rpm];16X 1X Amp [um pp];16X 1X Phase [deg];16X Gap [V];load_mw
2024-03-01 06:00;10998,5;24,0;90;-9,5;101
2024-03-01 18:00;11001,5;20,0;180;-9,4;99
2024-03-02 06:00;11000,0;;;-9,6;98
"""
COLUMNS = {
    "Time": np.array(["2024-03-01T06:00", "2024-03-01T18:00", "2024-03-02T06:00"], dtype="datetime64[ns]"),
    "Speed [rpm]": [10998.5, 11001.5, 11000.0],
    "16X 1X Amp [um pp]": [24.0, 20.0, np.nan],
    "16X 1X Phase [deg]": [90.0, 180.0, np.nan],
    "16X Gap [V]": [-9.5, -9.4, -9.6],
    "load_mw": [101.0, 99.0, 98.0],
}


@pytest.fixture
def export(tmp_path):
    path = tmp_path / "export.csv"
    path.write_text(EXPORT)
    return path


def test_import(printed, export, tmp_path):
    ours, theirs, mapping = tmp_path / "ours.csv", tmp_path / "theirs.csv", tmp_path / "mapping.toml"
    answer = rotor_edge.import_(export, phase="lag", write_mapping=mapping, output=ours)
    assert answer.json.replace("ours.csv", "theirs.csv") == printed("import", export, "--lag", "-o", theirs)
    assert ours.read_bytes() == theirs.read_bytes()
    assert_whole(answer)
    assert not answer.left and answer.lost == 1
    readings = answer.measurement
    assert np.array_equal(readings["load_mw"], [101, 99, 98])
    # half of the peaks, the first a quarter of a turn behind the mark
    assert np.allclose(readings["16X_cos_um"], [0, -10, np.nan], atol=1e-12, equal_nan=True)
    assert np.allclose(readings["16X_sin_um"], [12, 0, np.nan], atol=1e-12, equal_nan=True)
    assert np.array_equal(readings.gaps_v, [[-9.5], [-9.4], [-9.6]]) and "-9.6 to -9.4" in readings._repr_html_()
    again = rotor_edge.import_(export, mapping=mapping)
    for name, column in readings.columns.items():
        assert np.array_equal(again.measurement[name], column, equal_nan=True)


def test_a_data_frame_is_an_export_and_its_moments_are_times(export):
    from_file, from_memory = (rotor_edge.import_(data, phase="lag") for data in (export, COLUMNS))
    assert from_file.start == from_memory.start and from_file.start.startswith("2024-03-01T06:00:00")
    for name, column in from_file.measurement.columns.items():
        assert np.array_equal(from_memory.measurement[name], column, equal_nan=True), name


def test_stated_conventions_become_command_options(printed, export, tmp_path):
    plain = tmp_path / "plain.csv"
    plain.write_text("n,16X amp,16X phase\n3000,1,0.5\n3100,2,0.25\n3200,3,0.125\n")
    stated = dict(phase="lead", amplitude="rms", unit="mil", angle="radians", runs_from_files=True)
    columns = {"n": "speed:rpm", "2": "16X:amplitude"}
    answer = rotor_edge.import_([plain, plain], columns=columns, dry_run=True, **stated)
    words = ["import", plain, plain, "--lead", "--rms", "--unit", "mil", "--angle", "radians", "--runs-from-files"]
    rules = [word for name, target in columns.items() for word in ("--column", f"{name}={target}")]
    assert answer.json == printed(*words, *rules, "--dry-run")
    assert_whole(answer)
    assert answer.measurement is None and answer.rows == 6


def test_missing_conventions_are_refused_with_message_of_command(refused, export, tmp_path):
    output = tmp_path / "out.csv"
    for options, words in [
        ({}, []),
        ({"phase": "lag", "rotor": TURBINE / "none.toml"}, ["--lag", "--rotor", TURBINE / "none.toml"]),
        ({"phase": "lag", "sensitivity_mv_um": -1.0}, ["--lag", "--sensitivity-mv-um=-1"]),
    ]:
        with pytest.raises(rotor_edge.Error) as error:
            rotor_edge.import_(export, output=output, **options)
        assert str(error.value) == refused("import", export, "-o", output, *words)
        assert not output.exists()
    output.write_text("mine")
    with pytest.raises(rotor_edge.Error, match="exists already"):
        rotor_edge.import_(export, phase="lag", output=output)
    assert output.read_text() == "mine"
