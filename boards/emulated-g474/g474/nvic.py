"""The system control space: NVIC, exceptions and their priorities, SCB, SysTick, and the cycle counter of DWT."""

from .peripheral import Peripheral, field
from .timeline import SECOND_NS

RESET, NMI, HARD_FAULT, SVCALL, PENDSV, SYSTICK = 1, 2, 3, 11, 14, 15
INTERRUPTS = 102
FIRST_INTERRUPT = 16
LOWEST_PRIORITY = 256
FIXED_PRIORITIES = {RESET: -3, NMI: -2, HARD_FAULT: -1}
KEY = 0x05FA
SYSRESETREQ, SEVONPEND, ENABLE, TICKINT, COUNTFLAG = 1 << 2, 1 << 4, 1 << 0, 1 << 1, 1 << 16
RELOAD_BITS = 24


class Exceptions:
    """Which exceptions are pending, enabled and active. Interrupt ``n`` is exception ``16 + n``."""

    def __init__(self):
        self.on_pend = lambda: None
        self.reset()

    def reset(self):
        self.pending, self.enabled, self.lines = set(), {NMI, HARD_FAULT, SVCALL, PENDSV, SYSTICK}, set()
        self.priorities = dict.fromkeys(range(4, FIRST_INTERRUPT + INTERRUPTS), 0) | FIXED_PRIORITIES
        self.active = []

    def pend(self, exception):
        self.pending.add(exception)
        self.on_pend()

    def set_line(self, interrupt, is_high):
        """An interrupt line as a peripheral drives it; while high it pends again after each handler."""
        exception = FIRST_INTERRUPT + interrupt
        if not is_high:
            self.lines.discard(exception)
        elif exception not in self.lines:
            self.lines.add(exception)
            self.pend(exception)

    def is_ready(self):
        """Something is pending and enabled, whatever the masks say: what ends `wfi`."""
        return not self.pending.isdisjoint(self.enabled)

    def execution_priority(self):
        return min((self.priorities[exception] for exception in self.active), default=LOWEST_PRIORITY)

    def next(self, primask=0, basepri=0, faultmask=0):
        """The exception that is taken now, if any: a lower number is more urgent, equal ones by exception number."""
        ready = self.pending & self.enabled
        if not ready:
            return None
        ceiling = self.execution_priority()
        if basepri:
            ceiling = min(ceiling, basepri)
        if primask:
            ceiling = min(ceiling, 0)
        if faultmask:
            ceiling = min(ceiling, FIXED_PRIORITIES[HARD_FAULT])
        priority, exception = min((self.priorities[exception], exception) for exception in ready)
        return exception if priority < ceiling else None

    def enter(self, exception):
        self.pending.discard(exception)
        self.active.append(exception)

    def leave(self, exception):
        self.active.remove(exception)
        if exception in self.lines:
            self.pend(exception)


def _registers():
    named = {
        0x004: "ICTR", 0x010: "SYST_CSR", 0x014: "SYST_RVR", 0x018: "SYST_CVR", 0x01C: "SYST_CALIB",
        0xD00: "CPUID", 0xD04: "ICSR", 0xD08: "VTOR", 0xD0C: "AIRCR", 0xD10: "SCR", 0xD14: "CCR",
        0xD18: "SHPR1", 0xD1C: "SHPR2", 0xD20: "SHPR3", 0xD24: "SHCSR", 0xD28: "CFSR", 0xD2C: "HFSR",
        0xD34: "MMFAR", 0xD38: "BFAR", 0xD88: "CPACR", 0xD90: "MPU_TYPE", 0xD94: "MPU_CTRL",
        0xDF0: "DHCSR", 0xDFC: "DEMCR", 0xF34: "FPCCR", 0xF38: "FPCAR", 0xF3C: "FPDSCR",
    }  # fmt: skip
    for bank in range(4):
        for base, name in [(0x100, "ISER"), (0x180, "ICER"), (0x200, "ISPR"), (0x280, "ICPR"), (0x300, "IABR")]:
            named[base + 4 * bank] = f"{name}{bank}"
    return named | {0x400 + 4 * place: f"IPR{place}" for place in range((INTERRUPTS + 3) // 4)}


class SystemControl(Peripheral):
    """0xE000E000. The core asks :attr:`exceptions`; this is how the program sees and changes them."""

    REGISTERS = _registers()
    RESET = {"CPUID": 0x410FC241, "CCR": 0x200, "FPCCR": 0xC0000000, "MPU_TYPE": 0x800, "VTOR": 0, "ICTR": 3}

    def __init__(self, chip, name, base):
        self.exceptions = chip.exceptions
        self._tick = None
        super().__init__(chip, name, base)
        banks = {"ISER": self._enable, "ICER": self._disable, "ISPR": self._pend, "ICPR": self._unpend}
        for offset, register in self.REGISTERS.items():
            if register[:4] in banks:
                self._writers[offset] = lambda v, do=banks[register[:4]], b=int(register[4:]): self._each(v, b, do)
                chosen = "pending" if "SPR" in register or "CPR" in register else "enabled"
                self._readers[offset] = lambda c=chosen, b=int(register[4:]): self._bits(c, b)
            elif register.startswith("IABR"):
                self._readers[offset] = lambda b=int(register[4:]): self._bits("active", b)
            elif register.startswith(("IPR", "SHPR")):
                self._writers[offset] = lambda v, r=register: self._prioritise(r, v)

    def reset(self):
        super().reset()
        self.exceptions.reset()
        self._started_ns = 0
        if self._tick:
            self._tick.cancel()

    # interrupts
    def _each(self, value, bank, do):
        for bit in range(32):
            if value >> bit & 1:
                do(FIRST_INTERRUPT + 32 * bank + bit)

    def _bits(self, which, bank):
        chosen = getattr(self.exceptions, which)
        return sum(1 << bit for bit in range(32) if FIRST_INTERRUPT + 32 * bank + bit in chosen)

    def _enable(self, exception):
        self.exceptions.enabled.add(exception)

    def _disable(self, exception):
        self.exceptions.enabled.discard(exception)

    def _pend(self, exception):
        self.exceptions.pend(exception)

    def _unpend(self, exception):
        if exception not in self.exceptions.lines or exception in self.exceptions.active:
            self.exceptions.pending.discard(exception)

    def _prioritise(self, register, value):
        """Four bits of priority, in the upper half of each byte."""
        value &= 0xF0F0F0F0
        self.reg[register] = value
        first = 4 * int(register[4:]) if register[0] == "S" else FIRST_INTERRUPT + 4 * int(register[3:])
        for place in range(4):
            self.exceptions.priorities[first + place] = field(value, 8 * place, 8)

    # control block
    def read_ICSR(self):
        active = self.exceptions.active[-1] if self.exceptions.active else 0
        pending = min(self.exceptions.pending, default=0)
        return active | pending << 12 | (PENDSV in self.exceptions.pending) << 28

    def write_ICSR(self, value):
        for bit, exception in [(31, NMI), (28, PENDSV), (26, SYSTICK)]:
            if value >> bit & 1:
                self.exceptions.pend(exception)
        for bit, exception in [(27, PENDSV), (25, SYSTICK)]:
            if value >> bit & 1:
                self.exceptions.pending.discard(exception)

    def write_AIRCR(self, value):
        if value >> 16 == KEY and value & SYSRESETREQ:
            self.chip.request_reset("SFT")

    def read_AIRCR(self):
        return 0xFA050000

    def write_CFSR(self, value):
        self.reg["CFSR"] &= ~value

    def write_HFSR(self, value):
        self.reg["HFSR"] &= ~value

    # SysTick, on the processor's clock
    def write_SYST_CSR(self, value):
        was_on = self.reg["SYST_CSR"] & ENABLE
        self.reg["SYST_CSR"] = value & 7
        if value & ENABLE and not was_on:
            self._started_ns = self.timeline.now_ns
        self._schedule_tick()

    def write_SYST_CVR(self, _):
        self._started_ns = self.timeline.now_ns
        self.reg["SYST_CSR"] &= ~COUNTFLAG
        self._schedule_tick()

    def read_SYST_CVR(self):
        if not self.reg["SYST_CSR"] & ENABLE:
            return 0
        period = self.reg["SYST_RVR"] + 1
        return (period - 1 - self._cycles_since(self._started_ns)) % period

    def _cycles_since(self, start_ns):
        return (self.timeline.now_ns - start_ns) * self.chip.rcc.hclk_hz // SECOND_NS

    def _schedule_tick(self):
        if self._tick:
            self._tick.cancel()
        if self.reg["SYST_CSR"] & ENABLE and self.reg["SYST_RVR"] and self.chip.rcc.hclk_hz:
            period = self.reg["SYST_RVR"] + 1
            turns = self._cycles_since(self._started_ns) // period + 1
            due_ns = self._started_ns - (-turns * period * SECOND_NS // self.chip.rcc.hclk_hz)
            self._tick = self.timeline.at(due_ns, self._on_tick)

    def _on_tick(self):
        self.reg["SYST_CSR"] |= COUNTFLAG
        if self.reg["SYST_CSR"] & TICKINT:
            self.exceptions.pend(SYSTICK)
        self._schedule_tick()

    def read_SYST_CSR(self):
        value = self.reg["SYST_CSR"]
        self.reg["SYST_CSR"] &= ~COUNTFLAG
        return value


class Dwt(Peripheral):
    """0xE0001000: the cycle counter. It counts virtual time, not cycles of this core's pipeline."""

    REGISTERS = {0x00: "CTRL", 0x04: "CYCCNT", 0xFB0: "LAR"}
    RESET = {"CTRL": 0x40000000}

    def reset(self):
        super().reset()
        self._zero_ns = 0

    def read_CYCCNT(self):
        if not self.reg["CTRL"] & ENABLE:
            return self.reg["CYCCNT"]
        cycles = (self.timeline.now_ns - self._zero_ns) * self.chip.rcc.hclk_hz // SECOND_NS
        return self.reg["CYCCNT"] + cycles & 0xFFFFFFFF

    def write_CYCCNT(self, value):
        self.reg["CYCCNT"] = value
        self._zero_ns = self.timeline.now_ns

    def write_CTRL(self, value):
        self.write_CYCCNT(self.read_CYCCNT())
        self.reg["CTRL"] = value
