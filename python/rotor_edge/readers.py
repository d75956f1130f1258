"""Readings and drawings out of what other systems write: raw samples, exports, rotors of ROSS."""

import json
import os
from typing import Any, Literal, Mapping, Sequence

import numpy as np

from .answers import Extraction, Import, ImportedRotor
from .desk import desk
from .inputs import DataLike, FilePath, RotorLike, read_measurement, read_rotor


def extract(
    waveforms: FilePath | Mapping[str, Any] | Sequence[FilePath],
    *,
    rate_hz: float | None = None,
    rotor: RotorLike | None = None,
    channels: Mapping[str, str | int] | None = None,
    unit: Literal["V", "mV", "um", "mm/s", "m/s2", "g"] = "V",
    mv_um: float | Mapping[str, float] | None = None,
    full_scale: float | None = None,
    ac: bool = False,
    keyphasor: str | int | None = None,
    threshold: float | None = None,
    hysteresis: float | None = None,
    falling: bool = False,
    pulses: int = 1,
    revolutions: int | None = None,
    largest_drift: float | None = None,
    slowest_rpm: float | None = None,
    bin_rpm: float | None = None,
    compensate_rate: bool = False,
    two_x: bool = False,
    run: str | Sequence[str] | None = None,
    output: FilePath | None = None,
) -> Extraction:
    """1x readings from raw samples of probes and keyphasor, by the controller's own extraction; they are the answer's
    ``measurement``.

    waveforms: a .csv, .wav, .npy, .npz or .mat file, or an array of samples by channel; several files are runs, one after
    another. rate_hz: samples a second, where no file says it. rotor: whose probes are meant. channels: of probes that are called
    otherwise. unit: of the probes' channels; accelerations and velocities are integrated at 1x. mv_um: sensitivity, mV per µm that
    the shaft comes nearer, one for all or by probe: 7.87 (200 mV/mil) of an eddy-current probe. full_scale: what 32768 counts stand
    for. ac: there is no gap voltage. threshold, hysteresis, falling: where in the keyphasor's channel the mark is, in its unit.
    pulses: in a turn, of a tacho. revolutions, largest_drift (relative): of a window. slowest_rpm: without a mark for a turn at this
    speed the keyphasor is missing. bin_rpm: one reading for the windows within so many rpm; compensate_rate: as if each of these
    speeds had been held. two_x: the vectors at twice the running speed too, ``measurement_2x``. run: its name, or those of several.
    output: where to write the readings as well."""
    by_probe = mv_um if isinstance(mv_um, Mapping) else None
    options: dict[str, Any] = {
        "rate_hz": rate_hz,
        "rotor": rotor,
        "channel": [f"{probe}={channel}" for probe, channel in (channels or {}).items()],
        "unit": unit,
        "mv_um": mv_um if by_probe is None else [f"{probe}={one}" for probe, one in by_probe.items()],
        "full_scale": full_scale,
        "ac": ac,
        "keyphasor": keyphasor,
        "threshold": threshold,
        "hysteresis": hysteresis,
        "falling": falling,
        "pulses": pulses,
        "revolutions": revolutions,
        "largest_drift": largest_drift,
        "slowest_rpm": slowest_rpm,
        "bin_rpm": bin_rpm,
        "compensate_rate": compensate_rate,
        "run": run,
    }
    with desk() as place:
        files: list[Any]
        if isinstance(waveforms, Mapping):
            files = [place / "waveforms.npz"]
            arrays: dict[str, Any] = {name: np.asarray(channel) for name, channel in waveforms.items()}
            np.savez(files[0], **arrays)
        elif isinstance(waveforms, (str, os.PathLike)):
            files = [waveforms]
        else:
            files = list(waveforms)
        path = place / "measured.csv" if output is None else os.fspath(output)
        second = place / "two_x.csv" if two_x else None
        answer = place.ask("extract", *files, output=path, two_x=second, **options)
        at_2x = None if second is None else read_measurement(second)
        return Extraction.of(json.loads(answer), json=answer, measurement=read_measurement(path), measurement_2x=at_2x)


def import_(
    exports: DataLike | Sequence[DataLike],
    *,
    rotor: RotorLike | None = None,
    mapping: FilePath | None = None,
    phase: Literal["lag", "lead"] | None = None,
    amplitude: Literal["pp", "zero_peak", "rms"] | None = None,
    unit: Literal["um", "mil", "mm", "m", "inch", "mv", "v"] | None = None,
    angle: Literal["degrees", "radians"] | None = None,
    sensitivity_mv_um: float | None = None,
    dates: Literal["day-first", "month-first"] | None = None,
    decimal: Literal["point", "comma"] | None = None,
    columns: Mapping[str, str] | None = None,
    sheet: str | None = None,
    machine: str | None = None,
    speed_rpm: float | None = None,
    runs_from_files: bool = False,
    slow_roll: FilePath | int | None = None,
    phase_shift: Mapping[str, float] | None = None,
    keep_stale: bool = False,
    keep_outliers: bool = False,
    dry_run: bool = False,
    write_mapping: FilePath | None = None,
    output: FilePath | None = None,
) -> Import:
    """Readings from exports of another system (``import``); they are the answer's ``measurement``.

    exports: text with separators, xlsx, xls or ods, or columns as they were exported, in a data frame; several follow one another,
    or hold a probe each. rotor: whose probes are taken, and their names. mapping: what an import before took. phase, amplitude,
    unit, angle, dates, decimal: what the export does not say itself: which way phases count, how and in which unit amplitudes are
    measured, the unit of phases, what comes first in 03/04/2024, what stands before decimals. sensitivity_mv_um: of the probes,
    mV/µm, where amplitudes are voltages. columns: what a column is, by its name or number, as ``"16X:amplitude:um pp"``,
    ``"speed:rpm"`` or ``"left"``. sheet: of a workbook. machine: where a file holds several. speed_rpm: where no column has it, rpm.
    runs_from_files: each file is a run. slow_roll: a row, a run or a file to take off every reading. phase_shift: degrees by which
    phase lags grew when the reference was moved, by date. keep_stale, keep_outliers: these are measurements. dry_run: nothing is
    written. write_mapping: where to write what was taken for what. output: where to write the readings as well."""
    options: dict[str, Any] = {
        "rotor": rotor,
        "mapping": mapping,
        "unit": unit,
        "angle": angle,
        "sensitivity_mv_um": sensitivity_mv_um,
        "dates": dates,
        "decimal": decimal,
        "column": [f"{name}={target}" for name, target in (columns or {}).items()],
        "sheet": sheet,
        "machine": machine,
        "speed_rpm": speed_rpm,
        "runs_from_files": runs_from_files,
        "slow_roll": slow_roll,
        "phase_shift": [f"{date}={degrees}" for date, degrees in (phase_shift or {}).items()],
        "keep_stale": keep_stale,
        "keep_outliers": keep_outliers,
        "dry_run": dry_run,
        "write_mapping": write_mapping,
    }
    for convention in (phase, amplitude):
        if convention is not None:
            options[convention] = True
    with desk() as place:
        files = exports if isinstance(exports, (list, tuple)) else [exports]
        path = place / "imported.csv" if output is None else os.fspath(output)
        answer = place.ask("import", *files, output=path, **options)
        readings = None if dry_run else read_measurement(path)
        return Import.of(json.loads(answer), json=answer, measurement=readings)


def import_rotor(rotor: Any, *, output: FilePath | None = None) -> ImportedRotor:
    """A drawing from a rotor of ROSS: a file that it saved, or a ``ross.Rotor``, which is then saved for the moment."""
    with desk() as place:
        saved = rotor
        if not isinstance(rotor, (str, os.PathLike)):
            saved = place / "ross.toml"
            rotor.save(saved)
        path = place / "rotor.toml" if output is None else os.fspath(output)
        answer = place.ask("import-rotor", saved, output=path)
        return ImportedRotor.of(json.loads(answer), json=answer, rotor=read_rotor(path))
