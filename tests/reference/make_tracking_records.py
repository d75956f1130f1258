"""Records of the sample's turbine with known truth, on ROSS 2.3.0 finite elements: python make_tracking_records.py ROTOR OUT

ROTOR  the sample's rotor.toml
OUT    folder that receives one folder for each record: record.csv, runup.csv, perhaps a run-up after the event, truth.csv

Unbalance drifts smoothly in each plane; each bearing has one hidden state (load, temperature) that wanders as an Ornstein-Uhlenbeck
process of 10 days and multiplies both stiffnesses by e^s and both dampings by e^(-1.1 s); readings have 2 % + 0.03 um of noise, the speed
scatters by 25 rpm, one reading in fifty is missing. truth.csv: day, unbalance of both planes, and what the noise alone added to the
residual that day. The records are written so that no event, or another one than the sample's, is in them:

  one_bearing  bearing 15 changes on day 200
  quiet        nothing happens
  disturbed    nothing happens but two disturbed readings from day 150 on; no readings on days 60 to 81 and 300 to 317
"""
import csv, math, sys, tomllib
from pathlib import Path

import numpy as np
import make_ross_reference as reference

NOISE_RELATIVE, NOISE_FLOOR_UM, WANDER, WANDER_DAYS, DAMPING_FOLLOWS = 0.02, 0.03, (0.11, 0.085), 10.0, -1.1


class Machine:
    """the shaft without bearings, assembled by ROSS; bearings are added here, as they change from day to day"""
    def __init__(self, t):
        self.t, bare = t, dict(t, bearing=[dict(b, stiffness_n_m=dict(xx=0.0, yy=0.0), damping_n_s_m=dict(xx=0.0, yy=0.0)) for b in t["bearing"]])
        self.nodes, rotor = reference.build(bare)
        keep = [6 * i + j for i in range(len(self.nodes)) for j in reference.LATERAL]
        self.M, self.K, self.G = (np.array(A[np.ix_(keep, keep)]) for A in (rotor.M(1.0), rotor.K(1.0), rotor.G()))

    def at(self, position_m):
        return 4 * reference.node(self.nodes, position_m)

    def response_um(self, rpm, stiffness, damping, unbalance_g_mm):
        W = rpm * math.pi / 30
        Z = (self.K - W * W * self.M + 1j * W * W * self.G).astype(complex)
        for b, k, c in zip(self.t["bearing"], stiffness, damping):
            for axis in (0, 1):
                Z[self.at(b["position_m"]) + axis, self.at(b["position_m"]) + axis] += k[axis] + 1j * W * c[axis]
        F = np.zeros(len(Z), complex)
        for p, u in zip(self.t["plane"], unbalance_g_mm):
            F[self.at(p["position_m"])] += W * W * u * 1e-6
            F[self.at(p["position_m"]) + 1] += -1j * W * W * u * 1e-6
        q, out = np.linalg.solve(Z, F), []
        for p in self.t["probe"]:
            i, a = self.at(p["position_m"]), math.radians(p["angle_deg"])
            out.append(q[i] * math.cos(a) + q[i + 1] * math.sin(a))
        return np.array(out) * 1e6


def smooth(random, n, sd, width=9):
    """integral of smoothed noise"""
    window = np.hanning(width) / np.linalg.norm(np.hanning(width))
    return np.cumsum(np.convolve(random.normal(size=n + 4 * width), window, "same")[2 * width:2 * width + n]) * sd


def record(machine, out, seed, n=460, event=None, bearing=0, stiffness_factor=(1, 1), damping_factor=(1, 1), disturbed=None, gaps=()):
    random, t = np.random.default_rng(seed), machine.t
    axes = lambda key: np.array([[b[key][a] for a in ("xx", "yy")] for b in t["bearing"]])
    k, c = (axes(key) * np.exp(random.normal(size=(2, 2)) * 0.15) for key in ("stiffness_n_m", "damping_n_s_m"))
    U = np.zeros((n, 2), complex)
    for j in (0, 1):
        size = random.uniform(300, 500) * np.exp(np.cumsum(random.normal(size=n) * 0) + smooth(random, n, 0.0035) + np.arange(n) / n * random.uniform(0.1, 0.6))
        U[:, j] = size * np.exp(1j * np.radians(random.uniform(-180, 180) + smooth(random, n, 0.35)))
    s, a = np.zeros((n, 2)), math.exp(-1 / WANDER_DAYS)
    for d in range(1, n):
        s[d] = a * s[d - 1] + math.sqrt(1 - a * a) * np.array(WANDER) * random.normal(size=2)

    def measured(rpm, d):
        kd, cd = k.copy(), c.copy()
        if event is not None and d >= event:
            kd[bearing] *= stiffness_factor
            cd[bearing] *= damping_factor
        Y = machine.response_um(rpm, kd * np.exp(s[d])[:, None], cd * np.exp(DAMPING_FOLLOWS * s[d])[:, None], U[d])
        noise = (random.normal(size=4) + 1j * random.normal(size=4)) * (NOISE_RELATIVE * abs(Y) + NOISE_FLOOR_UM)
        return Y + noise, (abs(noise.real) + abs(noise.imag)).sum()

    head = [f"{p['name']}_{part}_um" for p in t["probe"] for part in ("cos", "sin")]
    cells = lambda Y: [f"{v:.5f}" for y in Y for v in (y.real, -y.imag)]
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "record.csv", "w") as f, open(out / "truth.csv", "w") as g:
        rows, truth = csv.writer(f, lineterminator="\n"), csv.writer(g, lineterminator="\n")
        rows.writerow(["time_d", "speed_rpm", *head])
        truth.writerow(["day", *(f"plane_{p['name']}_{part}" for p in t["plane"] for part in ("g_mm", "deg")), "noise_um"])
        for d in range(n):
            if random.random() < 0.02 or any(first <= d < end for first, end in gaps):
                continue
            rpm = round(11000 + random.normal() * 25, 2)
            Y, noise_um = measured(rpm, d)
            if disturbed is not None and disturbed <= d < disturbed + 2:
                Y = Y * np.array([1.6, 0.5, 1.7, 0.6]) + 1.5
            rows.writerow([d, f"{rpm:.2f}", *cells(Y)])
            polar = [v for u in U[d] for v in (round(abs(u), 2), round(math.degrees(np.angle(u)), 2))]
            truth.writerow([d, *polar, round(noise_um, 4)])
    for name, d in [("runup", 0)] + ([(f"runup-day{event + 1:03d}", event + 1)] if event else []):
        with open(out / f"{name}.csv", "w") as f:
            rows = csv.writer(f, lineterminator="\n")
            rows.writerow(["run", "speed_rpm", *head])
            for rpm in range(1500, 11501, 200):
                rows.writerow([f"day {d}", f"{rpm}.00", *cells(measured(rpm, d)[0])])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    reference.verify()
    machine, out = Machine(tomllib.loads(Path(sys.argv[1]).read_text())), Path(sys.argv[2])
    record(machine, out / "one_bearing", 1, event=200, bearing=0, stiffness_factor=(0.55, 1.25), damping_factor=(0.5, 0.7))
    record(machine, out / "quiet", 3)
    record(machine, out / "disturbed", 4, disturbed=150, gaps=[(60, 82), (300, 318)])
