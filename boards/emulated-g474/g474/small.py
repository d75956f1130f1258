"""Peripherals of a few lines: backup registers, system configuration, request multiplexer, identification."""

from .peripheral import Peripheral

BACKUP_REGISTERS = 32


class Tamp(Peripheral):
    """0x40002400: the backup registers. They outlive every reset, and a power cut only with a battery at VBAT, which the
    NUCLEO does not have: its VBAT is the supply."""

    REGISTERS = {0x00: "CR1", 0x04: "CR2", 0x0C: "FLTCR", 0x2C: "IER", 0x30: "SR"} | {
        0x100 + 4 * place: f"BKP{place}R" for place in range(BACKUP_REGISTERS)
    }
    RESET = {"CR1": 0xFFFF0000}
    CLOCK = ("APB1ENR1", 10)

    def __init__(self, chip, name, base):
        self.backup = [0] * BACKUP_REGISTERS
        super().__init__(chip, name, base)
        for place in range(BACKUP_REGISTERS):
            self._readers[0x100 + 4 * place] = lambda p=place: self.backup[p]
            self._writers[0x100 + 4 * place] = lambda value, p=place: self._keep(p, value)

    def _keep(self, place, value):
        if self.chip.pwr.backup_is_writable():
            self.backup[place] = value

    def erase(self):
        self.backup = [0] * BACKUP_REGISTERS


class Rtc(Peripheral):
    """0x40002800: storage only; nothing counts."""

    REGISTERS = {offset: f"R{offset:02X}" for offset in range(0, 0x60, 4)}
    CLOCK = ("APB1ENR1", 10)


class Syscfg(Peripheral):
    """0x40010000: SYSCFG and the reference buffer behind it."""

    REGISTERS = {
        0x00: "MEMRMP", 0x04: "CFGR1", 0x08: "EXTICR1", 0x0C: "EXTICR2", 0x10: "EXTICR3", 0x14: "EXTICR4",
        0x18: "SCSR", 0x1C: "CFGR2", 0x20: "SWPR", 0x24: "SKR", 0x30: "VREFBUF_CSR", 0x34: "VREFBUF_CCR",
    }  # fmt: skip
    RESET = {"VREFBUF_CSR": 2}
    CLOCK = ("APB2ENR", 0)


class Dbgmcu(Peripheral):
    """0xE0042000."""

    REGISTERS = {0x00: "IDCODE", 0x04: "CR", 0x08: "APB1FZR1", 0x0C: "APB1FZR2", 0x10: "APB2FZR"}
    RESET = {"IDCODE": 0x2003_6469}
