"""Tables over speed of ROSS 2.3.0's own film bearings, for the machines that are compared with ROSS.

usage: python make_film_tables.py OUT

OUT  folder that receives <bearing>.csv: speed_rpm and the eight coefficients, N/m and N s/m, rows are the force;
     x to the right, y up, load along -y, rotation takes x into y

plain_*, lemon_*   PlainJournal, circular or elliptical, two pads of 160 degrees, oil that warms up in the film, coefficients
                   by perturbation at the speeds of SPEEDS
tilting_pad_*      TiltingPad at stated eccentricities under the load, oil of one viscosity; the force of such a film is
                   proportional to speed, so the speed at which it carries LOAD_N follows, and the solver is run again there

The coefficients are ROSS's, errors included: its equilibrium is found to a few percent only.
"""
import csv, math, sys, warnings
from pathlib import Path

import numpy as np

warnings.simplefilter("ignore")
from ross.bearings.plain_journal import PlainJournal
from ross.bearings.tilting_pad import TiltingPad

HEAD = ["kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"]
LOAD_N = 850.0
SPEEDS = {"plain": (1500, 2200, 3200, 4500, 6000, 8000), "lemon": (2000, 3000, 4200, 5600, 7200, 9500)}
ECCENTRICITIES = (0.5, 0.4, 0.31, 0.23, 0.16, 0.11, 0.075)
DIAMETER_M = 0.08


def journal(kind, length, clearance, preload):
    b = PlainJournal(n=0, axial_length=length, journal_radius=DIAMETER_M / 2, radial_clearance=clearance,
                     elements_circumferential=32, elements_axial=8, n_pad=2, pad_arc_length=160, preload=preload,
                     geometry="elliptical" if kind == "lemon" else "circular", reference_temperature=50,
                     frequency=np.array(SPEEDS[kind]) * math.pi / 30, fxs_load=0, fys_load=-LOAD_N,
                     groove_factor=[0.52, 0.48], lubricant="ISOVG32", initial_guess=[0.3, -0.6],
                     method="perturbation", operating_type="flooded", oil_supply_pressure=0, oil_flow_v=6e-4)
    return [[rpm, *(getattr(b, a)[i] for a in HEAD)] for i, rpm in enumerate(SPEEDS[kind])]


def tilting_pad(pivots, arc, preload, viscosity, clearance):
    oil = dict(liquid_viscosity1=viscosity, temperature1=313.15, liquid_viscosity2=viscosity * (1 - 1e-9), temperature2=373.15,
               liquid_density=860.0, liquid_specific_heat=1951.0, liquid_thermal_conductivity=0.13)
    each = lambda v: [v] * len(pivots)

    def solved(speed, eccentricity):
        return TiltingPad(n=0, frequency=[speed], equilibrium_type="match_eccentricity", journal_diameter=DIAMETER_M,
                          radial_clearance=clearance, pad_thickness=0.0127, pivot_angle=np.radians(pivots),
                          pad_arc=np.radians(each(arc)), pad_axial_length=each(DIAMETER_M / 2), pre_load=each(preload),
                          offset=each(0.5), lubricant=oil, oil_supply_temperature=313.15, nx=16, nz=16,
                          eccentricity=eccentricity, attitude_angle=1.5 * math.pi, load=[0.0, -LOAD_N],
                          thermal_type="adiabatic", initial_pads_angles=each(3e-4),
                          solver_options=dict(xtol=1e-9, ftol=1e-9, maxiter=4000))

    for eccentricity in ECCENTRICITIES:
        trial = 600.0
        speed = trial * LOAD_N / float(np.sum(solved(trial, eccentricity).force_y_dim))
        b = solved(speed, eccentricity)
        yield [speed * 30 / math.pi, *(float(getattr(b, a)[0]) for a in HEAD)]


BEARINGS = {
    "tilting_pad_a": lambda: tilting_pad((18.0, 90.0, 162.0, 234.0, 306.0), 60.0, 0.5, 0.02, 7e-5),
    "tilting_pad_b": lambda: tilting_pad((45.0, 135.0, 225.0, 315.0), 72.0, 0.4, 0.015, 6.5e-5),
    "plain_a": lambda: journal("plain", 0.05, 7e-5, 0),
    "plain_b": lambda: journal("plain", 0.04, 8e-5, 0),
    "lemon_a": lambda: journal("lemon", 0.05, 6e-5, 0.5),
    "lemon_b": lambda: journal("lemon", 0.06, 7e-5, 0.4),
}

if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for name, rows in BEARINGS.items():
        with open(Path(sys.argv[1]) / f"{name}.csv", "w", newline="") as out:
            table = csv.writer(out, lineterminator="\n")
            table.writerow(["speed_rpm", *HEAD])
            table.writerows([f"{v:.5g}" for v in row] for row in rows())
        print(name, flush=True)
