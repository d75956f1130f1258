"""IWDG, on its own oscillator, and WWDG, on the peripherals' clock (RM0440, 42 and 43)."""

from .peripheral import Peripheral, field
from .rcc import LSI_HZ
from .timeline import SECOND_NS

KEY_START, KEY_RELOAD, KEY_WRITE = 0xCCCC, 0xAAAA, 0x5555


class Iwdg(Peripheral):
    """0x40003000. Once started, only a reset stops it; any clock but its own may be dead."""

    REGISTERS = {0x00: "KR", 0x04: "PR", 0x08: "RLR", 0x0C: "SR", 0x10: "WINR"}
    RESET = {"RLR": 0xFFF, "WINR": 0xFFF}

    def __init__(self, chip, name, base):
        self._expiry = None
        super().__init__(chip, name, base)

    def reset(self):
        super().reset()
        self.is_running = self._may_write = False
        self.fed_ns = 0
        if self._expiry:
            self._expiry.cancel()

    def timeout_ns(self):
        divider = 4 << min(self.reg["PR"] & 7, 6)
        return (self.reg["RLR"] + 1) * divider * SECOND_NS // LSI_HZ

    def write_KR(self, value):
        self._may_write = value == KEY_WRITE
        if value == KEY_START:
            self.is_running = True
        if value in (KEY_START, KEY_RELOAD) and self.is_running:
            self._reload(value == KEY_RELOAD)

    def _reload(self, is_refresh):
        left = self.reg["RLR"] - (self.timeline.now_ns - self.fed_ns) * LSI_HZ // SECOND_NS // (4 << min(self.reg["PR"] & 7, 6))
        if is_refresh and left > self.reg["WINR"]:
            self.chip.request_reset("IWDG")
            return
        self.fed_ns = self.timeline.now_ns
        if self._expiry:
            self._expiry.cancel()
        self._expiry = self.timeline.after(self.timeout_ns(), lambda: self.chip.request_reset("IWDG"))

    def write_PR(self, value):
        if self._may_write:
            self.reg["PR"] = value & 7

    def write_RLR(self, value):
        if self._may_write:
            self.reg["RLR"] = value & 0xFFF

    def write_WINR(self, value):
        if self._may_write:
            self.reg["WINR"] = value & 0xFFF

    def read_SR(self):
        return 0

    def read_KR(self):
        return 0


class Wwdg(Peripheral):
    """0x40002C00."""

    REGISTERS = {0x00: "CR", 0x04: "CFR", 0x08: "SR"}
    RESET = {"CR": 0x7F, "CFR": 0x7F}
    CLOCK = ("APB1ENR1", 11)
    INTERRUPT = 0

    def __init__(self, chip, name, base):
        self._expiry = self._early = None
        super().__init__(chip, name, base)

    def reset(self):
        super().reset()
        self._written_ns = 0
        self._cancel()
        self.chip.exceptions.set_line(self.INTERRUPT, False)

    def _cancel(self):
        for event in (self._expiry, self._early):
            if event:
                event.cancel()

    def _step_ns(self):
        return (4096 << field(self.reg["CFR"], 11, 3)) * SECOND_NS // max(self.chip.rcc.pclk1_hz, 1)

    def _counter(self):
        return field(self.reg["CR"], 0, 7) - (self.timeline.now_ns - self._written_ns) // self._step_ns()

    def read_CR(self):
        return self.reg["CR"] & 0x80 | max(self._counter(), 0) if self.reg["CR"] & 0x80 else self.reg["CR"]

    def write_CR(self, value):
        was_on = self.reg["CR"] & 0x80
        is_early = was_on and self._counter() > field(self.reg["CFR"], 0, 7)
        self.reg["CR"] = was_on | value & 0xFF
        self._written_ns = self.timeline.now_ns
        self._cancel()
        if self.reg["CR"] & 0x80:
            left = field(value, 0, 7) - 0x3F
            if is_early or left <= 0:
                self.chip.request_reset("WWDG")
                return
            self._early = self.timeline.after((left - 1) * self._step_ns(), self._warn)
            self._expiry = self.timeline.after(left * self._step_ns(), lambda: self.chip.request_reset("WWDG"))

    def _warn(self):
        self.reg["SR"] = 1
        self._drive()

    def write_CFR(self, value):
        self.reg["CFR"] = value | self.reg["CFR"] & 0x200
        self._drive()

    def write_SR(self, value):
        self.reg["SR"] &= value
        self._drive()

    def _drive(self):
        self.chip.exceptions.set_line(self.INTERRUPT, bool(self.reg["SR"] and self.reg["CFR"] & 0x200))
