"""EXTI: edges of lines to interrupts (RM0440, 16). Lines 0 to 15 are pins, 16 the supply's detector."""

from .peripheral import Peripheral

INTERRUPT_OF_LINE = {line: 6 + line for line in range(5)} | dict.fromkeys(range(5, 10), 23) | dict.fromkeys(range(10, 16), 40)
INTERRUPT_OF_LINE |= {16: 1, 21: 64, 22: 64, 29: 64, 30: 65, 31: 65}


class Exti(Peripheral):
    """0x40010400."""

    REGISTERS = {
        0x00: "IMR1", 0x04: "EMR1", 0x08: "RTSR1", 0x0C: "FTSR1", 0x10: "SWIER1", 0x14: "PR1",
        0x20: "IMR2", 0x24: "EMR2", 0x28: "RTSR2", 0x2C: "FTSR2", 0x30: "SWIER2", 0x34: "PR2",
    }  # fmt: skip
    RESET = {"IMR1": 0x1F840000, "IMR2": 0x04}

    def edge(self, line, is_rising):
        """Something changed on a line below 32."""
        if self.reg["RTSR1" if is_rising else "FTSR1"] >> line & 1:
            self._latch(1 << line)

    def write_SWIER1(self, value):
        self._latch(value)

    def write_PR1(self, value):
        self.reg["PR1"] &= ~value
        self._drive()

    def write_IMR1(self, value):
        self.reg["IMR1"] = value
        self._drive()

    def _latch(self, bits):
        self.reg["PR1"] |= bits
        if bits & self.reg["EMR1"]:
            self.chip.core.event_register = True
        self._drive()

    def _drive(self):
        active = {INTERRUPT_OF_LINE[line] for line in INTERRUPT_OF_LINE if self.reg["PR1"] & self.reg["IMR1"] & 1 << line}
        for interrupt in set(INTERRUPT_OF_LINE.values()):
            self.chip.exceptions.set_line(interrupt, interrupt in active)
