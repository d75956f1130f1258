"""A train of two spans on four bearings, eight probes, six disks, by ROSS 2.3.0: python make_train.py OUT

OUT  folder that receives nothing/ and seal/, each with rotor.toml, measured.csv and truth.json

Elements on a mesh twice as fine as the drawing's, ROSS's unbalance response, noise as stated. The drawing's bearing coefficients
are guesses: each is off by a factor of which the logarithm has a standard deviation of 0.15.
"""
import json, sys
from pathlib import Path

import numpy as np
import ross as rs

import make_kits, make_ross_reference as reference
from make_check_reference import bearing, disk, machine, rounded, toml_text

RELATIVE, FLOOR_UM = 0.01, 0.05
SPEEDS = np.linspace(400.0, 3600.0, 51)
SEAL = dict(effect="seal", at="wheel 3", parameters=dict(k=3e7, q=5e7, c=1e5))


def train():
    shaft = [(0.4, 0.22, 0.0), (1.0, 0.34, 0.0), (1.0, 0.34, 0.0), (0.6, 0.25, 0.0), (0.5, 0.25, 0.0), (1.2, 0.42, 0.1), (1.2, 0.42, 0.1), (0.4, 0.25, 0.0)]
    disks = [disk(f"wheel {i + 1}", 0.7 + 0.4 * i, 500.0, 26.0, 50.0) for i in range(4)]
    disks += [disk("coupling", 3.0, 180.0, 3.0, 5.0), disk("winding", 4.7, 2600.0, 420.0, 300.0)]
    bearings = [bearing(name, z, (k, 1.6 * k, 0.2 * k, -0.5 * k), (1e-3 * k, 1.6e-3 * k, -1.5e-4 * k, -1.5e-4 * k))
                for name, z, k in (("1", 0.2, 4e8), ("2", 2.6, 5e8), ("3", 3.4, 7e8), ("4", 6.1, 6e8))]
    return machine(3600, shaft, disks, bearings, [0.7, 1.9, 3.9, 5.5])[1]


def case(folder, t, effects):
    random = np.random.default_rng(11)
    nodes, rotor = reference.build(dict(t, shaft=[dict(g, length_m=g["length_m"] / 2) for g in t["shaft"] for _ in (0, 1)]))
    where = {d["name"]: reference.node(nodes, d["position_m"]) for d in t["disk"]}
    seals = [rs.SealElement(n=where[e["at"]], kxx=p["k"], kyy=p["k"], kxy=p["q"], kyx=-p["q"], cxx=p["c"], cyy=p["c"])
             for e in effects for p in [e["parameters"]]]
    rotor = rs.Rotor(rotor.shaft_elements, rotor.disk_elements, rotor.bearing_elements + seals)
    unbalance = [(random.uniform(0.02, 0.05), random.uniform(-180, 180)) for _ in t["plane"]]
    Y = 1e6 * np.array(reference.response(t, nodes, rotor, SPEEDS, unbalance)).T
    Y = Y + (random.normal(size=Y.shape) + 1j * random.normal(size=Y.shape)) * (RELATIVE * abs(Y) + FLOOR_UM)
    guess = lambda m: {a: float(f"{v * np.exp(random.normal(0, 0.15)):.4g}") for a, v in m.items()}
    guesses = [dict(b, stiffness_n_m=guess(b["stiffness_n_m"]), damping_n_s_m=guess(b["damping_n_s_m"])) for b in t["bearing"]]
    t = dict(t, bearing=guesses, run=[dict(name="run-up")])
    folder.mkdir(parents=True, exist_ok=True)
    noise = f"\n\n[noise]\nrelative = {RELATIVE}\nfloor_um = {FLOOR_UM}\n\n[tolerance]\nexact = true\n"
    (folder / "rotor.toml").write_text(toml_text("four-bearing train", t).replace("schema = 1", "schema = 2").replace("\n\n", noise + "\n", 1))
    make_kits.write(folder / "measured.csv", t, SPEEDS, [Y], 4)
    (folder / "truth.json").write_text(json.dumps(rounded(dict(effects=effects, planes_kg_m_deg=unbalance)), indent=1) + "\n")
    print(folder.name, "median", np.median(abs(Y)), "um, largest", abs(Y).max())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    reference.verify()
    case(Path(sys.argv[1]) / "nothing", train(), [])
    case(Path(sys.argv[1]) / "seal", train(), [SEAL])
