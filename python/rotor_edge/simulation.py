"""Readings that the probes of a machine would give."""

import cmath
import json
import math
import os
from typing import Any, Mapping, Sequence

from .answers import Simulation
from .desk import desk
from .inputs import FilePath, RotorLike, read_measurement

Parameter = float | complex | Sequence[complex]
"""A number, a phasor, or a phasor for each probe or plane; SI units."""
Unbalance = Mapping[str, complex]
"""By the name of the plane, g·mm; its angle is from the keyphasor mark, with the rotation."""


def simulate(
    rotor: RotorLike,
    *,
    effects: Mapping[str, Mapping[str, Parameter]] | None = None,
    speeds_rpm: Sequence[float] | None = None,
    weights: Mapping[str, Unbalance] | None = None,
    unbalance_g_mm: Unbalance | None = None,
    noise: tuple[float, float] | None = None,
    seed: int = 1,
    drawing_error: int | None = None,
    hide: int | None = None,
    truth: FilePath | None = None,
    write_rotor: FilePath | None = None,
    output: FilePath | None = None,
) -> Simulation:
    """What the probes of a machine would show, on full finite elements; the readings are the answer's ``measurement``.

    effects: that the machine has and its file does not, with their parameters, as in ``{"seal@disk 3": {"k": 2e7}}``. speeds_rpm: of
    every run. weights: of runs beside those of the rotor, by run and plane, g·mm. unbalance_g_mm: of planes, else as the rotor states it,
    else by the balance grade. noise: standard deviation of each component, a part of the amplitude and µm 0-pk. seed: of the noise and of
    angles. drawing_error: seed of a machine that differs from its drawing. hide: seed of an effect that the answer does not tell; truth:
    a file that does. write_rotor: where to write the rotor with the runs of weights. output: where to write the readings as well."""
    options: dict[str, Any] = {
        "speeds": None if speeds_rpm is None else ",".join(map(repr, map(float, speeds_rpm))),
        "weight": [f"{run}:{_placed(plane, u)}" for run, planes in (weights or {}).items() for plane, u in planes.items()],
        "unbalance": [_placed(plane, u) for plane, u in (unbalance_g_mm or {}).items()],
        "noise": noise and ",".join(map(str, noise)),
        "seed": seed,
        "drawing_error": drawing_error,
        "hide": hide,
        "truth": truth,
        "write_rotor": write_rotor,
    }
    stated: list[tuple[str, str]] = []
    for label, parameters in (effects or {}).items():
        stated.append(("with", label))
        stated += [("set", f"{name}={_value(value)}") for name, value in parameters.items()]
    with desk() as place:
        path = place / "measured.csv" if output is None else os.fspath(output)
        answer = place.ask("simulate", rotor, output=path, in_order=stated, **options)
        return Simulation.of(json.loads(answer), json=answer, measurement=read_measurement(path))


def _placed(plane: str, unbalance: complex) -> str:
    size, angle = cmath.polar(unbalance)
    return f"{plane}={size!r}@{math.degrees(angle)!r}"


def _value(value: Parameter) -> str:
    def pair(phasor: complex) -> list[float]:
        return [complex(phasor).real, complex(phasor).imag]

    if isinstance(value, Sequence):
        return json.dumps([pair(one) for one in value])
    return json.dumps(pair(value)) if isinstance(value, complex) else repr(float(value))
