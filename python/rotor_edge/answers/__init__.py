"""What the commands answer: frozen dataclasses whose fields are the keys of the command line's JSON.

Units are in the names: ``_um`` µm zero to peak, ``_g_mm`` g·mm, ``_deg`` degrees with the rotation, ``_rpm`` revolutions a minute,
``_d`` days, ``_n_m`` N/m, ``_n`` N. Ratios and probabilities are of one; whatever has no unit in its name has none or says it."""

from .balance import Balance, TrialBalance
from .check import Check
from .compare import Comparison
from .diagnose import Addition, Diagnosis, Improvement
from .estimate import Estimates
from .extract import Extraction
from .forecast import Forecast
from .identify import Identification
from .imported import Import, ImportedRotor
from .plan import Plan
from .simulate import Simulation
from .startup import Startup
from .track import Track
from .tracker import Monitored, TrackerResult

__all__ = [
    "Addition",
    "Balance",
    "Check",
    "Comparison",
    "Diagnosis",
    "Estimates",
    "Extraction",
    "Forecast",
    "Identification",
    "Import",
    "ImportedRotor",
    "Improvement",
    "Monitored",
    "Plan",
    "Simulation",
    "Startup",
    "Track",
    "TrackerResult",
    "TrialBalance",
]
