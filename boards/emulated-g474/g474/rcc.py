"""RCC: oscillators, PLL, prescalers, which peripherals have a clock, and why the chip was reset (RM0440, 7)."""

from .peripheral import Peripheral, field

HSI16_HZ = 16_000_000
LSI_HZ = 32_000
HSE_START_NS = 2_000_000
PLL_LOCK_NS = 40_000
HSION, HSIRDY, HSEON, HSERDY, HSEBYP, CSSON, PLLON, PLLRDY = (1 << bit for bit in (8, 10, 16, 17, 18, 19, 24, 25))
SW_HSI, SW_HSE, SW_PLL = 1, 2, 3
PLL_FROM_HSI, PLL_FROM_HSE = 2, 3
RESET_FLAGS = {"OBL": 25, "PIN": 26, "BOR": 27, "SFT": 28, "IWDG": 29, "WWDG": 30, "LPWR": 31}
RMVF = 1 << 23
CSSF = 1 << 8


class Rcc(Peripheral):
    """0x40021000. :attr:`hse_hz` is the crystal of the board, 0 if it is dead; it may die at any time."""

    REGISTERS = {
        0x00: "CR", 0x04: "ICSCR", 0x08: "CFGR", 0x0C: "PLLCFGR", 0x18: "CIER", 0x1C: "CIFR", 0x20: "CICR",
        0x28: "AHB1RSTR", 0x2C: "AHB2RSTR", 0x30: "AHB3RSTR", 0x38: "APB1RSTR1", 0x3C: "APB1RSTR2", 0x40: "APB2RSTR",
        0x48: "AHB1ENR", 0x4C: "AHB2ENR", 0x50: "AHB3ENR", 0x58: "APB1ENR1", 0x5C: "APB1ENR2", 0x60: "APB2ENR",
        0x68: "AHB1SMENR", 0x6C: "AHB2SMENR", 0x70: "AHB3SMENR", 0x78: "APB1SMENR1", 0x7C: "APB1SMENR2",
        0x80: "APB2SMENR", 0x88: "CCIPR", 0x90: "BDCR", 0x94: "CSR", 0x98: "CRRCR", 0x9C: "CCIPR2",
    }  # fmt: skip
    RESET = {"CR": HSION | HSIRDY, "CFGR": 5, "PLLCFGR": 0x1000, "AHB1ENR": 0x100, "ICSCR": 0x40000000}

    def __init__(self, chip, name, base):
        self.hse_hz = 0
        self._reset_flags = 0
        self._backup = 0
        self._hse_event = self._pll_event = None
        super().__init__(chip, name, base)
        for offset, register in self.REGISTERS.items():
            if "RSTR" in register:
                self._writers[offset] = lambda value, r=register: self._reset_peripherals(r, value)

    def reset(self):
        super().reset()
        for event in (self._hse_event, self._pll_event):
            if event:
                event.cancel()
        self._hse_event = self._pll_event = None
        self._compute()

    def note_reset(self, causes):
        """Flags of RCC_CSR; every reset drives the pin as well."""
        for cause in (*causes, "PIN"):
            self._reset_flags |= 1 << RESET_FLAGS[cause]

    def is_enabled(self, register, bit):
        return bool(self.reg[register] >> bit & 1)

    def revive_hse(self, hse_hz):
        """The crystal can swing again, and does so after a while if it is asked to."""
        self.hse_hz = hse_hz
        if self.reg["CR"] & HSEON:
            self._hse_event = self.timeline.after(HSE_START_NS, self._hse_started)

    def kill_hse(self):
        """The crystal stops. What runs from it stops too, unless the clock security system watches."""
        self.hse_hz = 0
        self.reg["CR"] &= ~HSERDY
        if self.reg["CR"] & CSSON:
            self.reg["CR"] &= ~(HSEON | PLLON | PLLRDY)
            self.reg["CFGR"] = self.reg["CFGR"] & ~0xF | SW_HSI | SW_HSI << 2
            self.reg["CR"] |= HSION | HSIRDY
            self.reg["CIFR"] |= CSSF
            self.chip.pend_nmi()
        elif field(self.reg["PLLCFGR"], 0, 2) == PLL_FROM_HSE:
            self.reg["CR"] &= ~PLLRDY
        self._compute()

    # oscillators
    def write_CR(self, value):
        old = self.reg["CR"]
        writable = HSION | 1 << 9 | HSEON | HSEBYP | CSSON | PLLON
        self.reg["CR"] = old & ~writable | value & writable
        if not value & HSION and field(self.reg["CFGR"], 2, 2) != SW_HSI:
            self.reg["CR"] &= ~HSIRDY
        elif value & HSION:
            self.reg["CR"] |= HSIRDY
        if not self.reg["CR"] & HSEON:
            self.reg["CR"] &= ~HSERDY
        elif not old & HSEON:
            self._hse_event = self.timeline.after(HSE_START_NS, self._hse_started)
        if not self.reg["CR"] & PLLON:
            self.reg["CR"] &= ~PLLRDY
        elif not old & PLLON:
            self._pll_event = self.timeline.after(PLL_LOCK_NS, self._pll_started)
        self._compute()

    def _hse_started(self):
        self._hse_event = None
        if self.reg["CR"] & HSEON and self.hse_hz:
            self.reg["CR"] |= HSERDY
            self._compute()

    def _pll_started(self):
        self._pll_event = None
        if self.reg["CR"] & PLLON and self._pll_input_hz():
            self.reg["CR"] |= PLLRDY
            self._compute()

    def read_CR(self):
        for on, ready, event in [(HSEON, HSERDY, self._hse_event), (PLLON, PLLRDY, self._pll_event)]:
            if self.reg["CR"] & (on | ready) == on:
                self.chip.spin(event and event.time_ns)
        return self.reg["CR"]

    def write_CFGR(self, value):
        switch = field(value, 0, 2)
        ready = {SW_HSI: HSIRDY, SW_HSE: HSERDY, SW_PLL: PLLRDY}.get(switch, 0)
        taken = switch if self.reg["CR"] & ready else field(self.reg["CFGR"], 2, 2)
        self.reg["CFGR"] = value & ~0xC | taken << 2
        self._compute()

    def write_PLLCFGR(self, value):
        self.reg["PLLCFGR"] = value
        self._compute()

    def write_CCIPR(self, value):
        self.reg["CCIPR"] = value
        self._compute()

    def write_CICR(self, value):
        self.reg["CIFR"] &= ~value
        if value & CSSF:
            self.chip.exceptions.pending.discard(2)

    def read_BDCR(self):
        return self._backup

    def write_BDCR(self, value):
        if self.chip.pwr.backup_is_writable():
            self._backup = value & ~2 | (value & 1) << 1
            if value >> 16 & 1:
                self._backup = 1 << 16
                self.chip.tamp.erase()

    def read_CSR(self):
        return self._reset_flags | self.reg["CSR"] & 1 | (self.reg["CSR"] & 1) << 1

    def write_CSR(self, value):
        self.reg["CSR"] = value & 1
        if value & RMVF:
            self._reset_flags = 0

    def read_CRRCR(self):
        return self.reg["CRRCR"] | (self.reg["CRRCR"] & 1) << 1

    def _reset_peripherals(self, register, value):
        rising = value & ~self.reg[register]
        self.reg[register] = value
        enable = register.replace("RSTR", "ENR")
        for peripheral in self.chip.peripherals:
            if peripheral.CLOCK and peripheral.CLOCK[0] == enable and rising >> peripheral.CLOCK[1] & 1:
                peripheral.reset()

    # frequencies
    def _pll_input_hz(self):
        return {PLL_FROM_HSI: HSI16_HZ, PLL_FROM_HSE: self.hse_hz}.get(field(self.reg["PLLCFGR"], 0, 2), 0)

    def _pll_hz(self, enable, divider):
        if not (self.reg["CR"] & PLLRDY and self.reg["PLLCFGR"] & enable):
            return 0
        m, n = field(self.reg["PLLCFGR"], 4, 4) + 1, field(self.reg["PLLCFGR"], 8, 7)
        return self._pll_input_hz() // m * n // divider

    def pll_r_hz(self):
        return self._pll_hz(1 << 24, 2 * (field(self.reg["PLLCFGR"], 25, 2) + 1))

    def pll_q_hz(self):
        return self._pll_hz(1 << 20, 2 * (field(self.reg["PLLCFGR"], 21, 2) + 1))

    def pll_p_hz(self):
        plain = 17 if self.reg["PLLCFGR"] >> 17 & 1 else 7
        return self._pll_hz(1 << 16, field(self.reg["PLLCFGR"], 27, 5) or plain)

    def _compute(self):
        """All frequencies anew; 0 for what has no clock."""
        for peripheral in self.chip.peripherals:
            peripheral.clock_changed()
        hse_hz = self.hse_hz if self.reg["CR"] & HSERDY else 0
        sources = {SW_HSI: HSI16_HZ, SW_HSE: hse_hz, SW_PLL: self.pll_r_hz()}
        self.sysclk_hz = sources.get(field(self.reg["CFGR"], 2, 2), 0)
        ahb, apb1, apb2 = (field(self.reg["CFGR"], low, width) for low, width in ((4, 4), (8, 3), (11, 3)))
        ahb_shift = 0 if ahb < 8 else ahb - 7 if ahb < 12 else ahb - 6
        self.hclk_hz = self.sysclk_hz >> ahb_shift
        self.pclk1_hz, self.pclk2_hz = (self.hclk_hz >> max(apb - 3, 0) for apb in (apb1, apb2))
        self.timers1_hz, self.timers2_hz = (
            pclk_hz * (2 if apb >= 4 else 1) for pclk_hz, apb in ((self.pclk1_hz, apb1), (self.pclk2_hz, apb2))
        )
        self.fdcan_hz = (hse_hz, self.pll_q_hz(), self.pclk1_hz, 0)[field(self.reg["CCIPR"], 24, 2)]
        self.adc12_hz = (0, self.pll_p_hz(), self.sysclk_hz, 0)[field(self.reg["CCIPR"], 28, 2)]
        for peripheral in self.chip.peripherals:
            peripheral.clock_changed()
