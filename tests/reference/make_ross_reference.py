"""Reference answers of ROSS 2.3.0 for the finite elements of the desktop crate.

usage: python make_ross_reference.py ROTORS OUT [--time]

ROTORS  folder of rotor.toml files (any names, the project's format)
OUT     folder that receives one JSON file for each, same stem
--time  also time the 51-speed unbalance response of ROTORS/turbine.toml (median of 5)

A flexible coupling is a CouplingElement between two nodes at its place; where its Id is zero ROSS puts Ip / 2.

Mesh. Marks are all stated positions (disks, bearings, probes, planes, added unbalances) rounded to 1e-9 m. Every
shaft segment is cut at the marks inside it; a piece of length p in a segment of length l is divided into
ceil(p / (l/2) - 1e-9) equal elements. `mesh_m` in the JSON is the list of nodes that results.

Convention. z along the shaft, rotation takes x into y, u(t) = cos * cos(Wt) + sin * sin(Wt), Y = cos - i sin,
u = Re(Y e^{iWt}); unbalance U at angle a: Fx = U W^2 cos(Wt + a), Fy = U W^2 sin(Wt + a); a probe at angle b from +x
reads x cos b + y sin b. ROSS solves (K + iW (C + W G) - W^2 M) q = F with F_x = U W^2 e^{ia}, F_y = -i F_x, that is
q(t) = Re(q e^{+iWt}) with rotation x into y: the same convention, so Y = q_x cos b + q_y sin b without conjugation.

How that was verified: `verify()` runs first and stops the program on a difference above 1e-5. A practically rigid
shaft on two equal isotropic bearings (k, c at its ends, +-a) carries one disk in the middle; m, Id, Ip of both together:
  static unbalance U at angle s:   x = U e^{is} W^2 / (2k + 2icW - m W^2),                y = -i x
  couple (U at +b, -U at -b):      slope = 2 b U e^{is} W^2 / (2a^2 (k + icW) - (Id - Ip) W^2), in y: -i times that
(a wrong rotation or gyroscopic sign gives Id + Ip; a conjugated phasor turns the sign of the damping), and undamped
  conical whirl: Id w^2 - Ip W w - 2 a^2 k = 0, positive root whirls forward (y = -i x), negative root backward.

Physics flags. shear and rotary inertia: flags of ROSS's ShaftElement (Cowper's shear coefficient; `rotary_inertia` off
leaves the disks' Id, and leaves the shaft's gyroscopic matrix). gyroscopic off: flag of ShaftElement, and Ip = 0 of the disks.

Eigenvalues. det(lambda^2 M + lambda (C + W G) + K) = 0 with ROSS's assembled matrices, axial and torsional degrees of
freedom (uncoupled here) taken out; one of each conjugate pair, Im >= 0, the lowest by |lambda|. `whirl` is
sum 2 Im(x conj y) / sum (|x|^2 + |y|^2) over the nodes: +1 circular forward, -1 circular backward, 0 a plane motion.
"""
import json, math, sys, time, tomllib
from pathlib import Path

import numpy as np
import ross as rs
from scipy import linalg

LATERAL = (0, 1, 3, 4)  # x, y, rotation about x (= -dy/dz), rotation about y (= dx/dz); 2 is axial, 5 torsion
UNBALANCE = [(2.5e-4, 40.0), (4.0e-4, -115.0), (1.5e-4, 170.0), (3.0e-4, 75.0)]  # kg m, degrees, at unit scale, plane by plane
MAX_RPM = {"turbine": 12000.0, "kit": 6000.0, "overhung": 15000.0, "compressor": 12000.0}
SCALE = {"kit": 0.03}  # the kit is small


def mesh(t):
    """node positions and, for each element, its shaft segment"""
    stated = [x["position_m"] for key in ("disk", "bearing", "probe", "plane") for x in t.get(key, [])]
    stated += [x["position_m"] for run in t.get("run", []) for x in run.get("added_unbalance", [])]
    marks, start, nodes, segments = sorted({round(z, 9) for z in stated}), 0.0, [0.0], []
    for g in t["shaft"]:
        end = start + g["length_m"]
        cuts = [start] + [z for z in marks if start + 1e-9 < z < end - 1e-9] + [end]
        for a, b in zip(cuts, cuts[1:]):
            n = math.ceil((b - a) / (g["length_m"] / 2) - 1e-9)
            nodes += [a + (b - a) * i / n for i in range(1, n + 1)]
            segments += [g] * n
        start = end
        for c in t.get("coupling", []):
            if abs(c["position_m"] - end) < 1e-6 and "angular_stiffness_n_m_rad" in c:
                nodes.append(end)
                segments.append(c)
    return nodes, segments


def node(nodes, z):
    return min(range(len(nodes)), key=lambda i: abs(nodes[i] - z))


def coupling(c, n, gyroscopic):
    """Springs between its two nodes, half of the mass and inertias at either; its length is in none of its matrices,
    only run_static divides by it"""
    half = lambda key: c.get(key, 0.0) / 2
    k, r = c["lateral_stiffness_n_m"], c["angular_stiffness_n_m_rad"]
    m, i_d, i_p = half("mass_kg"), half("diametral_inertia_kg_m2"), half("polar_inertia_kg_m2") * gyroscopic
    return rs.CouplingElement(m_l=m, m_r=m, Ip_l=i_p, Ip_r=i_p, Id_l=i_d, Id_r=i_d, kt_x=k, kt_y=k, kr_x=r, kr_y=r,
                              L=1e-9, n=n, tag=c["name"])


def build(t, gyroscopic=True, rotary_inertia=True, shear_deformation=True):
    nodes, segments = mesh(t)
    flags = dict(shear_effects=shear_deformation, rotary_inertia=rotary_inertia, gyroscopic=gyroscopic)
    shaft = []
    for i, g in enumerate(segments):
        if "angular_stiffness_n_m_rad" in g:
            shaft.append(coupling(g, i, gyroscopic))
            continue
        E, nu = g["youngs_modulus_pa"], g["poisson_ratio"]
        steel = rs.Material(name="steel", rho=g["density_kg_m3"], E=E, G_s=E / (2 * (1 + nu)))
        inner, outer = g.get("inner_diameter_m", 0.0), g["outer_diameter_m"]
        shaft.append(rs.ShaftElement(nodes[i + 1] - nodes[i], inner, outer, material=steel, n=i, **flags))
    disks = [rs.DiskElement(n=node(nodes, d["position_m"]), m=d["mass_kg"], Id=d["diametral_inertia_kg_m2"],
                            Ip=d["polar_inertia_kg_m2"] if gyroscopic else 0.0) for d in t.get("disk", [])]
    bearings = [rs.BearingElement(n=node(nodes, b["position_m"]),
                                  **{"k" + a: v for a, v in b["stiffness_n_m"].items()},
                                  **{"c" + a: v for a, v in b["damping_n_s_m"].items()}) for b in t["bearing"]]
    return nodes, rs.Rotor(shaft, disks, bearings)


def response(t, nodes, rotor, rpm, unbalance):
    """phasor of every probe at every speed, m"""
    planes = [node(nodes, p["position_m"]) for p in t["plane"]]
    magnitudes, angles = [u for u, _ in unbalance], [math.radians(a) for _, a in unbalance]
    q = rotor.run_unbalance_response(planes, magnitudes, angles, frequency=np.array(rpm) * math.pi / 30).forced_resp
    Y = []
    for p in t["probe"]:
        i, b = 6 * node(nodes, p["position_m"]), math.radians(p["angle_deg"])
        Y.append(q[i] * math.cos(b) + q[i + 1] * math.sin(b))
    return Y


def response_json(t, Y, rpm, unbalance):
    return dict(
        unbalance=[dict(plane=p["name"], magnitude_kg_m=u, angle_deg=a) for p, (u, a) in zip(t["plane"], unbalance)],
        speed_rpm=list(rpm),
        probes=[dict(name=p["name"], cos_m=y.real.tolist(), sin_m=(-y.imag).tolist()) for p, y in zip(t["probe"], Y)])


def eigenvalues(rotor, rpm, damped=True, count=8):
    W = rpm * math.pi / 30
    keep = [6 * i + j for i in range(rotor.ndof // 6) for j in LATERAL]
    M, K, C, G = (A[np.ix_(keep, keep)] for A in (rotor.M(W), rotor.K(W), rotor.C(W) * damped, rotor.G()))
    n = len(keep)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-linalg.solve(M, K), -linalg.solve(M, C + W * G)]])
    values, vectors = linalg.eig(A)
    size = abs(values)
    order = [i for i in np.argsort(size) if values[i].imag >= -1e-9 * size[i]][:count]
    out = []
    for i in order:
        x, y = vectors[0:n:4, i], vectors[1:n:4, i]
        whirl = 2 * np.sum((x * y.conj()).imag) / np.sum(abs(x) ** 2 + abs(y) ** 2)
        out.append(dict(re=float(values[i].real), im=float(values[i].imag), whirl=round(float(whirl), 6)))
    return dict(speed_rpm=rpm, damped=damped, modes=out)


def verify():
    """closed form of a rigid rotor, see the docstring"""
    k, c, a, b, U, s, W = 1e5, 900.0, 0.4, 0.25, 1e-4, 0.7, 300.0
    where = [-a, -b, 0.0, b, a]
    stiff = rs.Material(name="stiff", rho=1000.0, E=2e16, G_s=8e15)
    shaft = [rs.ShaftElement(q - p, 0.0, 0.1, material=stiff) for p, q in zip(where, where[1:])]
    ms = 1000.0 * math.pi * 0.05**2 * 2 * a
    m, Id, Ip = 10.0 + ms, 0.2 + ms * (3 * 0.05**2 + (2 * a) ** 2) / 12, 0.35 + ms * 0.05**2 / 2

    def rotor(c):
        ends = [rs.BearingElement(n=i, kxx=k, cxx=c) for i in (0, 4)]
        return rs.Rotor(shaft, [rs.DiskElement(n=2, m=10.0, Id=0.2, Ip=0.35)], ends)

    def near(got, want, what):
        if abs(got - want) > 1e-5 * abs(want):
            sys.exit(f"ROSS's convention is not ours: {what}, {got} instead of {want}")

    x = U * np.exp(1j * s) * W**2 / (2 * k + 2j * c * W - m * W**2)
    q = rotor(c).run_unbalance_response([2], [U], [s], frequency=np.array([W])).forced_resp[:, 0]
    near(q[12], x, "static unbalance, x"), near(q[13], -1j * x, "static unbalance, y")
    slope = 2 * b * U * np.exp(1j * s) * W**2 / (2 * a**2 * (k + 1j * c * W) - (Id - Ip) * W**2)
    q = rotor(c).run_unbalance_response([3, 1], [U, U], [s, s + math.pi], frequency=np.array([W])).forced_resp[:, 0]
    near(q[24], a * slope, "couple unbalance, x"), near(q[25], -1j * a * slope, "couple unbalance, y")
    near(q[16], slope, "couple unbalance, slope in x"), near(q[15], 1j * slope, "couple unbalance, rotation about x")
    modes = eigenvalues(rotor(0.0), W * 30 / math.pi, count=4)["modes"]
    root = math.sqrt((Ip * W) ** 2 + 8 * Id * a * a * k)
    near(max(z["im"] for z in modes if z["whirl"] > 0.99), (Ip * W + root) / (2 * Id), "conical mode, forward")
    near(min(z["im"] for z in modes if z["whirl"] < -0.99), (root - Ip * W) / (2 * Id), "conical mode, backward")


def reference(path):
    t = tomllib.loads(path.read_text())
    nodes, rotor = build(t)
    top = MAX_RPM.get(path.stem, 10000.0)
    unbalance = [(u * SCALE.get(path.stem, 1.0), a) for u, a in UNBALANCE[:len(t["plane"])]]
    rpm = np.linspace(0.05 * top, top, 39).tolist()
    out = dict(made_by=f"ROSS {rs.__version__}, numpy {np.__version__}", rotor=path.name, mesh_m=nodes,
               eigenvalues=[eigenvalues(rotor, 0.0, damped=False), eigenvalues(rotor, 0.0),
                            eigenvalues(rotor, 0.5 * top), eigenvalues(rotor, top)],
               response=response_json(t, response(t, nodes, rotor, rpm, unbalance), rpm, unbalance))
    if path.stem == "turbine":
        rpm, out["variations"] = np.linspace(0.1 * top, top, 10).tolist(), []
        for flag in ("gyroscopic", "rotary_inertia", "shear_deformation"):
            _, rotor = build(t, **{flag: False})
            Y = response(t, nodes, rotor, rpm, unbalance)
            out["variations"].append(dict(off=flag, eigenvalues=eigenvalues(rotor, top), response=response_json(t, Y, rpm, unbalance)))
    return out


def measure(path):
    """median of five; ROSS keeps the frequency response of each rotor (a repeat takes 14 ms), so its cache is emptied before each run"""
    t = tomllib.loads(path.read_text())
    nodes, rotor = build(t)
    planes = [node(nodes, p["position_m"]) for p in t["plane"]]
    W, seconds = np.arange(1500.0, 11501.0, 200.0) * math.pi / 30, []
    for _ in range(5):
        rotor._run_freq_response.cache_clear()
        start = time.perf_counter()
        rotor.run_unbalance_response(planes, [4e-4, 4e-4], [0.5, -0.8], frequency=W)
        seconds.append(time.perf_counter() - start)
    print(f"run_unbalance_response, {len(W)} speeds, {len(nodes)} nodes: median {sorted(seconds)[2] * 1e3:.1f} ms of", *(f"{s * 1e3:.1f}" for s in seconds))


if __name__ == "__main__":
    folders = [Path(a) for a in sys.argv[1:] if not a.startswith("--")]
    if len(folders) != 2:
        sys.exit(__doc__)
    verify()
    folders[1].mkdir(exist_ok=True)
    for path in sorted(folders[0].glob("*.toml")):
        text = json.dumps(reference(path))
        (folders[1] / f"{path.stem}.json").write_text(text + "\n")
        print(path.stem, len(text), "bytes")
    if "--time" in sys.argv:
        measure(folders[0] / "turbine.toml")
