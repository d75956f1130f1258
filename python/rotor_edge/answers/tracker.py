"""Answer of a ``Tracker``: the controller's own numbers, of 32 bits.

Written by ``python/generate_answers.py`` from ``host-sim/src/answers/tracker.rs``."""

from dataclasses import dataclass

from ..record import Answer, Array, Record


@dataclass(frozen=True, eq=False)
class TrackerResult(Record):
    """A reading that was judged, as ``replay --json --answers`` prints it; bearings and probes count from 1. Unbalances are
    ``[U cos α, U sin α]``."""

    unbalance_g_mm: Array
    """A row a plane."""
    static_g_mm: Array
    dynamic_g_mm: Array
    """At plane 1; not a number with three planes or more."""
    e_um: float
    """Residual: Σ|model − measured| over cosines and sines of all probes."""
    ratio: float
    """The same relative to Σ|measured|."""
    flags: int
    """Bits of the result on the bus."""
    suspect: int | None
    """The bearing whose probes misfit most."""
    streak: int
    """Suspicious readings in a row."""
    probes_used: tuple[int, ...]
    floor_um: float
    """Residual below which nothing is suspicious."""
    level_um: float
    """Level above which a rise counts."""


@dataclass(frozen=True, eq=False, repr=False)
class Monitored(Answer):
    """What the monitor says of itself, and its result."""

    state: str
    """no_model, waiting, learning, tracking, suspicious, flagged, blind or stale."""
    reason: str
    cause: str
    """Why the flag was raised that is latched; none without one."""
    suspect: int | None
    """The bearing that was suspected then, from 1."""
    missing_probes: tuple[int, ...]
    age_s: float | None
    """Time since the last reading that was judged; None if there was none."""
    result: TrackerResult | None
    """None where no reading came, or it could not be judged."""
