"""Writes tests/extract/*.mat with SciPy: the recording of tests/extract/mod.rs, as MATLAB would save it.

    pip install scipy && python tests/reference/make_mat.py
"""

from pathlib import Path

import numpy as np
from scipy.io import savemat

SPEED_RPM, RATE_HZ, SAMPLES = 11_000.0, 20_000.0, 1000
GAP_V, MV_UM, COUNT_V = -9.5, 7.87, 24.0 / 32_768.0
PLACE = Path(__file__).parent.parent / "extract"

turns = 0.37 + np.arange(SAMPLES) / RATE_HZ * SPEED_RPM / 60.0
from_mark = turns - np.round(turns)
key = np.clip(np.minimum(-6.0 + 80.0 * from_mark, -2.0 - 80.0 * (from_mark - 0.2)), -10.0, -2.0)


def volts(probe: int) -> np.ndarray:
    """Of a phasor of 50 + 12·probe µm that lags by 0.4 + 1.3·probe."""
    um = (50.0 + 12.0 * probe) * np.cos(2.0 * np.pi * turns - (0.4 + 1.3 * probe))
    return GAP_V + 1e-3 * MV_UM * um


volts_by_name = {"Brg15X": volts(0), "Brg15Y": volts(1), "Brg16X": volts(2), "Brg16Y": volts(3), "kph": key}
beside = {"Fs": RATE_HZ, "load_mw": 12.5, "comment": "day 126", "machine": {"stages": 3.0}, "poles": 1 + 2j}
singles = {name: values.astype(np.float32) for name, values in volts_by_name.items()}
savemat(PLACE / "volts.mat", beside | singles, do_compression=True)
counts = np.round(np.array(list(volts_by_name.values())) / COUNT_V).astype(np.int16)
savemat(PLACE / "counts.mat", {"ch": counts})
