"""Rotors as ROSS 2.3.0 writes them, and their critical speeds, for the tests of `import-rotor`.

usage: python make_ross_rotors.py OUT

constant.toml   two bearings with constant coefficients, a cross-coupled seal and a hollow shaft
table.json      two bearings with tables over speed, kxy and kyx among them
supports.toml   a bearing on a support (n_link), which has no counterpart
critical_speeds.json   of the first two, undamped (dampers and antisymmetric stiffness out), from ROSS's matrices, rad/s
"""
import json, math, sys, warnings
from pathlib import Path

import numpy as np
import ross as rs
from scipy import linalg

STEEL = rs.Material(name="rotor_steel", rho=7810.0, E=2.11e11, G_s=8.12e10)
LATERAL = (0, 1, 3, 4)


def shaft(lengths, outer, inner=0.0):
    return [rs.ShaftElement(l, inner, o, material=STEEL, n=i) for i, (l, o) in enumerate(zip(lengths, outer))]


def constant():
    elements = shaft([0.1, 0.15, 0.15, 0.15, 0.15, 0.1], [0.06, 0.08, 0.1, 0.1, 0.08, 0.06], 0.01)
    disks = [rs.DiskElement(n=2, m=12.0, Id=0.07, Ip=0.12, tag="first"), rs.DiskElement(n=4, m=10.0, Id=0.05, Ip=0.09, tag="second")]
    bearings = [rs.BearingElement(n=0, kxx=4e7, kyy=6e7, kxy=1e6, kyx=-2e6, cxx=3e3, cyy=4e3, tag="drive end"),
                rs.BearingElement(n=6, kxx=5e7, cxx=3e3, tag="other end"),
                rs.SealElement(n=3, kxx=1e6, kxy=3e5, cxx=100.0, tag="seal")]
    return rs.Rotor(elements, disks, bearings)


def table():
    speeds = np.linspace(100.0, 1500.0, 8)
    rise = speeds / 800.0
    elements = shaft([0.2] * 6, [0.07] * 6)
    disks = [rs.DiskElement(n=3, m=30.0, Id=0.2, Ip=0.35, tag="wheel")]
    bearings = [rs.BearingElement(n=n, kxx=4e7 * rise**0.4, kyy=7e7 * rise**0.3, kxy=2e7 * rise**0.2, kyx=-3e7 * rise**0.2,
                                  cxx=5e4 * rise**-0.6, cyy=9e4 * rise**-0.7, frequency=speeds, tag=f"journal {n}") for n in (0, 6)]
    return rs.Rotor(elements, disks, bearings)


def supports():
    elements = shaft([0.25] * 4, [0.05] * 4)
    disks = [rs.DiskElement(n=2, m=8.0, Id=0.03, Ip=0.05, tag="disk")]
    bearings = [rs.BearingElement(n=0, kxx=1e7, cxx=500.0, n_link=5, tag="A"), rs.BearingElement(n=4, kxx=1e7, cxx=500.0, tag="B"),
                rs.BearingElement(n=5, kxx=5e7, cxx=100.0, tag="support")]
    return rs.Rotor(elements, disks, bearings, point_mass_elements=[rs.PointMass(n=5, m=4.0, tag="pedestal")])


def critical_speeds(rotor, count=4):
    """each at its own speed: the bearings are taken as they are there"""
    keep = [6 * i + j for i in range(rotor.ndof // 6) for j in LATERAL]

    def at(W):
        M, K, G = (A[np.ix_(keep, keep)] for A in (rotor.M(W), rotor.K(W), rotor.G()))
        mu = linalg.eigh(M - 1j * G, (K + K.T) / 2, eigvals_only=True)
        return np.sort(mu[mu > 0] ** -0.5)

    found = []
    for i in range(count):
        speed = at(500.0)[i]
        for _ in range(200):
            speed = at(speed)[i]
        found.append(float(speed))
    return found


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    warnings.simplefilter("ignore")
    folder = Path(sys.argv[1])
    for name, rotor in (("constant.toml", constant()), ("table.json", table()), ("supports.toml", supports())):
        (folder / name).unlink(missing_ok=True)
        rotor.save(folder / name)
    speeds = {name: critical_speeds(rotor) for name, rotor in (("constant.toml", constant()), ("table.json", table()))}
    (folder / "critical_speeds.json").write_text(json.dumps(speeds, indent=1) + "\n")
