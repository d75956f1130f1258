"""NUCLEO-G474RE: the chip, its crystal, LD2, a CAN wire at PA11 and PA12."""

from bisect import bisect_right

from .chip import Chip
from .rtt import Log
from .timeline import SECOND_NS
from .wire import Adapter, Wire

CRYSTAL_HZ = 24_000_000
LD2 = ("A", 5)


class Nucleo:
    """A board with a program in its flash, on a wire with an adapter that acknowledges. Off until :meth:`power_on`."""

    def __init__(self, image, wire=None, crystal_hz=CRYSTAL_HZ):
        """``image``: the ELF file as it is flashed. Boards on one wire share its time."""
        self.image, self.wire = image, wire
        self.chip = Chip(wire.timeline if wire else None)
        self.timeline = self.chip.timeline
        if wire is None:
            self.wire = Wire(self.timeline)
        self.wire.join(self.chip.fdcan)
        self.chip.rcc.hse_hz = crystal_hz
        self.chip.flash_image(image)
        self.log = Log(self.chip, image)
        self.chip.on_reset = self.log.restarted
        self.adapter = self.wire.join(Adapter())

    @property
    def now_s(self):
        return self.timeline.now_ns / SECOND_NS

    def power_on(self, seed=0):
        """``seed``: of what is in memory then."""
        self.chip.power_on(seed)
        return self

    def run(self, seconds):
        return self.chip.run(seconds)

    def led_is_on(self, time_s):
        """Whether LD2 was on."""
        letter, pin = LD2
        changes = [(at_ns, level) for at_ns, place, level in self.chip.gpio[letter].history if place == pin]
        place = bisect_right(changes, (time_s * SECOND_NS, True))
        return place > 0 and changes[place - 1][1]

    def led_flashes(self, start_s, end_s):
        """How often LD2 went on in a time."""
        letter, pin = LD2
        return sum(
            place == pin and level and start_s * SECOND_NS <= at_ns < end_s * SECOND_NS
            for at_ns, place, level in self.chip.gpio[letter].history
        )
