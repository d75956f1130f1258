"""A turning shaft in front of proximitors, wired to the board as its README says."""

import math

from .timeline import SECOND_NS

PROBE_OHM, REFERENCE_OHM, REFERENCE_V = 100_000.0, 13_700.0, 3.3
SCALE_V_UM = 7.87e-3
PROBE_PINS = ("PA0", "PA1", "PC1", "PC0")
KEYPHASOR_PIN = "PC2"
COMPARATOR_PIN = ("B", 10)
MARK_V, NOTCH_V, SHAFT_V = -12.0, -16.0, -9.0
NOTCH_S = 400e-6
OPEN_V = 0.0
"""At a proximitor whose cable is broken."""


def at_pin(proximitor_v):
    """The voltage at the converter's input, behind the level shift."""
    return (proximitor_v / PROBE_OHM + REFERENCE_V / REFERENCE_OHM) / (1 / PROBE_OHM + 1 / REFERENCE_OHM)


class Machine:
    """Turns at one speed. Everything may be changed while it turns, but for the speed, which starts anew at angle 0."""

    def __init__(self, board, speed_rpm, vectors_um, gaps_v=(-10.0,) * 4, second_um=0.0, edge_s=140e-6, noise_um=None):
        """``vectors_um``: (cos, sin) of each probe, u(t) = cos cos(Wt) + sin sin(Wt) from the mark on. ``second_um``:
        amplitude of twice the speed in all. ``edge_s``: how long the keyphasor's rise takes. ``noise_um()``: added to each
        sample."""
        self.board, self.vectors_um, self.gaps_v = board, list(vectors_um), list(gaps_v)
        self.second_um, self.edge_s, self.noise_um = second_um, edge_s, noise_um
        self.has_keyphasor = True
        self.set_speed(speed_rpm)
        for probe, pin in enumerate(PROBE_PINS):
            board.chip.connect(pin, lambda time_s, p=probe: at_pin(self.proximitor_v(p, time_s)))
        board.chip.connect(KEYPHASOR_PIN, lambda time_s: at_pin(self.keyphasor_v(time_s)))

    def set_speed(self, speed_rpm):
        self.speed_rpm = speed_rpm
        self._speed_rad_s = speed_rpm * math.tau / 60
        self._turn_s = 60 / speed_rpm
        self._start_s = self.board.now_s

    def grow(self, factor):
        """The vibration becomes so many times what it was."""
        self.vectors_um = [(factor * cos, factor * sin) for cos, sin in self.vectors_um]

    def proximitor_v(self, probe, time_s):
        gap_v = self.gaps_v[probe]
        if gap_v == OPEN_V:
            return OPEN_V
        cos, sin = self.vectors_um[probe]
        angle = self._speed_rad_s * (time_s - self._start_s)
        displacement_um = cos * math.cos(angle) + sin * math.sin(angle)
        if self.second_um:
            displacement_um += self.second_um * math.cos(2 * angle + 1)
        if self.noise_um:
            displacement_um += self.noise_um()
        return gap_v + SCALE_V_UM * displacement_um

    def keyphasor_v(self, time_s):
        """A notch whose end rises through the mark's voltage when the angle is 0."""
        if not self.has_keyphasor:
            return SHAFT_V
        since_s = (time_s - self._start_s + self._turn_s / 2) % self._turn_s - self._turn_s / 2
        slope = (SHAFT_V - NOTCH_V) / self.edge_s
        rising = MARK_V + slope * since_s
        falling = SHAFT_V - slope * (since_s + NOTCH_S)
        return min(max(rising, min(falling, SHAFT_V), NOTCH_V), SHAFT_V) if since_s > -NOTCH_S else SHAFT_V

    def compare(self):
        """A comparator at PB10: its output rises at each mark."""
        self._turns = math.floor((self.board.now_s - self._start_s) / self._turn_s) + 1
        self._at(self._turns * self._turn_s, True)

    def _at(self, since_start_s, level):
        self.board.timeline.at(round((self._start_s + since_start_s) * SECOND_NS), lambda: self._compared(level))

    def _compared(self, level):
        letter, pin = COMPARATOR_PIN
        self.board.chip.gpio[letter].drive(pin, level and self.has_keyphasor)
        self._turns += level
        self._at(self._turns * self._turn_s - (NOTCH_S if level else 0), not level)
