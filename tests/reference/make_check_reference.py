"""Reference answers of ROSS 2.3.0 for `rotor-edge check`: mass, static loads, critical speeds, damped modes, response.

usage: python make_check_reference.py OUT [MACHINE...]

Writes OUT/<machine>.toml, the drawing in the project's format, and OUT/<machine>.json, what ROSS says of it, for each
of `machines()`, or of those named. Mesh, conventions and how they were verified: make_ross_reference.py, whose builder and
eigenvalues are used here.

mass_kg, centre_of_gravity_m   Rotor.m and Rotor.CG
load_n                         Rotor.run_static(), whose supports are nearly rigid (1e20 N/m) and whose g is 9.8065 m/s^2
critical_speeds                roots of det(K - W^2 M + i W^2 G) = 0 with ROSS's assembled matrices, dampers out, the
                               symmetric part of the bearings' stiffness, each with `forward`: the share of its
                               mode that turns forward, in the norm of M. For the machines in CONFIRMED ROSS's own
                               run_critical_speed must give the same, or the program stops.
tables                         a bearing stated over speed has rows that ROSS's own film solvers gave (make_film_tables.py). At
                               a speed between them it is scipy's PchipInterpolator (Fritsch and Butland), as at the
                               nearest row outside, and ROSS is given what that says at each speed; a critical
                               speed is where the pencil of the coefficients at a speed has that speed for a root
modes                          eigenvalues at five speeds, with the least and the largest roundness of the orbits of
                               the nodes that move at least a twentieth of the largest: 2 Im(x conj y) / (|x|^2+|y|^2)
response                       run_unbalance_response at the probes
"""
import csv, json, math, sys, tomllib
from pathlib import Path

import numpy as np
import ross as rs
from scipy import interpolate, linalg, optimize

from make_ross_reference import LATERAL, build, node, response, response_json, verify

STEEL = dict(youngs_modulus_pa=2.06e11, density_kg_m3=7850.0, poisson_ratio=0.3)
CONFIRMED = ("jeffcott", "thin_wheel", "orthotropic")  # by run_critical_speed, which takes its time
COUNT = 10  # modes and critical speeds that are compared
DIGITS = 12  # of what is written
COLUMNS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")


def bearing(name, z, k, c):
    """k, c: xx, yy, xy, yx"""
    keys = ("xx", "yy", "xy", "yx")
    return dict(name=name, position_m=z, stiffness_n_m=dict(zip(keys, k)), damping_n_s_m=dict(zip(keys, c)))


def film_table(name):
    with open(Path(__file__).parent / "film_tables" / f"{name}.csv") as rows:
        return [{key: float(v) for key, v in row.items()} for row in csv.DictReader(rows)]


def film_bearing(name, z, table):
    return dict(name=name, position_m=z, table=film_table(table))


def disk(name, z, m, i_d, i_p):
    return dict(name=name, position_m=z, mass_kg=m, diametral_inertia_kg_m2=i_d, polar_inertia_kg_m2=i_p)


def coupling(name, z, lateral, angular, m, i_d, i_p):
    return dict(name=name, position_m=z, lateral_stiffness_n_m=lateral, angular_stiffness_n_m_rad=angular, mass_kg=m,
                diametral_inertia_kg_m2=i_d, polar_inertia_kg_m2=i_p)


def machine(top_rpm, segments, disks, bearings, planes, steel=STEEL, couplings=()):
    """segments: length, outer, inner diameter"""
    shaft = [dict(length_m=l, outer_diameter_m=o, inner_diameter_m=i, **steel) for l, o, i in segments]
    probes = [dict(name=f"{b['name']}{a}", bearing=b["name"], position_m=b["position_m"], angle_deg=t)
              for b in bearings for a, t in (("X", 45.0), ("Y", 135.0))]
    return top_rpm, dict(shaft=shaft, coupling=list(couplings), disk=disks, bearing=bearings, probe=probes,
                         plane=[dict(name=f"P{i + 1}", position_m=z) for i, z in enumerate(planes)])


def uniform(total, pieces, outer, inner=0.0):
    return [(total / pieces, outer, inner)] * pieces


def machines():
    iso = lambda k: (k, k, 0.0, 0.0)
    yield "jeffcott", machine(6000, uniform(0.8, 4, 0.03), [disk("disk", 0.4, 12.0, 0.05, 0.1)],
                              [bearing("A", 0.0, iso(5e6), iso(300.0)), bearing("B", 0.8, iso(5e6), iso(300.0))], [0.4])
    yield "overhung_fan", machine(3600, [(0.25, 0.14, 0.0)] * 5 + [(0.2, 0.12, 0.0)], [disk("impeller", 1.4, 420.0, 55.0, 105.0)],
                                  [bearing("A", 0.15, (2.2e8, 3.1e8, 0.0, 0.0), (6e4, 8e4, 0.0, 0.0)),
                                   bearing("B", 1.0, (2.6e8, 3.6e8, 0.0, 0.0), (7e4, 9e4, 0.0, 0.0))], [1.4])
    yield "thin_wheel", machine(9000, uniform(0.6, 4, 0.05), [disk("wheel", 0.15, 20.0, 0.9, 1.79)],
                                [bearing("A", 0.05, iso(8e7), iso(2e3)), bearing("B", 0.55, iso(6e7), iso(2e3))], [0.15])
    yield "cross_coupled", machine(12000, [(0.2, 0.07, 0.0), (0.5, 0.11, 0.0), (0.5, 0.11, 0.0), (0.2, 0.07, 0.0)],
                                   [disk(f"stage {i}", 0.4 + 0.2 * i, 22.0, 0.2, 0.36) for i in range(4)],
                                   [bearing("A", 0.1, (6e7, 9e7, 1.5e7, -2.5e7), (6e4, 9e4, -5e3, -4e3)),
                                    bearing("B", 1.3, (7e7, 1.1e8, 2e7, -3e7), (6e4, 1e5, -6e3, -5e3))], [0.4, 1.0])
    yield "unstable", machine(12000, [(0.2, 0.07, 0.0), (0.5, 0.11, 0.0), (0.5, 0.11, 0.0), (0.2, 0.07, 0.0)],
                              [disk(f"stage {i}", 0.4 + 0.2 * i, 22.0, 0.2, 0.36) for i in range(4)],
                              [bearing("A", 0.1, (6e7, 9e7, 4e7, -6e7), (2e4, 3e4, 0.0, 0.0)),
                               bearing("B", 1.3, (7e7, 1.1e8, 4e7, -7e7), (2e4, 3e4, 0.0, 0.0))], [0.4, 1.0])
    yield "orthotropic", machine(9000, uniform(1.2, 5, 0.06), [disk("A", 0.36, 15.0, 0.1, 0.18), disk("B", 0.84, 18.0, 0.13, 0.24)],
                                 [bearing("1", 0.0, (4e6, 4e7, 0.0, 0.0), (500.0, 900.0, 0.0, 0.0)),
                                  bearing("2", 1.2, (6e6, 3e7, 0.0, 0.0), (500.0, 900.0, 0.0, 0.0))], [0.36, 0.84])
    yield "hollow_roll", machine(2400, [(0.3, 0.12, 0.0)] + uniform(2.4, 6, 0.3, 0.25) + [(0.3, 0.12, 0.0)], [],
                                 [bearing("drive", 0.1, iso(1.2e8), iso(4e4)), bearing("far", 2.9, iso(9e7), iso(4e4))], [0.8, 2.2])
    yield "turbocharger", machine(120000, [(0.01, 0.008, 0.0)] * 2 + [(0.02, 0.011, 0.0)] * 4 + [(0.01, 0.014, 0.0)] * 2,
                                  [disk("compressor", 0.008, 0.075, 2.1e-5, 3.0e-5), disk("turbine", 0.115, 0.16, 3.4e-5, 4.8e-5)],
                                  [bearing("C", 0.035, (2e6, 2.4e6, 3e5, -3e5), (180.0, 220.0, 0.0, 0.0)),
                                   bearing("T", 0.08, (2e6, 2.4e6, 3e5, -3e5), (180.0, 220.0, 0.0, 0.0))], [0.008, 0.115])
    yield "pump", machine(4500, uniform(1.8, 9, 0.07), [disk(f"stage {i}", 0.4 + 0.15 * i, 9.0, 0.07, 0.12) for i in range(7)],
                          [bearing("A", 0.1, (9e7, 9e7, 2e7, -2e7), (2e5, 2e5, 0.0, 0.0)),
                           bearing("B", 1.7, (9e7, 9e7, 2e7, -2e7), (2e5, 2e5, 0.0, 0.0))], [0.4, 1.3])
    yield "aluminium_spindle", machine(30000, [(0.05, 0.04, 0.015), (0.2, 0.06, 0.015), (0.08, 0.045, 0.015)], [disk("pulley", 0.02, 1.1, 6e-4, 1.1e-3)],
                                       [bearing("rear", 0.07, iso(9e7), iso(3e3)), bearing("front", 0.25, iso(2.5e8), iso(5e3))], [0.02, 0.3],
                                       dict(youngs_modulus_pa=7.1e10, density_kg_m3=2700.0, poisson_ratio=0.33))
    yield "three_bearings", machine(3600, uniform(4.0, 10, 0.22), [disk("rotor", 1.0, 900.0, 60.0, 100.0), disk("exciter", 3.1, 260.0, 9.0, 16.0)],
                                    [bearing("1", 0.2, (6e8, 9e8, 1e8, -2e8), (1.2e6, 1.6e6, 0.0, 0.0)),
                                     bearing("2", 2.2, (7e8, 1e9, 1e8, -2e8), (1.3e6, 1.7e6, 0.0, 0.0)),
                                     bearing("3", 3.8, (3e8, 4e8, 5e7, -9e7), (6e5, 8e5, 0.0, 0.0))], [1.0, 3.1])
    yield "four_bearing_train", machine(3600, [(0.4, 0.22, 0.0), (1.0, 0.4, 0.0), (1.0, 0.4, 0.0), (0.6, 0.25, 0.0), (0.5, 0.25, 0.0), (1.2, 0.5, 0.1), (1.2, 0.5, 0.1), (0.4, 0.25, 0.0)],
                                        [disk(f"wheel {i + 1}", 0.7 + 0.25 * i, 380.0, 20.0, 38.0) for i in range(6)] + [disk("winding", 4.7, 2600.0, 420.0, 300.0), disk("coupling", 3.0, 180.0, 3.0, 5.0)],
                                        [bearing("1", 0.2, (8e8, 1.3e9, 2e8, -5e8), (1.6e6, 2.4e6, -2e5, -2e5)),
                                         bearing("2", 2.6, (9e8, 1.4e9, 2e8, -5e8), (1.7e6, 2.6e6, -2e5, -2e5)),
                                         bearing("3", 3.4, (1.1e9, 1.7e9, 3e8, -6e8), (2.0e6, 3.1e6, -3e5, -3e5)),
                                         bearing("4", 6.1, (1.0e9, 1.6e9, 3e8, -6e8), (1.9e6, 3.0e6, -3e5, -3e5))], [0.7, 1.95, 3.9, 5.5])
    yield "coupled_train", machine(9000, uniform(1.2, 4, 0.09) + uniform(1.0, 4, 0.07, 0.02),
                                   [disk("motor", 0.6, 60.0, 0.6, 0.9), disk("impeller", 1.65, 14.0, 0.08, 0.14), disk("overhung", 2.15, 9.0, 0.05, 0.09)],
                                   [bearing("1", 0.1, (8e7, 1.1e8, 2e7, -3e7), (6e4, 9e4, 0.0, 0.0)), bearing("2", 1.08, (8e7, 1.2e8, 2e7, -3e7), (6e4, 9e4, 0.0, 0.0)),
                                    bearing("3", 1.32, (5e7, 7e7, 1e7, -2e7), (3e4, 5e4, 0.0, 0.0)), bearing("4", 2.0, (5e7, 8e7, 1e7, -2e7), (3e4, 5e4, 0.0, 0.0))],
                                   [0.4, 0.8, 1.65, 2.15], couplings=[coupling("discs", 1.2, 2.5e7, 6e4, 11.0, 0.06, 0.09)])
    yield "soft_mounts", machine(18000, uniform(0.5, 5, 0.08), [disk("drum", 0.25, 30.0, 0.35, 0.5)],
                                 [bearing("A", 0.05, iso(4e5), iso(150.0)), bearing("B", 0.45, iso(5e5), iso(150.0))], [0.15, 0.35])
    yield "stiff_mounts", machine(15000, uniform(1.0, 6, 0.09), [disk("drum", 0.45, 25.0, 0.2, 0.3)],
                                  [bearing("A", 0.05, (4e9, 5e9, 0.0, 0.0), (1e4, 1e4, 0.0, 0.0)), bearing("B", 0.95, (4e9, 5e9, 0.0, 0.0), (1e4, 1e4, 0.0, 0.0))], [0.2, 0.7])
    yield "tilting_pad_compressor", machine(13000, *compressor(7, "tilting_pad_a", "tilting_pad_b"))
    yield "plain_compressor", machine(6500, *compressor(5, "plain_a", "plain_b"))


def compressor(wheels, thrust_end, drive_end, diameter_m=0.1, wheel_kg=15.0):
    """on film bearings of ROSS's solvers"""
    shaft = [(0.12, 0.07, 0.0), (0.12, 0.08, 0.0), *uniform(0.11 * (wheels + 1), 3, diameter_m), (0.12, 0.08, 0.0), (0.12, 0.07, 0.0)]
    end = sum(length for length, _, _ in shaft)
    disks = [disk(f"wheel {i + 1}", 0.35 + 0.11 * i, wheel_kg - 0.5 * i, 0.09, 0.17) for i in range(wheels)]
    bearings = [film_bearing("thrust end", 0.15, thrust_end), film_bearing("drive end", end - 0.15, drive_end)]
    return shaft, disks, bearings, [disks[0]["position_m"], disks[-1]["position_m"]]


def toml_text(name, t):
    row = lambda v: "{ " + ", ".join(f"{k} = {x!r}" for k, x in v.items()) + " }"
    rows = lambda v: "[" + "".join(f"\n  {row(x)}," for x in v) + "\n]"
    value = lambda v: json.dumps(v) if isinstance(v, str) else row(v) if isinstance(v, dict) else rows(v) if isinstance(v, list) else repr(v)
    newer = t["coupling"] or any("table" in b for b in t["bearing"])
    lines = [f"schema = {2 if newer else 1}", f'name = "{name.replace("_", " ")}"']
    for key in ("shaft", "coupling", "disk", "bearing", "probe", "plane", "run"):
        for part in t.get(key, []):
            lines += ["", f"[[{key}]]"] + [f"{k} = {value(v)}" for k, v in part.items()]
    return "\n".join(lines) + "\n"


def held(t, W):
    """the machine with the coefficients that its tables have at a speed"""
    def one(b):
        if "table" not in b:
            return b
        rad_s = np.array([row["speed_rpm"] for row in b["table"]]) * math.pi / 30
        at = np.clip(W, rad_s[0], rad_s[-1])
        k = {c: float(interpolate.PchipInterpolator(rad_s, [row[c] for row in b["table"]])(at)) for c in COLUMNS}
        return bearing(b["name"], b["position_m"], *([k[m + a] for a in ("xx", "yy", "xy", "yx")] for m in "kc"))
    return dict(t, bearing=[one(b) for b in t["bearing"]])


def built(t, W):
    return build(held(t, W))[1]


def lateral(rotor, W):
    keep = [6 * i + j for i in range(rotor.ndof // 6) for j in LATERAL]
    return [A[np.ix_(keep, keep)] for A in (rotor.M(W), rotor.K(W), rotor.C(W), rotor.G())]


def critical_speeds(rotor):
    M, K, _, G = lateral(rotor, 0.0)
    K = (K + K.T) / 2
    # q = e^{iWt}: (K + i W^2 G - W^2 M) q = 0, so (M - i G) q = mu K q with mu = 1 / W^2
    mu, vectors = linalg.eigh(M - 1j * G, K)
    order = [i for i in np.argsort(-mu) if mu[i] > 0][:COUNT]
    # x, y, rotation about x (= -dy/dz), rotation about y (= dx/dz): forward is y = -i x
    J = np.kron(np.eye(len(K) // 4), np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1], [0, 0, -1, 0]]))
    out = []
    for i in order:
        q = vectors[:, i]
        f, b = (q + 1j * J @ q) / 2, (q - 1j * J @ q) / 2
        f, b = (np.real(v.conj() @ M @ v) for v in (f, b))
        out.append(dict(rad_s=float(mu[i] ** -0.5), forward=float(f / (f + b))))
    return out


def undamped(t, W):
    h = held(t, W)
    return build(dict(h, bearing=[dict(b, damping_n_s_m=dict(xx=0.0, yy=0.0)) for b in h["bearing"]]))[1]


def critical_speeds_over_tables(t, top):
    """the roots that exceed the speed their coefficients belong to, order by order, until they no longer do"""
    speeds = np.linspace(0.1, 4.0, 40) * top * math.pi / 30
    all_at = [critical_speeds(undamped(t, W)) for W in speeds]
    out = []
    for k in range(COUNT):
        off = lambda W: critical_speeds(undamped(t, W))[k]["rad_s"] / W - 1
        signs = [here[k]["rad_s"] > W for here, W in zip(all_at, speeds)]
        for i in (i for i in range(len(speeds) - 1) if signs[i] != signs[i + 1]):
            W = optimize.brentq(off, speeds[i], speeds[i + 1], xtol=1e-9 * speeds[i], rtol=1e-12)
            out.append(critical_speeds(undamped(t, W))[k])
    return sorted(out, key=lambda c: c["rad_s"])


def rounded(v):
    if isinstance(v, dict):
        return {k: rounded(x) for k, x in v.items()}
    return [rounded(x) for x in v] if isinstance(v, list) else float(f"{v:.{DIGITS}g}") if isinstance(v, float) else v


def modes(rotor, rpm):
    W = rpm * math.pi / 30
    M, K, C, G = lateral(rotor, W)
    n = len(M)
    values, vectors = linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-linalg.solve(M, K), -linalg.solve(M, C + W * G)]]))
    order = [i for i in np.argsort(values.imag) if values[i].imag > 1e-6 * abs(values[i])][:COUNT]
    out = []
    for i in order:
        x, y = vectors[0:n:4, i], vectors[1:n:4, i]
        size = abs(x) ** 2 + abs(y) ** 2
        turn = (2 * (x * y.conj()).imag / size)[size > 0.05**2 * size.max()]
        out.append(dict(re=float(values[i].real), im=float(values[i].imag), least=float(turn.min()), largest=float(turn.max())))
    return dict(speed_rpm=rpm, modes=out)


def same_as_ross(name, rotor, ours):
    """run_critical_speed without dampers, to its own tolerance"""
    theirs = rotor.run_critical_speed(num_modes=16, rtol=1e-9).wn()
    for c in ours[:3]:
        off = min(abs(theirs - c["rad_s"])) / c["rad_s"]
        if off > 1e-6:
            sys.exit(f"{name}: run_critical_speed has no {c['rad_s']} rad/s, the next is off by {off:.1e}")


def reference(name, top, t):
    rad_s = lambda rpm: rpm * math.pi / 30
    over_tables = any("table" in b for b in t["bearing"])
    nodes, rotor = build(held(t, 0.0))
    critical = critical_speeds_over_tables(t, top) if over_tables else critical_speeds(undamped(t, 0.0))
    if name in CONFIRMED:
        same_as_ross(name, undamped(t, 0.0), critical)
    unbalance = [(1e-6 * rotor.m * (1 + i), 40.0 - 100.0 * i) for i in range(len(t["plane"]))]
    rpm = np.linspace(0.05 * top, 1.2 * top, 24).tolist()
    at_each = [response(t, nodes, built(t, rad_s(n)), [n], unbalance) for n in rpm] if over_tables else None
    Y = np.concatenate(at_each, axis=1) if over_tables else response(t, nodes, rotor, rpm, unbalance)
    out = dict(made_by=f"ROSS {rs.__version__}, numpy {np.__version__}", top_rpm=top, mass_kg=float(rotor.m), centre_of_gravity_m=float(rotor.CG),
               critical_speeds=critical, modes=[modes(built(t, rad_s(f * top)), f * top) for f in (0.1, 0.35, 0.6, 0.85, 1.1)],
               response=response_json(t, Y, rpm, unbalance))
    rotor.run_static()
    at = lambda b: f"node_{node(nodes, b['position_m'])}"
    out["load_n"] = [float(rotor.bearing_forces_nodal[at(b)]) for b in t["bearing"]]
    return rounded(out)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    verify()
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    only = sys.argv[2:]
    for name, (top, t) in machines():
        if only and name not in only:
            continue
        text = toml_text(name, t)
        t = tomllib.loads(text)
        (folder / f"{name}.toml").write_text(text)
        (folder / f"{name}.json").write_text(json.dumps(reference(name, top, t)) + "\n")
        print(name)
