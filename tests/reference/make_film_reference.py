"""Reference answers of ROSS 2.3.0 for the oil films of the desktop crate.

usage: python make_film_reference.py OUT

OUT  folder that receives ross_short.csv, ross_statics.csv and ross_pad.csv

Three bearings of ROSS, all isothermal here, made nondimensional by S = mu N L D / W (R/c)^2 (N in rev/s), K c/W and C c Omega/W;
x to the right, y up, load along -y, rotation takes x into y; rows are the force:

ross_short    CylindricalBearing: closed form of the short bearing (Friswell et al., Dynamics of Rotating Machines, 2010, 5.5.1).
       `sommerfeld` is S (L/D)^2.
ross_statics  PlainJournal, flooded, two pads of 160 degrees, a lubricant whose viscosity does not change with temperature:
       finite volumes, negative pressures cut off (half Sommerfeld, not the Reynolds condition). Statics only: the force of
       the film at a stated place (`place_deg` from -y to the line of centres), from which S and the attitude follow. Its
       coefficients differ from Lund and Thomsen's table, which is isothermal too, by up to 36 % at S = 0.58.
ross_pad      TiltingPad, five pads, load between two, journal at a stated eccentricity of the set clearance: the force of a
       loaded pad, N. Its unloaded pads keep the tilt the search began with, and its coefficients couple x and y where the
       bearing is symmetric: neither is used.
"""
import csv, math, sys, warnings
from pathlib import Path

import numpy as np

warnings.simplefilter("ignore")
import ross as rs
from ross.bearings.plain_journal import PlainJournal
from ross.bearings.tilting_pad import TiltingPad

SHORT = ["eccentricity", "sommerfeld", "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"]
STATICS = ["kind", "length_ratio", "eccentricity", "place_deg", "sommerfeld", "attitude_deg"]
PAD = ["eccentricity", "push_n"]
MU, SPEED, D, C = 0.02, 300.0, 0.1, 1e-4
OIL = dict(liquid_viscosity1=MU, temperature1=313.15, liquid_viscosity2=MU * (1 - 1e-9), temperature2=373.15,
           liquid_density=860.0, liquid_specific_heat=1951.0, liquid_thermal_conductivity=0.13)


def short(load):
    length = 0.03
    b = rs.CylindricalBearing(n=0, speed=np.array([SPEED]), weight=load, bearing_length=length, journal_diameter=D,
                              radial_clearance=C, oil_viscosity=MU)
    s = MU * SPEED / (2 * math.pi) * length * D / load * (D / 2 / C) ** 2 * (length / D) ** 2
    e = float(b.eccentricity[0])
    value = lambda name: float(getattr(b, name)[0])
    k = [value("k" + a) * C / load for a in ("xx", "xy", "yx", "yy")]
    c = [value("c" + a) * C * SPEED / load for a in ("xx", "xy", "yx", "yy")]
    return [e, s, *k, *c]


def plain_journal(ratio, places):
    length = ratio * D
    b = PlainJournal(n=0, axial_length=length, journal_radius=D / 2, radial_clearance=C, elements_circumferential=80,
                     elements_axial=20, n_pad=2, pad_arc_length=160, preload=0, geometry="circular",
                     reference_temperature=50, frequency=[SPEED], fxs_load=0, fys_load=-1000.0, groove_factor=[1.0, 1.0],
                     lubricant=OIL, initial_guess=[0.5, -0.7], operating_type="flooded", oil_supply_pressure=0,
                     oil_flow_v=6e-4)
    for e, attitude in places:
        fx, fy = b._forces(np.array([e, math.radians(attitude - 90)]), SPEED)
        load = math.hypot(fx, fy)
        # from the direction of the load (against the force) to the line of centres
        line = math.radians(attitude - 90) - math.atan2(-fy, -fx)
        s = MU * SPEED / (2 * math.pi) * length * D / load * (D / 2 / C) ** 2
        turned = math.degrees(math.remainder(line, 2 * math.pi))
        yield ["plain_journal", ratio, e, attitude, s, turned]


def pad(eccentricity):
    preload = 0.3
    b = TiltingPad(n=0, frequency=[100 * math.pi], equilibrium_type="match_eccentricity", journal_diameter=D,
                   radial_clearance=C * (1 - preload), pad_thickness=0.0127,
                   pivot_angle=np.radians([18.0, 90.0, 162.0, 234.0, 306.0]), pad_arc=np.radians([57.6] * 5),
                   pad_axial_length=[D / 2] * 5, pre_load=[preload] * 5, offset=[0.5] * 5, lubricant=OIL,
                   oil_supply_temperature=313.15, eccentricity=eccentricity, attitude_angle=1.5 * math.pi,
                   load=[0.0, -3000.0], thermal_type="adiabatic", initial_pads_angles=[3e-4] * 5,
                   solver_options=dict(xtol=1e-9, ftol=1e-9, maxiter=20000))
    return [eccentricity, math.hypot(float(b.force_x_dim[3]), float(b.force_y_dim[3]))]


def write(path, head, rows):
    with open(path, "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(head)
        table.writerows([f"{v:.9g}" if isinstance(v, float) else v for v in row] for row in rows)


if __name__ == "__main__":
    out = Path(sys.argv[1])
    places = [(0.2, 70.0), (0.4, 57.0), (0.6, 44.0), (0.8, 31.0)]
    write(out / "ross_short.csv", SHORT, [short(load) for load in (20.0, 100.0, 400.0, 2000.0)])
    write(out / "ross_statics.csv", STATICS, [row for ratio in (0.5, 1.0) for row in plain_journal(ratio, places)])
    write(out / "ross_pad.csv", PAD, [pad(eccentricity) for eccentricity in (0.3, 0.6)])
