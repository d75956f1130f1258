"""Reference answers of ROSS 2.3.0 for `rotor-edge simulate`: what the probes of five machines with an effect show, without noise.

usage: python make_simulate_reference.py OUT

Writes OUT/<machine>.json for each of MACHINES. Every segment of the drawing is cut into FINER before it is meshed as
make_ross_reference.py does, so that what is left of the mesh is far below 0.1 %. Conventions and how they were verified are there.

rotor       the drawing, from this folder
with, set   the effect as `rotor-edge simulate` states it
unbalance   of each plane in every run, kg m and degrees
weight      that the run "trial" has beside it, in a plane
runs        `base` and `trial`, with cos_m and sin_m of every probe at every speed

How ROSS has the effects: a seal and a magnetic pull are a BearingElement at the disk (k, +-q, c and a negative k), a mass is a
DiskElement without inertias, the unbalance of a disk is one more plane, the gain of a probe multiplies what is read there.
"""
import cmath, copy, json, math, sys, tomllib
from pathlib import Path

import numpy as np
import ross as rs

from make_ross_reference import build, node, response, verify

FINER = 6
HERE = Path(__file__).parent
ANGLES = (40.0, -115.0, 170.0, 75.0)  # of the unbalance in the planes, degrees
TRIAL_DEG = 70.0  # of the trial weight in the first plane, as large as the unbalance there

# machine: drawing, effect, number of its disk or probe, parameters, unbalance kg m, speeds rpm
MACHINES = {
    "turbine": ("rotors/turbine.toml", "seal", 2, dict(k=2e7, q=6e6, c=9e3), 2.5e-4, (600.0, 12000.0)),
    "kit": ("rotors/kit.toml", "disk_mass", 0, dict(kg=0.11), 7e-6, (300.0, 6000.0)),
    "compressor": ("rotors/compressor.toml", "unbalance_plane", 2, dict(u=(1.5e-4, 25.0)), 2e-4, (600.0, 12000.0)),
    "overhung": ("rotors/overhung.toml", "probe_calibration", 1, dict(gain=0.8, phase=0.35), 2e-4, (750.0, 15000.0)),
    "coupled_train": ("check/coupled_train.toml", "magnetic_pull", 0, dict(k=-3e6), 3e-4, (500.0, 8000.0)),
}


def finer(t):
    """the drawing with every segment in FINER pieces"""
    t = copy.deepcopy(t)
    t["shaft"] = [dict(g, length_m=g["length_m"] / FINER) for g in t["shaft"] for _ in range(FINER)]
    return t


def with_effect(t, effect, number, parameters):
    """the drawing with the effect in it, the planes' further unbalance, and the factor on each probe"""
    further, gains = [], [1.0] * len(t["probe"])
    at = t["disk"][number]["position_m"] if effect != "probe_calibration" else None
    if effect in ("seal", "magnetic_pull"):
        k, q, c = (parameters.get(name, 0.0) for name in "kqc")
        t["bearing"].append(dict(position_m=at, stiffness_n_m=dict(xx=k, yy=k, xy=q, yx=-q), damping_n_s_m=dict(xx=c, yy=c)))
    elif effect == "disk_mass":
        t["disk"].append(dict(position_m=at, mass_kg=parameters["kg"], diametral_inertia_kg_m2=0.0, polar_inertia_kg_m2=0.0))
    elif effect == "unbalance_plane":
        t["plane"].append(dict(name="", position_m=at))
        further.append(parameters["u"])
    else:
        gains[number] = cmath.rect(parameters["gain"], parameters["phase"])
    return further, gains


def reference(name):
    path, effect, number, parameters, size, (slowest, fastest) = MACHINES[name]
    drawn = tomllib.loads((HERE / path).read_text())
    t = finer(drawn)
    further, gains = with_effect(t, effect, number, parameters)
    nodes, rotor = build(t)
    rpm = np.linspace(slowest, fastest, 20).tolist()
    own = [(size, angle) for _, angle in zip(drawn["plane"], ANGLES)]
    trial = cmath.rect(size, math.radians(own[0][1])) + cmath.rect(size, math.radians(TRIAL_DEG))
    loaded = [(abs(trial), math.degrees(cmath.phase(trial))), *own[1:]]
    runs = {}
    for run, unbalance in (("base", own), ("trial", loaded)):
        shown = [y * gain for y, gain in zip(response(t, nodes, rotor, rpm, unbalance + further), gains)]
        runs[run] = [dict(name=p["name"], cos_m=y.real.tolist(), sin_m=(-y.imag).tolist()) for p, y in zip(t["probe"], shown)]
    place = drawn["probe" if effect == "probe_calibration" else "disk"][number]["name"]
    return {
        "made_by": f"ROSS {rs.__version__}, numpy {np.__version__}",
        "rotor": path,
        "with": f"{effect}@{place}",
        "set": parameters,
        "unbalance": [dict(plane=p["name"], kg_m=u, angle_deg=a) for p, (u, a) in zip(drawn["plane"], own)],
        "weight": dict(plane=drawn["plane"][0]["name"], kg_m=size, angle_deg=TRIAL_DEG),
        "speed_rpm": rpm,
        "runs": runs,
    }


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    verify()
    out = Path(sys.argv[1])
    out.mkdir(exist_ok=True)
    for name in MACHINES:
        text = json.dumps(reference(name))
        (out / f"{name}.json").write_text(text + "\n")
        print(name, len(text), "bytes")
