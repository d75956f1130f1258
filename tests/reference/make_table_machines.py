"""Compressors on ROSS 2.3.0's own film bearings, with records of its own forced response: python make_table_machines.py OUT [NUMBER...]

OUT     folder that receives <case>/rotor.toml, measured.csv and truth.json
NUMBER  cases to make, all unless stated

Shaft, wheels, seals and bearings are ROSS's elements, each bearing with a table of ROSS's film solvers (make_film_tables.py) and
interpolated by ROSS; on a mesh twice as fine as the drawing's. Nothing of rotor-edge took part.

The drawing has the same tables, each times a factor of its own between 0.95 and 1.05, and states the noise: 1 % and 0.05 um.
Speeds go from 2050 rpm to the top of the bearings' kind, as far as the least logarithmic decrement stays above 0.05.
A hidden effect is drawn, and drawn a fifth larger each time, until it changes the readings by VISIBLE of the noise (root mean square)
beside what unbalance in the drawing's planes can follow, the bearings being known; `change_in_noise` in the truth says by how much.
A bow is half a sine between the bearings, as in make_kits.py.
"""
import itertools, json, math, sys
from pathlib import Path

import numpy as np
import ross as rs

import make_kits, make_ross_reference as reference
from make_check_reference import COLUMNS, compressor, film_table, machine, modes, rounded, toml_text

RELATIVE, FLOOR_UM = 0.01, 0.05
KINDS = {"tilting_pad": 12500.0, "lemon": 8500.0, "plain": 6500.0}
LEAST_RPM, LEAST_DECREMENT = 2050.0, 0.05
VISIBLE = 1.0
CASES = ["none"] * 8 + ["shaft_bow"] * 4 + ["seal"] * 6 + ["unbalance_plane"] * 3 + ["disk_mass"] * 3


def scaled(table, factor):
    return [{k: v if k == "speed_rpm" else v * factor for k, v in row.items()} for row in table]


def hidden(effect, wheels, random, grown):
    """effect, place, parameters, so many times larger than usual"""
    def phasor(low, high):
        value = grown * random.uniform(low, high) * np.exp(1j * random.uniform(0, 2 * math.pi))
        return [float(value.real), float(value.imag)]

    wheel = lambda first, last: f"wheel {random.integers(first, last + 1)}"
    if effect == "seal":
        k, q, c = (grown * float(random.uniform(a, b)) for a, b in ((4e5, 2e6), (1e6, 2.5e6), (400.0, 3500.0)))
        return dict(effect=effect, at=wheel(1, wheels), parameters=dict(k=k, q=q, c=c))
    if effect == "shaft_bow":
        return dict(effect=effect, at=None, parameters=dict(m=phasor(7e-7, 1e-5)))
    if effect == "unbalance_plane":  # the planes are at the first and the last wheel
        return dict(effect=effect, at=wheel(2, wheels - 1), parameters=dict(u=phasor(1e-4, 3e-4)))
    return dict(effect=effect, at=wheel(1, wheels), parameters=dict(kg=grown * float(random.choice([-1.0, 1.0]) * random.uniform(0.5, 2.0))))


class Machine:
    """ROSS's elements of a drawing with what is hidden in it"""
    def __init__(self, t, effects):
        of = lambda kind: [(e["at"], e["parameters"]) for e in effects if e["effect"] == kind]
        heavier = {at: p["kg"] for at, p in of("disk_mass")}
        finer = [dict(g, length_m=g["length_m"] / 2) for g in t["shaft"] for _ in (0, 1)]
        self.t = dict(t, shaft=finer, disk=[dict(d, mass_kg=d["mass_kg"] + heavier.get(d["name"], 0.0)) for d in t["disk"]])
        self.bare = make_kits.Shaft(dict(self.t, bearing=[dict(b, stiffness_n_m={}, damping_n_s_m={}) for b in t["bearing"]]))
        node = lambda z: reference.node(self.bare.nodes, z)
        self.wheel = {d["name"]: d["position_m"] for d in t["disk"]}
        bearings = [rs.BearingElement(n=node(b["position_m"]), frequency=[r["speed_rpm"] * math.pi / 30 for r in b["table"]],
                                      **{c: [r[c] for r in b["table"]] for c in COLUMNS}) for b in t["bearing"]]
        seals = [rs.SealElement(n=node(self.wheel[at]), kxx=p["k"], kyy=p["k"], kxy=p["q"], kyx=-p["q"], cxx=p["c"], cyy=p["c"])
                 for at, p in of("seal")]
        still = reference.build(dict(self.t, bearing=[dict(b, stiffness_n_m=dict(xx=0.0, yy=0.0), damping_n_s_m=dict(xx=0.0, yy=0.0)) for b in t["bearing"]]))[1]
        self.rotor = rs.Rotor(still.shaft_elements, still.disk_elements, bearings + seals)
        self.planes = [(self.wheel[at], complex(*p["u"])) for at, p in of("unbalance_plane")]
        ends = [b["position_m"] for b in t["bearing"]]
        self.held_straight = sum((self.bare.K @ self.bare.bow(ends, complex(*p["m"])) for _, p in of("shaft_bow")), np.zeros(len(self.bare.K), complex))

    def least_decrement(self, rpm):
        return min(-2 * math.pi * m["re"] / abs(m["im"]) for m in modes(self.rotor, rpm)["modes"][:4])

    def respond_um(self, speeds, planes):
        W = np.array(speeds) * math.pi / 30
        F = np.zeros((self.rotor.ndof, len(W)), complex)
        lateral = [6 * i + j for i in range(len(self.bare.nodes)) for j in reference.LATERAL]
        F[lateral] += self.held_straight[:, None]
        for z, u in planes + self.planes:
            i = 6 * reference.node(self.bare.nodes, z)
            F[i] += u * W * W
            F[i + 1] += -1j * u * W * W
        q = self.rotor.run_forced_response(force=F, speed_range=W).forced_resp
        seen = [(6 * reference.node(self.bare.nodes, p["position_m"]), math.radians(p["angle_deg"])) for p in self.t["probe"]]
        return 1e6 * np.array([q[i] * math.cos(a) + q[i + 1] * math.sin(a) for i, a in seen]).T


def beside_unbalance(change, follows, sigma):
    """root mean square of what is left of a change, in the noise"""
    columns, target = np.array([(F / sigma).ravel() for F in follows]).T, (change / sigma).ravel()
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sqrt(np.mean(abs(left) ** 2) / 2))


def case(folder, number, effect):
    kind = list(KINDS)[number % 3]
    random = np.random.default_rng(100 + number)
    wheels = 5 + int(random.integers(0, 4))
    ends = [f"{kind}_{end}" for end in ("ab" if number % 2 else "ba")]
    _, t = machine(KINDS[kind], *compressor(wheels, *ends, diameter_m=0.09, wheel_kg=22.0))
    planes = [(p["position_m"], random.uniform(2e-4, 5e-4) * np.exp(1j * random.uniform(0, 2 * math.pi))) for p in t["plane"]]
    sigma = lambda Y: RELATIVE * abs(Y) + FLOOR_UM
    for draw in itertools.count():
        effects = [] if effect == "none" else [hidden(effect, wheels, random, 1.2 ** draw)]
        true = Machine(t, effects)
        top = next((rpm for rpm in np.linspace(KINDS[kind], LEAST_RPM, 20) if true.least_decrement(rpm) > LEAST_DECREMENT), None)
        if top is None:  # what is hidden makes it unstable everywhere
            continue
        count = int(random.integers(41, 56))
        speeds = np.linspace(LEAST_RPM, top, count) * random.uniform(1, 1.005, count)
        Y = true.respond_um(speeds, planes)
        bare = Machine(t, []) if effects else true
        follows = [bare.respond_um(speeds, [(z, 1.0)]) for z, _ in planes]
        change = beside_unbalance(Y - sum(u * F for (_, u), F in zip(planes, follows)), follows, sigma(Y))
        if not effects or change > VISIBLE:
            break
    shown = Y + (random.normal(size=Y.shape) + 1j * random.normal(size=Y.shape)) * sigma(Y)
    factors = random.uniform(0.95, 1.05, len(t["bearing"])).tolist()
    t = dict(t, run=[dict(name="as-found")], bearing=[dict(b, table=scaled(b["table"], f)) for b, f in zip(t["bearing"], factors)])
    out = folder / f"{number:02}-{kind.replace('_', '-')}-{effect}"
    out.mkdir(parents=True, exist_ok=True)
    noise = f"\n\n[noise]\nrelative = {RELATIVE}\nfloor_um = {FLOOR_UM}\n\n[tolerance]\nexact = true\n"
    (out / "rotor.toml").write_text(toml_text(out.name, compact(t)).replace("\n\n", noise + "\n", 1))
    make_kits.write(out / "measured.csv", t, speeds, [shown], 4)
    truth = dict(effects=effects, factors=factors, planes_kg_m=[[u.real, u.imag] for _, u in planes], bearings=ends,
                 change_in_noise=change, least_log_decrement=true.least_decrement(top), top_rpm=float(top), median_um=float(np.median(abs(Y))))
    (out / "truth.json").write_text(json.dumps(rounded(truth), indent=1) + "\n")
    print(out.name, wheels, "wheels", f"{top:.0f} rpm, change {change:.1f} of the noise, median {truth['median_um']:.2f} um", effects, flush=True)


def compact(v):
    if isinstance(v, dict):
        return {k: compact(x) for k, x in v.items()}
    return [compact(x) for x in v] if isinstance(v, list) else float(f"{v:.6g}") if isinstance(v, float) else v


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    reference.verify()
    for number in map(int, sys.argv[2:]) if sys.argv[2:] else range(len(CASES)):
        case(Path(sys.argv[1]), number, CASES[number])
