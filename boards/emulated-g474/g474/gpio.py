"""GPIO: modes, outputs and their history, inputs driven from outside (RM0440, 9)."""

from .peripheral import Peripheral, field

INPUT, OUTPUT, ALTERNATE, ANALOG = range(4)


class Gpio(Peripheral):
    """One port. :attr:`history` keeps (time, pin, level) of each change of an output."""

    REGISTERS = {
        0x00: "MODER", 0x04: "OTYPER", 0x08: "OSPEEDR", 0x0C: "PUPDR", 0x10: "IDR", 0x14: "ODR", 0x18: "BSRR",
        0x1C: "LCKR", 0x20: "AFRL", 0x24: "AFRH", 0x28: "BRR",
    }  # fmt: skip

    def __init__(self, chip, name, base, place):
        self.CLOCK = ("AHB2ENR", place)
        self.letter = "ABCDEFG"[place]
        self.RESET = {"MODER": {"A": 0xABFFFFFF, "B": 0xFFFFFEBF}.get(self.letter, 0xFFFFFFFF)}
        self.history = []
        self.driven = {}
        super().__init__(chip, name, base)

    def mode(self, pin):
        return field(self.reg["MODER"], 2 * pin, 2)

    def alternate(self, pin):
        """The alternate function in use, or ``None``."""
        register = self.reg["AFRL" if pin < 8 else "AFRH"]
        return field(register, 4 * (pin % 8), 4) if self.mode(pin) == ALTERNATE else None

    def level(self, pin):
        """Level at the pin: as driven from outside, else as put out or pulled."""
        if self.mode(pin) == OUTPUT:
            return bool(self.reg["ODR"] >> pin & 1)
        return self.driven.get(pin, field(self.reg["PUPDR"], 2 * pin, 2) == 1)

    def drive(self, pin, level):
        """The outside world changes a level; timers that capture it and EXTI see the edge."""
        was = self.driven.get(pin, False)
        self.driven[pin] = level
        if was != level:
            self.chip.pin_changed(self.letter, pin, level)

    def read_IDR(self):
        return sum(self.level(pin) << pin for pin in range(16) if self.mode(pin) != ANALOG)

    def write_ODR(self, value):
        self._put(value & 0xFFFF)

    def write_BSRR(self, value):
        self._put(self.reg["ODR"] & ~(value >> 16) | value & 0xFFFF)

    def write_BRR(self, value):
        self._put(self.reg["ODR"] & ~value & 0xFFFF)

    def _put(self, value):
        changed = value ^ self.reg["ODR"]
        self.reg["ODR"] = value
        for pin in range(16):
            if changed >> pin & 1:
                self.history.append((self.timeline.now_ns, pin, bool(value >> pin & 1)))
