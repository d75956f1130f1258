"""Unbalance of a rotor from its 1x vibration, and which physics its model lacks.

>>> import rotor_edge
>>> found = rotor_edge.compare("rotor.toml", "measured.csv")    # doctest: +SKIP
>>> found.verdict                                               # doctest: +SKIP
'misses'
"""

from . import answers
from ._native import Error, __version__
from .commands import (
    add,
    balance,
    balance_by_trials,
    check,
    compare,
    diagnose,
    estimate,
    forecast,
    identify,
    improve,
    plan,
    startup,
    track,
)
from .inputs import Measurement, Rotor, read_measurement, read_rotor
from .readers import extract, import_, import_rotor
from .simulation import simulate
from .tracker import Tracker

__all__ = [
    "Error",
    "Measurement",
    "Rotor",
    "Tracker",
    "__version__",
    "add",
    "answers",
    "balance",
    "balance_by_trials",
    "check",
    "compare",
    "diagnose",
    "estimate",
    "extract",
    "forecast",
    "identify",
    "import_",
    "import_rotor",
    "improve",
    "plan",
    "read_measurement",
    "read_rotor",
    "simulate",
    "startup",
    "track",
]
