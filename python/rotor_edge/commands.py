"""The commands, a function each: the same words, the same answer and the same refusals as on the command line.

Where a rotor or data are expected, a file's path or what is in memory serves. Work is done with the interpreter released; it can be
interrupted by Ctrl-C at any time, and then ends in the background: ``track``, ``improve`` and ``startup``, which tell their
``progress``, at their next step, the others when they are done."""

import json
import os
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, Mapping, Sequence

from .answers import (
    Addition,
    Balance,
    Check,
    Comparison,
    Diagnosis,
    Estimates,
    Forecast,
    Identification,
    Improvement,
    Plan,
    Startup,
    Track,
    TrialBalance,
)
from .desk import Progress, desk
from .inputs import DataLike, FilePath, RotorLike, read_rotor
from .record import R

Range = tuple[float, float]
"""From and to, both included."""
ByPlane = float | Mapping[str, float]
"""One for all planes, or of each by name."""
Holes = Sequence[int] | Mapping[str, Sequence[int]]
"""Numbers of holes, of all planes or of each by name."""


def _range(bounds: Range | None) -> str | None:
    return None if bounds is None else f"{bounds[0]}..{bounds[1]}"


def _answer(kind: type[R], command: str, *inputs: Any, **options: Any) -> R:
    with desk() as place:
        answer = place.ask(command, *inputs, **options)
    return kind.of(json.loads(answer), json=answer)


def _model(kind: type[R], command: str, *inputs: Any, output: FilePath | None, **options: Any) -> R:
    """A command that writes a rotor: to be kept, or for the answer alone."""
    with desk() as place:
        path = place / "better.toml" if output is None else os.fspath(output)
        answer = place.ask(command, *inputs, output=path, **options)
        values = json.loads(answer)
        return kind.of(values, json=answer, rotor=read_rotor(path) if values.get("written", True) else None)


def check(rotor: RotorLike, *, rpm: Range | float | None = None, own_unbalance: bool = False) -> Check:
    """What a machine's drawing alone says: loads, critical speeds, modes, unbalance response, doubtful numbers.

    rpm: running speed or range, rpm; separation margins refer to it. own_unbalance: respond to the unbalance that the planes of
    the rotor state, instead of twice the permitted one."""
    speeds = rpm if rpm is None or isinstance(rpm, (int, float)) else _range(rpm)
    return _answer(Check, "check", rotor, rpm=speeds, own_unbalance=own_unbalance)


def plan(
    rotor: RotorLike,
    *,
    speeds: tuple[float, float, int],
    runs: FilePath | None = None,
    unbalance: float | Mapping[str, tuple[float, float]] | None = None,
) -> Plan:
    """What measurements could show before they are made: the smallest effects found, their rivals, the accuracy of the unbalance,
    and which further measurement helps most.

    speeds: from and to, rpm, and the number of readings of every run. runs: a table of trial weights (run, plane,
    magnitude_g_mm, angle_deg) instead of the rotor's runs. unbalance: g·mm in every plane, or (g·mm, degrees) by plane."""
    low, high, count = speeds
    words: float | str | None
    if isinstance(unbalance, Mapping):
        words = ",".join(f"{name}={size}@{angle}" for name, (size, angle) in unbalance.items())
    else:
        words = unbalance
    return _answer(Plan, "plan", rotor, speeds=f"{low}..{high}:{count}", runs=runs, unbalance=words)


def compare(rotor: RotorLike, data: DataLike, *, slow_roll: DataLike | None = None) -> Comparison:
    """Holds a model against measurements: where it misses, and whether that is noise or physics.

    slow_roll: a run of the data, or data of its own, to take off every reading."""
    return _answer(Comparison, "compare", rotor, data, slow_roll=slow_roll)


def diagnose(rotor: RotorLike, data: DataLike, *, slow_roll: DataLike | None = None) -> Diagnosis:
    """Says which physical effect is missing in a model, or which measurement would tell.

    slow_roll: a run of the data, or data of its own, to take off every reading."""
    return _answer(Diagnosis, "diagnose", rotor, data, slow_roll=slow_roll)


def add(
    rotor: RotorLike,
    effect: str,
    data: DataLike,
    *,
    output: FilePath | None = None,
    slow_roll: DataLike | None = None,
) -> Addition:
    """Fits one effect together with bearings and planes; the better model is the answer's ``rotor``.

    effect: its name and where it sits, as in ``seal@disk 3``. output: where to write the model as well."""
    return _model(Addition, "add", rotor, effect, output=output, data=data, slow_roll=slow_roll)


def improve(
    rotor: RotorLike,
    data: DataLike,
    *,
    output: FilePath | None = None,
    without: Sequence[str] = (),
    even_so: bool = False,
    slow_roll: DataLike | None = None,
    progress: Progress | None = None,
) -> Improvement:
    """Diagnoses and adds until the model is adequate; the better model is the answer's ``rotor``.

    output: where to write the model as well. without: names of probes that cannot be trusted; the model has them with
    ``used = false``. even_so: give the model as well where what is missing is unknown; otherwise ``rotor`` is then None.
    progress: called with the number of effects added, and None."""
    return _model(
        Improvement,
        "improve",
        rotor,
        data,
        output=output,
        without=without,
        even_so=even_so,
        slow_roll=slow_roll,
        progress=progress,
    )


def identify(
    rotor: RotorLike,
    record: DataLike,
    *,
    days: Range = (0, 2),
    runup: DataLike | None = None,
    seed: int = 1,
    output: FilePath | None = None,
    slow_roll: DataLike | None = None,
) -> Identification:
    """Phase I: bearings and unbalance of a machine's first days; the identified rotor is the answer's ``rotor``.

    days: those that are used; rows where the record has no days. runup: one in the same state of the machine."""
    options = {"days": _range(days), "runup": runup, "seed": seed, "slow_roll": slow_roll}
    return _model(Identification, "identify", rotor, record, output=output, **options)


def estimate(
    rotor: RotorLike,
    data: DataLike,
    *,
    base: str | None = None,
    leave_one_out: bool = False,
    trust_weights: bool = False,
    slow_roll: DataLike | None = None,
) -> Estimates:
    """The unbalance of each run beyond a base run's, from runs with stated weights (``[[run]]`` in the rotor's file).

    base: the run that the others are compared with; if None the one without weights. leave_one_out: a run's own stated weights
    are never used for it. trust_weights: all stated weights are true. slow_roll: a run of the data, or data of its own, to take
    off every reading."""
    options = {
        "base": base,
        "leave_one_out": leave_one_out,
        "trust_weights": trust_weights,
        "slow_roll": slow_roll,
    }
    return _answer(Estimates, "estimate", rotor, data, **options)


def track(
    rotor: RotorLike,
    record: DataLike,
    *,
    runup: DataLike | None = None,
    later_runup: Sequence[DataLike] = (),
    method: Literal["fixed", "adaptive", "bayes", "joint"] = "adaptive",
    begin: str | datetime | None = None,
    identified: bool = False,
    paper: bool = False,
    proposals: int | None = None,
    as_known_then: int | None = None,
    outage: Sequence[tuple[float | str, float | str]] = (),
    seed: int = 1,
    rise: float | None = None,
    ratio_limit: float | None = None,
    ratio_floor: float | None = None,
    persistence: int | None = None,
    growth: float | None = None,
    slow_roll: DataLike | None = None,
    progress: Progress | None = None,
) -> Track:
    """Follows the unbalance of a long record while bearings change.

    runup: one in the state of the first days. later_runup: ones after an event, for joint. begin: when day 0 was, then days have
    dates. identified: no phase I. paper and proposals: of bayes. as_known_then: of joint, estimates every
    Nth reading again, using only data up to its day. outage: of joint, first and last day or date of each time in which the machine stood;
    bearings and unbalance are new after it. rise, ratio_limit, ratio_floor, persistence: when a reading is suspicious (relative
    to the level, of the features) and when that is a flag (readings in a row). growth: largest of a plane relative to the day
    before. progress: called with the steps that are done and about how many there are:
    readings, of joint rounds of learning; fixed tells none."""
    options: dict[str, Any] = {
        "runup": runup,
        "later_runup": list(later_runup),
        "method": method,
        "begin": begin.isoformat() if isinstance(begin, datetime) else begin,
        "identified": identified,
        "paper": paper,
        "proposals": proposals,
        "as_known_then": as_known_then,
        "outage": [f"{first}..{last}" for first, last in outage],
        "seed": seed,
        "rise": rise,
        "ratio_limit": ratio_limit,
        "ratio_floor": ratio_floor,
        "persistence": persistence,
        "growth": growth,
        "slow_roll": slow_roll,
    }
    with desk() as place:
        table = place / "estimates.csv"
        answer = place.ask("track", rotor, record, csv=table, progress=progress, **options)
        return Track.of(json.loads(answer), json=answer, csv=Path(table).read_text(encoding="utf-8"))


def forecast(
    track: FilePath | Track,
    *,
    model: Literal["state", "arima", "naive"] | None = None,
    order: tuple[int, int, int] | None = None,
    horizons: Sequence[int] | None = None,
    first: int | None = None,
    days: int | None = None,
    limit: float | None = None,
    grade: float | None = None,
    rotor: RotorLike | None = None,
    rpm: float | None = None,
    seed: int = 1,
) -> Forecast:
    """Where the unbalance of a track is going, beside naive forecasts.

    model: if None, state where the track is one of joint, else arima. order: p, d, q of arima. horizons: days ahead at which
    forecasts of the past are scored. first: days after which the first of them is made. days: that are forecast. limit: static
    unbalance at which something has to be done, g·mm; or grade: the same as a balance quality grade, mm/s, with rotor and rpm."""
    options = {
        "model": model,
        "order": order and ",".join(map(str, order)),
        "horizons": horizons and ",".join(map(str, horizons)),
        "first": first,
        "days": days,
        "limit": limit,
        "grade": grade,
        "rotor": rotor,
        "rpm": rpm,
        "seed": seed,
    }
    return _answer(Forecast, "forecast", track, **options)


def startup(
    rotor: RotorLike,
    data: DataLike,
    *,
    clearance_um: float | None = None,
    mass_kg: float | None = None,
    speeds_rpm: Sequence[float] | None = None,
    range_rpm: Range | None = None,
    improved: bool = True,
    output: FilePath | None = None,
    slow_roll: DataLike | None = None,
    progress: Progress | None = None,
) -> Startup:
    """A single-disk rotor from its start-up: the simple two-degree model, where it fails, and which effects mend it.

    clearance_um: of the bearings, µm, that errors are given in percent of; 127 (5 mil) if None. mass_kg: of the two-degree model,
    kg, the disk's if None. speeds_rpm: at which errors are given. range_rpm: in which they are summed up. improved: the improved
    model is the answer's ``rotor``, and a start-up that no rotor model can be fitted to is refused; if False there is none, and the
    two-degree model alone is an answer. output: where to write the improved model as well. slow_roll: a run of the data, or data
    of its own, to take off every reading. progress: called with the number of effects added, and None."""
    options: dict[str, Any] = {
        "clearance_um": clearance_um,
        "mass_kg": mass_kg,
        "speeds": speeds_rpm and ",".join(map(str, speeds_rpm)),
        "range": _range(range_rpm),
        "slow_roll": slow_roll,
        "progress": progress,
    }
    if improved or output is not None:
        return _model(Startup, "startup", rotor, data, output=output, **options)
    with desk() as place:
        answer = place.ask("startup", rotor, data, **options)
    return Startup.of(json.loads(answer), json=answer, rotor=None)


def balance(
    rotor: RotorLike,
    data: DataLike,
    *,
    planes: Sequence[str] = (),
    radii_mm: Sequence[float] = (),
    step_g: float | None = None,
    min_max: bool = False,
    largest_g_mm: ByPlane | None = None,
    holes: int | None = None,
    taken: Holes = (),
    split: int | None = None,
    first_hole_deg: float | None = None,
    range_rpm: Range | None = None,
    same_speed: float | None = None,
    interpolate: bool = False,
    service_rpm: float | None = None,
    against_rotation: bool = False,
    slow_roll: DataLike | None = None,
) -> Balance:
    """Correction weights, from the identified model and from trial runs alone.

    planes: to put weights into, all if none. radii_mm: at which they can sit, mm; step_g: they come in multiples of this, g.
    min_max: the largest vibration least. largest_g_mm: of a plane, g·mm, one for all or by plane. holes: so many around each plane,
    hole 1 at first_hole_deg, a weight in at most ``split`` of them and in none of ``taken``, of all planes or by plane. range_rpm:
    speeds at which vibration counts, rpm. same_speed: speeds of runs that differ by no more are one, relative. interpolate: runs at
    unlike speeds. service_rpm: speed of the balance grade, rpm. against_rotation: so angles count."""
    options = {
        "planes": list(planes),
        **_wanted(radii_mm, step_g, min_max, largest_g_mm, holes, taken, split, first_hole_deg),
        "range": _range(range_rpm),
        "same_speed": same_speed,
        "interpolate": interpolate,
        "service_rpm": service_rpm,
        "against_rotation": against_rotation,
        "slow_roll": slow_roll,
    }
    return _answer(Balance, "balance", rotor, data, **options)


def balance_by_trials(
    data: DataLike,
    *,
    weights: DataLike | None = None,
    coefficients: FilePath | None = None,
    write_coefficients: FilePath | None = None,
    onto: str | None = None,
    planes: Sequence[str] = (),
    radii_mm: Sequence[float] = (),
    step_g: float | None = None,
    min_max: bool = False,
    largest_g_mm: ByPlane | None = None,
    holes: int | None = None,
    taken: Holes = (),
    split: int | None = None,
    first_hole_deg: float | None = None,
    range_rpm: Range | None = None,
    same_speed: float | None = None,
    interpolate: bool = False,
    noise_relative: float | None = None,
    noise_floor: float | None = None,
    against_rotation: bool = False,
) -> TrialBalance:
    """Correction weights of a machine that has no file (``balance --trial-only``), from runs with trial weights.

    weights: ``run``, ``plane``, ``magnitude_g_mm`` or in another unit, ``angle_deg`` of each. coefficients: a file of influence
    coefficients that write_coefficients kept. onto: a run to whose weights these are added. noise_relative, noise_floor: standard deviation of a
    component, relative and in the data's unit. The rest as for ``balance``."""
    options = {
        "trial_only": data,
        "weights": weights,
        "coefficients": coefficients,
        "write_coefficients": write_coefficients,
        "onto": onto,
        "planes": list(planes),
        **_wanted(radii_mm, step_g, min_max, largest_g_mm, holes, taken, split, first_hole_deg),
        "range": _range(range_rpm),
        "same_speed": same_speed,
        "interpolate": interpolate,
        "noise_relative": noise_relative,
        "noise_floor": noise_floor,
        "against_rotation": against_rotation,
    }
    return _answer(TrialBalance, "balance", **options)


def _wanted(
    radii_mm: Sequence[float],
    step_g: float | None,
    min_max: bool,
    largest_g_mm: ByPlane | None,
    holes: int | None,
    taken: Holes,
    split: int | None,
    first_hole_deg: float | None,
) -> dict[str, Any]:
    """Options of both ways to balance."""
    largest: Any = largest_g_mm
    if isinstance(largest_g_mm, Mapping):
        largest = [f"{plane}={most}" for plane, most in largest_g_mm.items()]
    if isinstance(taken, Mapping):
        full = [f"{plane}={hole}" for plane, of_plane in taken.items() for hole in of_plane]
    else:
        full = [str(hole) for hole in taken]
    return {
        "radii_mm": list(radii_mm),
        "step_g": step_g,
        "min_max": min_max,
        "largest_g_mm": largest,
        "holes": holes,
        "taken": full,
        "split": split,
        "first_hole_deg": first_hole_deg,
    }
