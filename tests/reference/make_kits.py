"""Single-disk kits with hidden effects, on ROSS 2.3.0 finite elements: python make_kits.py SAMPLE OUT

SAMPLE  folder of the sample's kit: rotor.toml, startup.csv
OUT     folder with sample/truth.json; receives one folder for each further kit (rotor.toml, startup.csv, truth.json), and in every folder
        clean.csv: what the true machine shows without noise

The shaft and disk are ROSS's; what is hidden is added to its dynamic stiffness here: bearings k (1 + 3/4 kappa a^2) (the describing function
of a cubic spring at the shaft's own amplitude a in that direction, by fixed point), a pedestal as mass, spring and damper in series under a
bearing, a bow of half a sine between the bearings as the force K d that the free shaft exerts when it is held straight. The rotor.toml states
bearings that are off by 20 % at random. Before anything is written the sample's own record must be explained by its truth with chi^2 of one.
"""
import copy, csv, json, math, sys, tomllib
from pathlib import Path

import numpy as np
import make_ross_reference as reference

SPEEDS = np.arange(500.0, 4201.0, 50.0)


class Shaft:
    """the shaft with its disk, without bearings"""
    def __init__(self, t):
        free = dict(t, bearing=[dict(b, stiffness_n_m=dict(xx=0.0, yy=0.0), damping_n_s_m=dict(xx=0.0, yy=0.0)) for b in t["bearing"]])
        self.nodes, rotor = reference.build(free)
        keep = [6 * i + j for i in range(len(self.nodes)) for j in reference.LATERAL]
        self.M, self.K, self.G = (np.array(A[np.ix_(keep, keep)]) for A in (rotor.M(1.0), rotor.K(1.0), rotor.G()))

    def at(self, position_m):
        return 4 * reference.node(self.nodes, position_m)

    def bow(self, bearings_m, size):
        """displacement and slope of half a sine, turning with the shaft"""
        a, span = bearings_m[0], bearings_m[1] - bearings_m[0]
        d = np.zeros(len(self.K), complex)
        for i, z in enumerate(self.nodes):
            shift, slope = math.sin(math.pi * (z - a) / span), math.pi / span * math.cos(math.pi * (z - a) / span)
            # LATERAL: the rotation about x is -dy/dz, the one about y is dx/dz
            d[4 * i:4 * i + 4] = size * np.array([shift, -1j * shift, 1j * slope, slope])
        return d


def effects(truth, name):
    return [e["parameters"] for e in truth["effects"] if e["effect"] == name]


def respond_um(t, truth, speeds, run):
    """phasors of all probes, one row a speed"""
    shaft = Shaft(t)
    bearings_m = [b["position_m"] for b in t["bearing"]]
    pedestals = {p["bearing"]: p for p in effects(truth, "pedestal")}
    kappa = sum(p["kappa"] for p in effects(truth, "nonlinear_stiffness"))
    held_straight = sum((shaft.K @ shaft.bow(bearings_m, complex(*p["m"])) for p in effects(truth, "shaft_bow")), np.zeros(len(shaft.K), complex))
    weights = [(t["plane"][0]["position_m"], *truth["own_unbalance_g_mm_deg"])]
    weights += [(a["position_m"], a["magnitude_g_mm"], a["angle_deg"]) for a in run.get("added_unbalance", [])]

    def support(b, W, amplitude):
        k = np.diag([truth["stiffness_n_m"][b][axis] * (1 + 0.75 * kappa * amplitude[axis] ** 2) for axis in (0, 1)])
        S = k + 1j * W * np.diag(truth["damping_n_s_m"][b])
        if b not in pedestals:
            return S
        p = pedestals[b]
        P = (p["k"] - W * W * p["m"] + 1j * W * p["c"]) * np.eye(2)
        return S @ np.linalg.inv(S + P) @ P

    def motion(rpm):
        W = rpm * math.pi / 30
        F = held_straight.copy()
        for z, g_mm, deg in weights:
            f = g_mm * 1e-6 * W * W * np.exp(1j * math.radians(deg))
            F[shaft.at(z)] += f
            F[shaft.at(z) + 1] += -1j * f
        amplitude = np.zeros((2, 2))
        for _ in range(400):
            Z = (shaft.K + 1j * W * W * shaft.G - W * W * shaft.M).astype(complex)
            for b, z in enumerate(bearings_m):
                i = shaft.at(z)
                Z[i:i + 2, i:i + 2] += support(b, W, amplitude[b])
            q = np.linalg.solve(Z, F)
            now = np.array([[abs(q[shaft.at(z) + axis]) for axis in (0, 1)] for z in bearings_m])
            if kappa == 0 or abs(now - amplitude).max() < 1e-13:
                break
            amplitude = 0.5 * (amplitude + now) if amplitude.any() else now
        seen = [(shaft.at(p["position_m"]), math.radians(p["angle_deg"])) for p in t["probe"]]
        return [1e6 * (q[i] * math.cos(a) + q[i + 1] * math.sin(a)) for i, a in seen]

    return np.array([motion(rpm) for rpm in speeds])


def write(path, t, speeds, shown, decimals):
    """shown: phasors of each run"""
    with open(path, "w") as f:
        rows = csv.writer(f, lineterminator="\n")
        rows.writerow(["run", "speed_rpm", *(f"{p['name']}_{part}_um" for p in t["probe"] for part in ("cos", "sin"))])
        for run, Y in zip(t["run"], shown):
            for rpm, row in zip(speeds, Y):
                rows.writerow([run["name"], f"{rpm:.2f}", *(f"{v:.{decimals}f}" for y in row for v in (y.real, -y.imag))])


def toml(t):
    lines = ["schema = 2", f'name = "{t["name"]}"']
    value = lambda v: f'"{v}"' if isinstance(v, str) else str(v).lower() if isinstance(v, bool) else f"{v:.6g}"

    def block(head, d):
        lines.extend(["", head])
        for key, v in d.items():
            if isinstance(v, dict):
                lines.append(f"{key} = {{ " + ", ".join(f"{a} = {float(b):.6e}" for a, b in v.items()) + " }")
            elif not isinstance(v, list):
                lines.append(f"{key} = {value(v)}")

    for key in ("physics", "noise", "tolerance"):
        block(f"[{key}]", t[key])
    for key in ("shaft", "disk", "bearing", "probe", "plane", "run"):
        for d in t[key]:
            block(f"[[{key}]]", d)
            for a in d.get("added_unbalance", []):
                block("[[run.added_unbalance]]", a)
    return "\n".join(lines) + "\n"


def kit(base, out, seed, own, hidden, masses_g=(0, 0.4, 0.8, 1.2), at_deg=0.0, angles_deg=None, speeds=SPEEDS):
    """hidden: (effect, place, parameters) each"""
    random, t = np.random.default_rng(seed), copy.deepcopy(base)
    t["name"] = out.name
    for p, a in zip(t["probe"], angles_deg or []):
        p["angle_deg"] = a
    z = t["plane"][0]["position_m"]
    added = lambda g: dict(added_unbalance=[dict(position_m=z, magnitude_g_mm=30.0 * g, angle_deg=at_deg)]) if g else {}
    t["run"] = [dict(name=f"{g:g} g", **added(g)) for g in masses_g]
    true = dict(stiffness_n_m=random.uniform(4e4, 7e4, (2, 2)), damping_n_s_m=random.uniform(250, 360, (2, 2)))
    for b, bearing in enumerate(t["bearing"]):
        for key, values in true.items():
            bearing[key].update({axis: v * math.exp(random.normal(0, 0.2)) for axis, v in zip(("xx", "yy"), values[b])})
    truth = dict(own_unbalance_g_mm_deg=list(own), effects=[dict(effect=e, at=at, parameters=p) for e, at, p in hidden],
                 **{key: values.tolist() for key, values in true.items()})
    clean = [respond_um(t, truth, speeds, run) for run in t["run"]]
    noise = t["noise"]
    scatter = lambda Y: (random.normal(size=Y.shape) + 1j * random.normal(size=Y.shape)) * (noise["relative"] * abs(Y) + noise["floor_um"])
    out.mkdir(parents=True, exist_ok=True)
    (out / "rotor.toml").write_text(toml(t))
    (out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
    write(out / "startup.csv", t, speeds, [Y + scatter(Y) for Y in clean], 4)
    write(out / "clean.csv", t, speeds, clean, 4)


def pedestal(bearing, k, resonance_rpm, damping_ratio):
    w = resonance_rpm * math.pi / 30
    return "pedestal", ("IB", "OB")[bearing], dict(bearing=bearing, k=k, m=k / w ** 2, c=2 * damping_ratio * k / w)


def sample(base, folder, out):
    """what the sample's truth shows, held against its record"""
    truth = json.loads((out / "truth.json").read_text())
    with open(folder / "startup.csv") as f:
        rows = list(csv.DictReader(f))
    clean, squares = [], []
    for run in base["run"]:
        own = [r for r in rows if r["run"] == run["name"]]
        cell = lambda r, p, part: float(r[f"{p['name']}_{part}_um"])
        Y = np.array([[cell(r, p, "cos") - 1j * cell(r, p, "sin") for p in base["probe"]] for r in own])
        clean.append(respond_um(base, truth, [float(r["speed_rpm"]) for r in own], run))
        sigma = base["noise"]["relative"] * abs(clean[-1]) + base["noise"]["floor_um"]
        squares.append((abs(Y - clean[-1]) ** 2 / (2 * sigma ** 2)).mean())
    assert 0.9 < np.mean(squares) < 1.1, squares
    write(out / "clean.csv", base, [float(r["speed_rpm"]) for r in own], clean, 4)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    reference.verify()
    folder, out = map(Path, sys.argv[1:])
    base = tomllib.loads((folder / "rotor.toml").read_text())
    sample(base, folder, out / "sample")
    softens = lambda kappa: ("nonlinear_stiffness", None, dict(kappa=kappa))
    kit(base, out / "nothing", 4, (6.0, -60.0), [])
    kit(base, out / "bow", 7, (4.0, 100.0), [("shaft_bow", None, dict(m=[1e-5, 2e-5])), pedestal(1, 9e4, 3900, 0.04)])
    kit(base, out / "angles", 10, (5.0, 200.0), [pedestal(0, 9e4, 3600, 0.05), softens(-3e7)], angles_deg=(45.0, 135.0, -45.0, 45.0), at_deg=90.0)
    kit(base, out / "coarse", 9, (7.0, -30.0), [pedestal(1, 7e4, 3500, 0.04), softens(-2.5e7)], speeds=np.arange(600.0, 4201.0, 150.0))
