"""The banded solution of the desktop crate beside LAPACK's zgbsv on the same equations, and beside ROSS if it is installed.

usage: python lapack.py PROGRAM

PROGRAM  the built example banded_solve (cargo build --release -p rotor-edge-tests --example banded_solve)

Needs NumPy and SciPy; tests/reference/README.md says how ROSS 2.3.0 is installed. Prints times and ratios; above 1, the
desktop crate takes longer. BLAS is held to one thread, as the desktop crate uses one here. Three rounds; the median counts.

A call of zgbsv from Python costs about as much as that of one equation with one unknown, which is printed too.
"""
import os

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import json, math, statistics, subprocess, sys, tempfile, time, tomllib
from pathlib import Path

import numpy as np
from scipy.linalg import lapack, solve_banded

HALF_WIDTH, ROUNDS, REPETITIONS = 7, 3, 31
ROOT = Path(__file__).resolve().parents[2]


def median_us(call):
    times = []
    for _ in range(REPETITIONS):
        begun = time.perf_counter()
        call()
        times.append((time.perf_counter() - begun) * 1e6)
    return statistics.median(times)


def read(folder, name, speeds, columns):
    """numbers of one speed after the other, each a matrix in Fortran's order"""
    flat = np.fromfile(Path(folder, name), dtype="<c16").reshape(speeds, columns, -1)
    return [np.asfortranarray(part.T) for part in flat]


def zgbsv_all(bands, forces):
    for band, force in zip(bands, forces):
        lapack.zgbsv(HALF_WIDTH, HALF_WIDTH, band, force)


def solve_banded_all(bands, forces):
    for band, force in zip(bands, forces):
        solve_banded((HALF_WIDTH, HALF_WIDTH), band[HALF_WIDTH:], force, check_finite=False)


def lapack_times(folder, mesh):
    """µs a speed, and the largest relative difference of the motions"""
    nodes, speeds = mesh["nodes"], mesh["speeds"]
    bands = read(folder, f"{nodes}.band", speeds, 4 * nodes)
    forces, motions = (read(folder, f"{nodes}.{name}", speeds, mesh["columns"]) for name in ("force", "motion"))
    difference = 0.0
    for band, force, motion in zip(bands, forces, motions):
        *_, found, info = lapack.zgbsv(HALF_WIDTH, HALF_WIDTH, band, force)
        assert info == 0, f"zgbsv: {info}"
        difference = max(difference, np.linalg.norm(found - motion) / np.linalg.norm(motion))
    one = np.ones((1, 1), complex, order="F")
    return dict(
        zgbsv=median_us(lambda: zgbsv_all(bands, forces)) / speeds,
        solve_banded=median_us(lambda: solve_banded_all(bands, forces)) / speeds,
        call=median_us(lambda: [lapack.zgbsv(0, 0, one, one) for _ in range(speeds)]) / speeds,
        difference=difference)


def ross_times():
    """µs of ROSS for the unbalance response of the sample at the speeds of its run-up, model made and model given; None without ROSS"""
    sys.path.insert(0, str(ROOT / "tests/reference"))
    try:
        import make_ross_reference as reference
    except ImportError:
        return None
    drawing = tomllib.loads((ROOT / "tests/reference/rotors/turbine.toml").read_text())
    speeds = np.arange(1500.0, 11501.0, 200.0) * math.pi / 30

    def respond(nodes, rotor):
        rotor._run_freq_response.cache_clear()
        planes = [reference.node(nodes, plane["position_m"]) for plane in drawing["plane"]]
        rotor.run_unbalance_response(planes, [4e-4, 4e-4], [0.5, -0.8], frequency=speeds)

    made = reference.build(drawing)
    times = [[], []]
    for _ in range(5):
        for kept, call in zip(times, (lambda: respond(*made), lambda: respond(*reference.build(drawing)))):
            begun = time.perf_counter()
            call()
            kept.append((time.perf_counter() - begun) * 1e6)
    return len(made[0]), len(speeds), *map(statistics.median, times)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    rounds = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(ROUNDS):
            ours = json.loads(subprocess.run([sys.argv[1], folder], check=True, capture_output=True).stdout)
            rounds.append([mesh | lapack_times(folder, mesh) for mesh in ours])
    for index, mesh in enumerate(rounds[0]):
        middle = lambda value: statistics.median(value(one[index]) for one in rounds)
        print(f"{mesh['nodes']} nodes, {4 * mesh['nodes']} unknowns, {mesh['columns']} columns; µs a speed")
        for name in ("banded", "motion", "zgbsv", "solve_banded", "call"):
            print(f"  {name:13} {middle(lambda one: one[name]):8.1f}")
        for name in ("banded", "motion"):
            print(f"  {name} / zgbsv: {middle(lambda one: one[name] / one['zgbsv']):.2f}")
        print(f"  difference of the motions: {mesh['difference']:.1e}")
    ross = ross_times()
    if ross is None:
        return print("ROSS is not installed.")
    nodes, speeds, given, made = ross
    response = statistics.median(one[0]["response"] for one in rounds)
    print(f"Response at {speeds} speeds, {nodes} nodes: ROSS {given / 1e3:.1f} ms, {made / 1e3:.1f} ms with its model; "
          f"desktop crate {response / 1e3:.2f} ms with its model")
    print(f"  ROSS / desktop crate: {given / response:.0f}, {made / response:.0f} with the model of either")


if __name__ == "__main__":
    main()
