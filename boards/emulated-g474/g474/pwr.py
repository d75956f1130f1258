"""PWR: the supply, its detector (PVD) and the lock of the backup domain (RM0440, 6); what the supply does to the chip."""

from .peripheral import Peripheral, field

PVD_THRESHOLD_V = (2.0, 2.2, 2.4, 2.5, 2.6, 2.8, 2.9)
PVD_HYSTERESIS_V = 0.1
BROWN_OUT_V = (1.66, 2.0, 2.2, 2.5, 2.8)
DBP = 1 << 8
PVDO, PVDE = 1 << 11, 1 << 0
PVD_EXTI_LINE = 16
VOS_RANGE_1 = 1 << 9


class Pwr(Peripheral):
    """0x40007000. :attr:`supply_v` is what the board gives."""

    REGISTERS = {
        0x00: "CR1", 0x04: "CR2", 0x08: "CR3", 0x0C: "CR4", 0x10: "SR1", 0x14: "SR2", 0x18: "SCR", 0x80: "CR5",
        **{0x20 + 4 * place: f"PUPD{place}" for place in range(14)},
    }  # fmt: skip
    RESET = {"CR1": VOS_RANGE_1, "CR3": 0x8000, "SR2": 0x100, "CR5": 0x100}
    CLOCK = ("APB1ENR1", 28)

    def __init__(self, chip, name, base):
        self.supply_v = 3.3
        super().__init__(chip, name, base)

    def reset(self):
        super().reset()
        self._detect()

    def backup_is_writable(self):
        return bool(self.reg["CR1"] & DBP)

    def set_supply(self, supply_v):
        """The supply sags or comes back; below the brown-out level of the option bytes the chip is in reset."""
        self.supply_v = supply_v
        self._detect()
        if self.is_browned_out():
            self.chip.hold_in_reset("BOR")

    def is_browned_out(self):
        return self.supply_v < BROWN_OUT_V[self.chip.flash.brown_out_level()]

    def write_CR2(self, value):
        self.reg["CR2"] = value
        self._detect()

    def _detect(self):
        select = field(self.reg["CR2"], 1, 3)
        was_low = bool(self.reg["SR2"] & PVDO)
        is_low = False
        if self.reg["CR2"] & PVDE and select < len(PVD_THRESHOLD_V):
            is_low = self.supply_v < PVD_THRESHOLD_V[select] + (PVD_HYSTERESIS_V if was_low else 0)
        self.reg["SR2"] = self.reg["SR2"] & ~PVDO | (PVDO if is_low else 0)
        if is_low != was_low:
            self.chip.exti.edge(PVD_EXTI_LINE, is_low)
