"""What all peripherals have in common: registers with the names of the reference manual (RM0440)."""


class Peripheral:
    """Registers by offset. A register ``X`` is plain storage unless the class has ``read_X()`` or ``write_X(value)``.

    A class states ``REGISTERS`` (offset to name), ``RESET`` (values after reset other than 0), ``CLOCK`` (register and bit
    of RCC that must be set, or ``None``) and ``RESET_BIT`` likewise.
    """

    REGISTERS = {}
    RESET = {}
    CLOCK = None

    def __init__(self, chip, name, base):
        self.chip, self.name, self.base = chip, name, base
        self.timeline = chip.timeline
        self.reg = {}
        self._readers = {}
        self._writers = {}
        for offset, register in self.REGISTERS.items():
            self._readers[offset] = getattr(self, f"read_{register}", None) or (lambda r=register: self.reg[r])
            self._writers[offset] = getattr(self, f"write_{register}", None) or (lambda v, r=register: self._store(r, v))
        self.reset()

    def reset(self):
        """As after a reset of the chip, or by RCC."""
        self.reg = {register: self.RESET.get(register, 0) for register in self.REGISTERS.values()}

    def clock_changed(self):
        """Called before and after a frequency changes."""

    def is_clocked(self):
        return self.CLOCK is None or self.chip.rcc.is_enabled(*self.CLOCK)

    def read(self, offset, size):
        word = self.read_word(offset & ~3)
        return word >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def read_word(self, offset):
        reader = self._readers.get(offset)
        if reader is None:
            self.chip.unknown.add((self.name, offset))
            return 0
        return reader() if self.is_clocked() else 0

    def write(self, offset, size, value):
        word = offset & ~3
        writer = self._writers.get(word)
        if writer is None:
            self.chip.unknown.add((self.name, word))
        elif self.is_clocked():
            if size != 4:
                value = self._merged(word, 8 * (offset & 3), 8 * size, value)
            writer(value)

    def _store(self, register, value):
        self.reg[register] = value & 0xFFFFFFFF

    def _merged(self, word, shift, bits, value):
        mask = (1 << bits) - 1 << shift
        return self.reg[self.REGISTERS[word]] & ~mask | value << shift & mask


def field(value, low, width):
    """``width`` bits of a register from bit ``low`` on."""
    return value >> low & (1 << width) - 1
