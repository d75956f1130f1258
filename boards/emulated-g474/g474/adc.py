"""ADC1: triggered scans of its inputs into DMA, and single conversions (RM0440, 21).

Samples are computed when somebody looks: at the next interrupt of the DMA channel, or when the program reads how far it is.
The values of a scan arrive together, when its last conversion ends.
"""

from .peripheral import Peripheral, field
from .timeline import SECOND_NS

REQUEST_ADC1 = 5
INTERRUPT = 18
INPUTS = {"PA0": 1, "PA1": 2, "PA2": 3, "PA3": 4, "PB14": 5, "PC0": 6, "PC1": 7, "PC2": 8, "PC3": 9, "PF0": 10,
          "PB12": 11, "PB1": 12, "PB11": 14, "PB0": 15}  # fmt: skip
VREFINT_CHANNEL, VREFINT_V = 18, 1.212
SAMPLE_CYCLES = (2.5, 6.5, 12.5, 24.5, 47.5, 92.5, 247.5, 640.5)
CONVERSION_CYCLES = 12.5
PRESCALERS = (1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256)
FULL_SCALE = 4096
START_NS, CALIBRATION_NS = 1_000, 5_000
ADEN, ADDIS, ADSTART, ADSTP, ADVREGEN, DEEPPWD, ADCAL = (1 << bit for bit in (0, 1, 2, 4, 28, 29, 31))
ADRDY, EOC, EOS, OVR = 1 << 0, 1 << 2, 1 << 3, 1 << 4
DMAEN, OVRMOD, CONT = 1 << 0, 1 << 12, 1 << 13
TRIGGERS = {4: "TIM3", 11: "TIM2", 12: "TIM4", 13: "TIM6", 14: "TIM15"}


class Adc(Peripheral):
    """0x50000000. :attr:`signals` gives the voltage at each pin as a function of the time in seconds."""

    REGISTERS = {
        0x00: "ISR", 0x04: "IER", 0x08: "CR", 0x0C: "CFGR", 0x10: "CFGR2", 0x14: "SMPR1", 0x18: "SMPR2", 0x20: "TR1",
        0x24: "TR2", 0x28: "TR3", 0x30: "SQR1", 0x34: "SQR2", 0x38: "SQR3", 0x3C: "SQR4", 0x40: "DR", 0x4C: "JSQR",
        0x60: "OFR1", 0x64: "OFR2", 0x68: "OFR3", 0x6C: "OFR4", 0xA0: "AWD2CR", 0xA4: "AWD3CR", 0xB0: "DIFSEL",
        0xB4: "CALFACT", 0xC0: "GCOMP",
    }  # fmt: skip
    RESET = {"CR": DEEPPWD, "CFGR": 1 << 31}
    CLOCK = ("AHB2ENR", 13)

    def __init__(self, chip, name, base):
        self.signals = {}
        self.is_broken = False
        self._plan = None
        super().__init__(chip, name, base)

    def reset(self):
        super().reset()
        self._scanned_ns = 0
        if self._plan:
            self._plan.cancel()
            self._plan = None
        self._drive()

    def break_down(self):
        """The converter converts no more."""
        self.catch_up()
        self.is_broken = True
        self.replan()

    # registers
    def write_CR(self, value):
        if value & ADCAL:
            value &= ~ADCAL
            self.timeline.now_ns += CALIBRATION_NS
        if value & ADDIS:
            value &= ~(ADEN | ADDIS)
        if value & ADEN and not self.reg["CR"] & ADEN:
            self.reg["ISR"] |= ADRDY
        if value & ADSTP:
            self.catch_up()
            value &= ~(ADSTP | ADSTART)
        is_started = value & ADSTART and not self.reg["CR"] & ADSTART
        self.reg["CR"] = value
        if is_started:
            self._scanned_ns = self.timeline.now_ns
            if not self._trigger_is_external():
                self.timeline.after(self._scan_ns(), self._software_scan)
        self.replan()

    def write_ISR(self, value):
        self.reg["ISR"] &= ~value
        self._drive()

    def write_CFGR(self, value):
        self.catch_up()
        self.reg["CFGR"] = value
        self.replan()

    def read_ISR(self):
        if self.reg["CR"] & ADSTART and not self._trigger_is_external():
            self.chip.spin(self.timeline.now_ns + self._scan_ns())
        return self.reg["ISR"]

    def read_DR(self):
        self.reg["ISR"] &= ~EOC
        return self.reg["DR"]

    def _drive(self):
        self.chip.exceptions.set_line(INTERRUPT, bool(self.reg["ISR"] & self.reg["IER"]))

    # times
    def clock_hz(self):
        common = self.chip.adc_common.reg["CCR"]
        mode = field(common, 16, 2)
        if mode:
            return self.chip.rcc.hclk_hz >> mode - 1
        return self.chip.rcc.adc12_hz // PRESCALERS[min(field(common, 18, 4), len(PRESCALERS) - 1)]

    def _ranks(self):
        length = field(self.reg["SQR1"], 0, 4) + 1
        places = [("SQR1", 6 * place) for place in range(1, 5)]
        places += [(f"SQR{number}", 6 * place) for number in (2, 3, 4) for place in range(5)]
        return [field(self.reg[register], low, 5) for register, low in places[:length]]

    def _timing(self):
        """(channel, end of its sampling behind the trigger in ns) of each rank, and the end of the scan."""
        hz = self.clock_hz()
        if not hz:
            return [], 0
        cycles, ranks = 0.0, []
        for channel in self._ranks():
            register, low = ("SMPR1", 3 * channel) if channel < 10 else ("SMPR2", 3 * (channel - 10))
            cycles += SAMPLE_CYCLES[field(self.reg[register], low, 3)]
            ranks.append((channel, cycles * SECOND_NS / hz))
            cycles += CONVERSION_CYCLES
        return ranks, int(cycles * SECOND_NS / hz)

    def _scan_ns(self):
        return max(self._timing()[1], START_NS)

    def _trigger_is_external(self):
        return field(self.reg["CFGR"], 10, 2) != 0

    def _trigger(self):
        """The timer whose updates start a scan, while scans are asked for."""
        is_on = self.reg["CR"] & ADSTART and not self.reg["ISR"] & OVR and not self.is_broken and self.clock_hz()
        if not is_on or not self._trigger_is_external():
            return None
        return self.chip.timers.get(TRIGGERS.get(field(self.reg["CFGR"], 5, 5)))

    # converting
    def _convert(self, channel, time_s):
        if channel == VREFINT_CHANNEL:
            volts = VREFINT_V
        else:
            signal = self.signals.get(channel)
            volts = signal(time_s) if signal else 0.0
        count = int(volts / self.chip.pwr.supply_v * FULL_SCALE + 0.5)
        return 0 if count < 0 else FULL_SCALE - 1 if count >= FULL_SCALE else count

    def catch_up(self):
        """Delivers what has been converted until now."""
        timer = self._trigger()
        if timer is None:
            return
        ranks, scan_ns = self._timing()
        times = timer.trigger_times(self._scanned_ns, self.timeline.now_ns - scan_ns)
        if not times:
            return
        self._scanned_ns = times[-1]
        values = self._scans(ranks, times)
        self.reg["DR"] = values[-1]
        if not self.reg["CFGR"] & DMAEN or not self.chip.request_dma(REQUEST_ADC1, values):
            self.reg["ISR"] |= EOC | EOS | OVR
            self._drive()

    def _scans(self, ranks, times):
        """Counts of several scans, one after the other."""
        values = [0] * (len(ranks) * len(times))
        for rank, (channel, offset_ns) in enumerate(ranks):
            convert = self._convert
            values[rank :: len(ranks)] = [convert(channel, (time_ns + offset_ns) * 1e-9) for time_ns in times]
        return values

    def _software_scan(self):
        if not self.reg["CR"] & ADSTART or self.is_broken:
            return
        ranks, _ = self._timing()
        values = self._scans(ranks, [self.timeline.now_ns])
        self.reg["DR"] = values[-1] if values else 0
        if self.reg["CFGR"] & DMAEN:
            self.chip.request_dma(REQUEST_ADC1, values)
        self.reg["ISR"] |= EOC | EOS
        if self.reg["CFGR"] & CONT:
            self.timeline.after(self._scan_ns(), self._software_scan)
        else:
            self.reg["CR"] &= ~ADSTART
        self._drive()

    def replan(self):
        """When the DMA channel will interrupt next."""
        if self._plan:
            self._plan.cancel()
            self._plan = None
        timer = self._trigger()
        left = self.chip.until_dma_interrupt(REQUEST_ADC1)
        if timer is None or left is None:
            return
        ranks, scan_ns = self._timing()
        due_ns = timer.trigger_time(self._scanned_ns, -(-left // len(ranks)))
        if due_ns is not None:
            self._plan = self.timeline.at(due_ns + scan_ns, self._due)

    def _due(self):
        self._plan = None
        self.catch_up()
        self.replan()


class AdcCommon(Peripheral):
    """0x50000300: what ADC1 and ADC2 share."""

    REGISTERS = {0x00: "CSR", 0x08: "CCR", 0x0C: "CDR"}
    CLOCK = ("AHB2ENR", 13)
