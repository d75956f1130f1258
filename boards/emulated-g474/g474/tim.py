"""Timers that count up: update, compare, input capture, trigger output (RM0440, 28 to 31).

The counter is computed when it is looked at. Events are planned only for what interrupts, asks for DMA or triggers the
converter.
"""

from .peripheral import Peripheral, field
from .timeline import SECOND_NS

CEN, UDIS, URS, OPM, ARPE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 7
UIF, UG = 1, 1
TRGO_UPDATE = 2
FILTERS = ((1, 0), (1, 2), (1, 4), (1, 8), (2, 6), (2, 8), (4, 6), (4, 8), (8, 6), (8, 8), (16, 5), (16, 6), (16, 8),
           (32, 5), (32, 6), (32, 8))  # fmt: skip
"""Division of the clock and samples that must agree, by ICxF."""
CHANNELS = 4


class Timer(Peripheral):
    """One timer. Interrupts: all flags on one line, or updates on another where the chip has it so."""

    REGISTERS = {
        0x00: "CR1", 0x04: "CR2", 0x08: "SMCR", 0x0C: "DIER", 0x10: "SR", 0x14: "EGR", 0x18: "CCMR1", 0x1C: "CCMR2",
        0x20: "CCER", 0x24: "CNT", 0x28: "PSC", 0x2C: "ARR", 0x30: "RCR", 0x34: "CCR1", 0x38: "CCR2", 0x3C: "CCR3",
        0x40: "CCR4", 0x44: "BDTR", 0x48: "CCR5", 0x4C: "CCR6", 0x50: "CCMR3", 0x54: "DTR2", 0x58: "ECR",
        0x5C: "TISEL", 0x60: "AF1", 0x64: "AF2",
    }  # fmt: skip

    def __init__(self, chip, name, base, clock, interrupt, bits=16, requests=(), update_interrupt=None):
        """``requests``: DMA requests of channels 1 to 4 and of the update."""
        self.CLOCK, self.interrupt, self.update_interrupt = clock, interrupt, update_interrupt
        self.top = (1 << bits) - 1
        self.RESET = {"ARR": self.top}
        self.requests = requests
        self._plan = None
        super().__init__(chip, name, base)
        for channel in range(1, CHANNELS + 1):
            at = 0x30 + 4 * channel
            self._readers[at] = lambda c=channel: self._read_compare(c)
            self._writers[at] = lambda value, c=channel: self._write_compare(c, value)

    def reset(self):
        super().reset()
        self._since_ns, self._zero_ns, self._start_count, self._divider = 0, 0, 0, 1
        self._seen = 0
        self._skipped = [0] * (CHANNELS + 1)
        self._levels = {}
        self._hz = 0
        if self._plan:
            self._plan.cancel()
        self.clock_changed()

    # counting: `_seen` ticks since `_zero_ns`, where the count was `_start_count`
    def clock_changed(self):
        if not hasattr(self.chip.rcc, "timers1_hz"):
            return
        self._sync()
        self._rebase()
        self._hz = self.chip.rcc.timers2_hz if self.CLOCK[0] == "APB2ENR" else self.chip.rcc.timers1_hz
        self._replan()

    def is_running(self):
        return bool(self.reg["CR1"] & CEN and self._hz)

    def _ticks(self, time_ns):
        if not self.is_running():
            return 0
        return (time_ns - self._zero_ns) * self._hz // (SECOND_NS * self._divider)

    def _time_of(self, ticks):
        """When that many ticks have passed, not earlier."""
        return self._zero_ns - (-ticks * SECOND_NS * self._divider // self._hz)

    def _period(self):
        return self.reg["ARR"] + 1

    def count(self):
        return (self._start_count + self._ticks(self.timeline.now_ns)) % self._period()

    def _is_trigger(self):
        return field(self.reg["CR2"], 4, 3) == TRGO_UPDATE

    def _rebase(self, count=None):
        if self._is_trigger():
            self.chip.trigger_changes()
        self._start_count = self.count() if count is None else count
        self._zero_ns, self._seen = self.timeline.now_ns, 0

    def _is_input(self, channel):
        mode = self.reg["CCMR1" if channel <= 2 else "CCMR2"]
        return field(mode, 8 * ((channel - 1) % 2), 2) != 0

    def _sync(self):
        """Flags of what has happened since the last time."""
        ticks = self._ticks(self.timeline.now_ns)
        if ticks == self._seen:
            return
        period = self._period()
        before, after = self._start_count + self._seen, self._start_count + ticks
        self._seen = ticks
        if after // period != before // period and not self.reg["CR1"] & UDIS:
            self.reg["SR"] |= UIF
        for channel in range(1, CHANNELS + 1):
            compare = self.reg[f"CCR{channel}"]
            if compare < period and not self._is_input(channel):
                if (after - compare) // period != (before - compare) // period:
                    self.reg["SR"] |= 1 << channel
        if after // period != before // period:
            if self.reg["CR1"] & OPM:
                self._rebase(0)
                self.reg["CR1"] &= ~CEN
            elif self._divider != self.reg["PSC"] + 1:
                self._rebase()
                self._divider = self.reg["PSC"] + 1

    # registers
    def read_CNT(self):
        return self.count()

    def write_CNT(self, value):
        self._sync()
        self._rebase(value & self.top)
        self._replan()

    def write_CR1(self, value):
        self._sync()
        self._rebase()
        self.reg["CR1"] = value
        self._replan()

    def write_ARR(self, value):
        self._sync()
        self._rebase()
        self.reg["ARR"] = value & self.top
        self._replan()

    def write_EGR(self, value):
        self._sync()
        if value & UG:
            self._divider = self.reg["PSC"] + 1
            self._rebase(0)
            if not self.reg["CR1"] & (URS | UDIS):
                self.reg["SR"] |= UIF
        for channel in range(1, CHANNELS + 1):
            if value >> channel & 1:
                self.reg["SR"] |= 1 << channel
        self._replan()

    def read_SR(self):
        self._sync()
        return self.reg["SR"]

    def write_SR(self, value):
        self._sync()
        self.reg["SR"] &= value
        self._replan()

    def write_DIER(self, value):
        self._sync()
        self.reg["DIER"] = value
        self._replan()

    def write_CR2(self, value):
        self.reg["CR2"] = value
        self._replan()
        self.chip.requests_changed()

    def _read_compare(self, channel):
        self._sync()
        if self._is_input(channel):
            self.reg["SR"] &= ~(1 << channel)
            self._replan()
        return self.reg[f"CCR{channel}"]

    def _write_compare(self, channel, value):
        self._sync()
        if not self._is_input(channel):
            self.reg[f"CCR{channel}"] = value & self.top
        self._replan()

    # what happens by itself
    def _replan(self):
        if self._plan:
            self._plan.cancel()
            self._plan = None
        self._drive()
        if self._is_trigger():
            self.chip.requests_changed()
        if not self.is_running():
            return
        now, period = self._start_count + self._seen, self._period()
        wanted = []
        if self.reg["DIER"] & 0x101:
            wanted.append(period - now % period)
        for channel in range(1, CHANNELS + 1):
            if self.reg["DIER"] >> channel & 0x101 and not self._is_input(channel) and self.reg[f"CCR{channel}"] < period:
                wanted.append((self.reg[f"CCR{channel}"] - now) % period or period)
        if wanted:
            self._plan = self.timeline.at(self._time_of(self._seen + min(wanted)), self._due)

    def _due(self):
        self._plan = None
        self._sync()
        self._replan()

    def _drive(self):
        flags = self.reg["SR"] & self.reg["DIER"]
        if self.update_interrupt is None:
            self.chip.exceptions.set_line(self.interrupt, bool(flags & 0xFF))
        else:
            self.chip.exceptions.set_line(self.update_interrupt, bool(flags & 1))
            self.chip.exceptions.set_line(self.interrupt, bool(flags & 0xFE))

    def trigger_times(self, after_ns, until_ns):
        """Times of updates that are put out as a trigger (TRGO), in (after, until]."""
        if not self.is_running() or not self._is_trigger():
            return []
        period = self._period()
        first = (self._start_count + max(self._ticks(after_ns), 0)) // period + 1
        times = []
        while (time_ns := self._time_of(first * period - self._start_count)) <= until_ns:
            if time_ns > after_ns:
                times.append(time_ns)
            first += 1
        return times

    def trigger_time(self, after_ns, number):
        """When the trigger comes for the ``number``th time after a time; ``None``: never."""
        if not self.is_running() or not self._is_trigger():
            return None
        period = self._period()
        first = (self._start_count + max(self._ticks(after_ns), 0)) // period + 1
        if self._time_of(first * period - self._start_count) <= after_ns:
            first += 1
        return self._time_of((first + number - 1) * period - self._start_count)

    def edge(self, input_channel, is_rising):
        """An edge at the timer's input TI1 to TI4: captured by the channels that listen to it, behind their filters."""
        self._levels[input_channel] = is_rising
        if not self.is_clocked() or not self.is_running():
            return
        self._sync()
        for channel in range(1, CHANNELS + 1):
            mode = field(self.reg["CCMR1" if channel <= 2 else "CCMR2"], 8 * ((channel - 1) % 2), 8)
            selection = mode & 3
            source = channel if selection == 1 else (channel - 1 ^ 1) + 1 if selection == 2 else None
            control = field(self.reg["CCER"], 4 * (channel - 1), 4)
            if source != input_channel or not control & 1:
                continue
            is_both, is_falling = control & 0xA == 0xA, control & 0xA == 2
            if not is_both and is_falling == is_rising:
                continue
            self._skipped[channel] += 1
            if self._skipped[channel] < 1 << field(mode, 2, 2):
                continue
            self._skipped[channel] = 0
            divider, samples = FILTERS[field(mode, 4, 4)]
            delay_ns = round(divider * samples * SECOND_NS / self._hz)
            if delay_ns:
                captured = lambda c=channel: self._filtered(c, input_channel, is_rising)
                self.timeline.after(delay_ns, captured)
            else:
                self._capture(channel)
        self._replan()

    def _filtered(self, channel, input_channel, level):
        """The level has lasted for the filter's samples, or has not."""
        if self._levels.get(input_channel) == level and self.is_running():
            self._sync()
            self._capture(channel)
            self._replan()

    def _capture(self, channel):
        self.reg[f"CCR{channel}"] = self.count()
        if self.reg["SR"] >> channel & 1:
            self.reg["SR"] |= 0x100 << channel
        self.reg["SR"] |= 1 << channel
        if self.reg["DIER"] >> channel & 0x100 and len(self.requests) >= channel:
            self.chip.request_dma(self.requests[channel - 1], [self.reg[f"CCR{channel}"]])
            self.reg["SR"] &= ~(1 << channel)
