"""What is handed out: the example in the README, the notebook, the wheel, the source distribution."""

import json
import os
import re
import shutil
import tarfile
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT, TURBINE

DIST = os.environ.get("ROTOR_EDGE_DIST")


def test_the_example_runs(tmp_path, monkeypatch, capsys):
    readme = (ROOT / "python" / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    shutil.copy(TURBINE / "rotor.toml", tmp_path / "rotor.toml")
    shutil.copy(TURBINE / "runup-day126.csv", tmp_path / "measured.csv")
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out.endswith("adequate ['seal']\n")
    assert (tmp_path / "better.toml").exists()


def test_the_notebook_tells_its_story(monkeypatch):
    """Its cells, one after the other, where it lies; a notebook without outputs is all code."""
    cells = json.loads((ROOT / "python" / "story.ipynb").read_text(encoding="utf-8"))["cells"]
    assert not any(cell.get("outputs") for cell in cells)
    monkeypatch.chdir(ROOT / "python")
    told = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "story.ipynb", "exec"), told)
    assert (told["compared"].verdict, told["diagnosis"].verdict, told["better"].verdict) == (
        "misses",
        "missing",
        "adequate",
    )
    assert (told["best"].effect, told["best"].at, told["followed"].flags[0].since_d) == ("seal", "disk 3", 125)
    assert "<td>seal</td>" in told["better"]._repr_html_()


@pytest.mark.whole
@pytest.mark.skipif(DIST is None, reason="python/test builds them")
def test_wheel_and_source_hold_what_they_need():
    (wheel,), (source,) = Path(DIST).glob("*.whl"), Path(DIST).glob("*.tar.gz")
    assert re.search(r"-cp310-abi3-", wheel.name)
    ours = {str(p.relative_to(ROOT / "python")) for p in (ROOT / "python" / "rotor_edge").rglob("*") if p.is_file()}
    ours = {name for name in ours if not name.endswith((".so", ".pyc"))}
    with zipfile.ZipFile(wheel) as held:
        names = set(held.namelist())
    assert ours <= names and "rotor_edge/_native.abi3.so" in names
    assert not [name for name in names if "test" in name]
    with tarfile.open(source) as held:
        names = {name.partition("/")[2] for name in held.getnames()}
    crates = {f"{crate}/Cargo.toml" for crate in ("core", "desktop", "host-sim", "python")}
    assert ours | crates | {"Cargo.toml", "Cargo.lock", "pyproject.toml", "host-sim/sample/turbine/record.csv"} <= names
