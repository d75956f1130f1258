"""Rotors as ROSS 2.3.0 writes them, and their critical speeds, for the tests of `import-rotor`.

usage: python make_ross_rotors.py OUT

constant.toml   two bearings with constant coefficients, a cross-coupled seal and a hollow shaft
table.json      two bearings with tables over speed, kxy and kyx among them
supports.toml   a bearing on a support (n_link), which has no counterpart
coupling.json   two shafts that a coupling element with a length joins
layers.toml     a sleeve of steel and one of soft material on the shaft, as second elements between the same nodes
speed.toml      cylindrical bearings, whose table ROSS saves over `speed`
magnet.toml     a negative stiffness amid two bearings, a point mass on the shaft, a bearing with added mass, a tension
cone.toml       conical elements, hollow ones too
expected.json   of each: critical speeds, undamped (dampers and antisymmetric stiffness out), rad/s, where the bearings
                do not follow speed; damped eigenvalues at two speeds (knots of the tables), 1/s; from ROSS's matrices
"""
import json, sys, warnings
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


def table(speeds=np.linspace(100.0, 1500.0, 8)):
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


def coupling():
    left, right = shaft([0.3] * 3, [0.06] * 3), shaft([0.25] * 4, [0.05] * 4)
    for n, e in enumerate(right):
        e.n, e.n_l, e.n_r = 4 + n, 4 + n, 5 + n
    joint = rs.CouplingElement(m_l=2.5, m_r=2.5, Ip_l=0.01, Ip_r=0.01, Id_l=0.006, Id_r=0.006, kt_x=8e6, kt_y=8e6, kt_z=1e6, kr_x=9e3,
                               kr_y=9e3, kr_z=3e4, L=0.12, o_d=0.15, n=3, tag="discs")
    disks = [rs.DiskElement(n=1, m=14.0, Id=0.06, Ip=0.1, tag="motor"), rs.DiskElement(n=6, m=9.0, Id=0.03, Ip=0.05, tag="fan")]
    bearings = [rs.BearingElement(n=n, kxx=k, kyy=1.4 * k, cxx=900.0, cyy=1200.0, tag=f"bearing {n}")
                for n, k in ((0, 4e7), (2, 5e7), (5, 3e7), (8, 4e7))]
    return rs.Rotor(left + [joint] + right, disks, bearings)


def layers():
    soft = rs.Material(name="sleeve", rho=7810.0, E=6894.75, G_s=2651.0)
    sleeves = [rs.ShaftElement(0.2, 0.05, 0.08, material=STEEL, n=2), rs.ShaftElement(0.2, 0.05, 0.08, material=STEEL, n=3),
               rs.ShaftElement(0.2, 0.05, 0.12, material=soft, n=1)]
    disks = [rs.DiskElement(n=3, m=32.6, Id=0.178, Ip=0.33, tag="wheel")]
    bearings = [rs.BearingElement(n=n, kxx=1e7, kyy=1.3e7, cxx=100.0, tag=f"bearing {n}") for n in (0, 6)]
    return rs.Rotor(shaft([0.2] * 6, [0.05] * 6) + sleeves, disks, bearings)


def speed(speeds=np.linspace(50.0, 600.0, 8)):
    disks = [rs.DiskElement(n=3, m=32.6, Id=0.178, Ip=0.33, tag="wheel")]
    bearings = [rs.CylindricalBearing(n=n, speed=speeds, weight=525, bearing_length=0.03, journal_diameter=0.1, radial_clearance=0.1e-3,
                                      oil_viscosity=0.1, tag=f"journal {n}") for n in (0, 6)]
    return rs.Rotor(shaft([0.2] * 6, [0.05] * 6), disks, bearings)


def magnet():
    elements = [rs.ShaftElement(0.2, 0.0, 0.05, material=STEEL, n=i, axial_force=2e4) for i in range(6)]
    disks = [rs.DiskElement(n=4, m=20.0, Id=0.1, Ip=0.18, tag="wheel")]
    bearings = [rs.BearingElement(n=0, kxx=1e7, cxx=500.0, mxx=3.0, tag="A"), rs.BearingElement(n=3, kxx=-4e5, cxx=0.0, tag="motor"),
                rs.BearingElement(n=2, kxx=-1e5, kyy=-3e5, kxy=5e4, kyx=-5e4, cxx=20.0, cyy=30.0, tag="gap"),
                rs.BearingElement(n=6, kxx=1e7, cxx=500.0, tag="B")]
    return rs.Rotor(elements, disks, bearings, point_mass_elements=[rs.PointMass(n=3, m=4.0, tag="rotor of the motor")])


def cone():
    at = np.interp(np.linspace(0.0, 1.2, 13), [0.0, 0.2, 0.6, 0.8, 1.2], [0.05, 0.05, 0.06, 0.06, 0.05])
    elements = [rs.ShaftElement(0.1, 0.3 * l - 0.01, l, 0.3 * r - 0.01, r, material=STEEL, n=i) for i, (l, r) in enumerate(zip(at, at[1:]))]
    disks = [rs.DiskElement(n=6, m=20.0, Id=0.1, Ip=0.18, tag="wheel")]
    return rs.Rotor(elements, disks, [rs.BearingElement(n=n, kxx=1e7, cxx=500.0, tag=f"bearing {n}") for n in (0, 12)])


def lateral(rotor, W):
    shaft = 6 * len(rotor.nodes)
    keep = [6 * i + j for i in range(shaft // 6) for j in LATERAL]
    keep += [i + j for i in range(shaft, rotor.ndof, 3) for j in (0, 1)]  # a linked node has x, y, z only
    mass = np.diag(rotor.M(W))
    keep = [i for i in keep if mass[i] > 0]  # of a point mass on the shaft ROSS keeps coordinates that nothing moves
    return [A[np.ix_(keep, keep)] for A in (rotor.M(W), rotor.K(W), rotor.C(W), rotor.G())]


def critical_speeds(rotor, count=4):
    M, K, _, G = lateral(rotor, 0.0)
    mu = linalg.eigh(M - 1j * G, (K + K.T) / 2, eigvals_only=True)
    return np.sort(mu[mu > 0] ** -0.5)[:count].tolist()


def eigenvalues(rotor, W, count=6):
    M, K, C, G = lateral(rotor, W)
    n = len(M)
    values = linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-linalg.solve(M, K), -linalg.solve(M, C + W * G)]]))
    values = sorted((v for v in values if v.imag > 1e-6 * abs(v)), key=lambda v: v.imag)[:count]
    return dict(rad_s=W, values=[[float(v.real), float(v.imag)] for v in values])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    warnings.simplefilter("ignore")
    folder = Path(sys.argv[1])
    expected = {}
    makers = dict(constant=constant, table=table, supports=supports, coupling=coupling, layers=layers, speed=speed, magnet=magnet, cone=cone)
    for make in makers.values():
        name = make.__name__ + (".json" if make in (table, coupling) else ".toml")
        (folder / name).unlink(missing_ok=True)
        rotor = make()
        rotor.save(folder / name)
        # ROSS smooths a table (a spline that misses its own knots by up to 3e-5), so at a knot its bearings are made
        # anew with the coefficients that the table states there
        at = (lambda W: make(np.array([W]))) if make in (table, speed) else (lambda W: rotor)
        expected[name] = dict(modes=[eigenvalues(at(W), W) for W in ((50.0, 600.0) if make is speed else (500.0, 1100.0))])
        if make not in (table, speed):
            expected[name]["critical_speeds"] = critical_speeds(rotor)
    (folder / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")
