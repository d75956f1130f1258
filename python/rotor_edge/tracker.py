"""The controller's core on the desk, for tests of one's own firmware."""

import json
from typing import Any, Mapping

import numpy as np

from . import _native
from .answers import Monitored
from .desk import desk
from .inputs import DataLike, RotorLike


class Tracker:
    """A monitor without a bus: the model that ``deploy`` would send, in the code that controllers run, a reading at a time.

    What it answers is to the bit what a controller answers to the same readings at the same times. It starts without memory of
    anything, at time zero."""

    def __init__(
        self,
        rotor: RotorLike,
        *,
        fastest_rpm: float | None = None,
        slow_roll: DataLike | None = None,
        thresholds: Mapping[str, float] | None = None,
        seed: int = 1,
    ) -> None:
        """rotor: one that was identified or improved. fastest_rpm: the highest speed that the machine reaches, rpm; if None that of
        the data that the rotor was fitted to. slow_roll: data whose runout the readings hold. thresholds: what it judges by, named as
        ``rotor-edge thresholds`` names it. seed: of the particle swarm."""
        settings = [f"{name}={value}" for name, value in (thresholds or {}).items()]
        with desk() as place:
            still = None if slow_roll is None else place.word(slow_roll)
            self._monitor = place.own(_native.Monitor, place.word(rotor), fastest_rpm, still, settings, seed)

    def read(self, time_s: float, speed_rpm: float, phasors_um: Any) -> Monitored:
        """What it makes of a reading.

        time_s: since the start, s; never less than before. phasors_um: ``cos − i sin`` of every probe, µm zero to peak, in the order
        of the rotor's file, as a row of ``Measurement.phasors_um``; not a number where a probe is lost."""
        phasors = np.asarray(phasors_um, dtype=complex)
        cos_sin_um = np.column_stack([phasors.real, -phasors.imag]).tolist()
        return _monitored(self._monitor.read(time_s, speed_rpm, cos_sin_um))

    def wait(self, time_s: float) -> Monitored:
        """What it says of itself when no reading has come until this time, s since the start."""
        return _monitored(self._monitor.wait(time_s))


def _monitored(answer: str) -> Monitored:
    return Monitored.of(json.loads(answer), json=answer)
