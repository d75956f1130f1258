"""What a call costs besides its work, measured: of a command that ends at once, with a file and with data in memory."""

import statistics
import time

import numpy as np
import rotor_edge
from conftest import TURBINE

CALLS = 200


def cost(call):
    """Median and least of many calls, each refused as soon as the rotor is read; others on the machine show in the median."""
    took = []
    for _ in range(CALLS):
        begun = time.perf_counter()
        try:
            call()
        except rotor_edge.Error:
            pass
        took.append(time.perf_counter() - begun)
    return f"{1e3 * statistics.median(took):.2f} ms, {1e3 * min(took):.2f} at least"


def main():
    rotor = TURBINE / "rotor.toml"
    held, columns = rotor_edge.read_rotor(rotor), {"speed_rpm": np.linspace(1000, 2000, 51)}
    print(f"files: {cost(lambda: rotor_edge.compare(rotor, 'none.csv'))}")
    print(f"in memory: {cost(lambda: rotor_edge.compare(held, columns))}")
    print(f"of which the rotor is read: {cost(lambda: rotor_edge.read_rotor(rotor))}")


if __name__ == "__main__":
    main()
