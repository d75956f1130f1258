"""Writes tests/import/export.parquet with pandas and pyarrow: a historian's export, as its Python client would save it.

    pip install pandas pyarrow && python tests/reference/make_parquet.py
"""

from pathlib import Path

import numpy as np
import pandas as pd

ROWS = 40
rows = np.arange(ROWS)
lost = rows == 7
amplitude_mil = 2.0 + 0.01 * rows
frame = pd.DataFrame({
    "Timestamp": pd.date_range("2026-03-01 06:00", periods=ROWS, freq="1h", tz="UTC"),
    "Machine": pd.Categorical(["K-101"] * ROWS),
    "Speed [rpm]": (11_000 + rows % 3).astype(np.int32),
    "load_mw": (30.0 + 0.1 * rows).astype(np.float32),
})
for probe, lag_deg in [("15X", 40.0), ("15Y", 130.0), ("16X", 75.0), ("16Y", 165.0)]:
    frame[f"{probe} 1X Ampl [mil pp]"] = np.where(lost, np.nan, amplitude_mil)
    frame[f"{probe} 1X Phase Lag [deg]"] = np.where(lost, np.nan, lag_deg + 0.05 * rows)
frame.to_parquet(Path(__file__).parent.parent / "import" / "export.parquet", index=False)
