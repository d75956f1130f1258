"""DMA and its request multiplexer: single values or many at once, into a ring or not (RM0440, 12 and 13)."""

from .peripheral import Peripheral, field

CHANNELS = 8
EN, TCIE, HTIE, TEIE, CIRC, MINC = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 5, 1 << 7
GIF, TCIF, HTIF, TEIF = 1, 2, 4, 8


class DmaMux(Peripheral):
    """0x40020800: which peripheral's request goes to which channel."""

    REGISTERS = {4 * channel: f"C{channel}CR" for channel in range(16)} | {0x80: "CSR", 0x84: "CFR"}
    CLOCK = ("AHB1ENR", 2)

    def channels(self, request):
        return [channel for channel in range(16) if field(self.reg[f"C{channel}CR"], 0, 7) == request]


class Dma(Peripheral):
    """Channels that move a peripheral's values to memory. Memory to peripheral is not there."""

    REGISTERS = {0x00: "ISR", 0x04: "IFCR"} | {
        0x08 + 0x14 * channel + place: f"{name}{channel + 1}"
        for channel in range(CHANNELS)
        for place, name in [(0, "CCR"), (4, "CNDTR"), (8, "CPAR"), (12, "CMAR")]
    }

    def __init__(self, chip, name, base, number):
        self.CLOCK = ("AHB1ENR", number)
        self.interrupts = [11, 12, 13, 14, 15, 16, 17, 96] if number == 0 else [56, 57, 58, 59, 60, 97, 98, 99]
        super().__init__(chip, name, base)
        for channel in range(1, CHANNELS + 1):
            at = 0x08 + 0x14 * (channel - 1)
            self._readers[at + 4] = lambda c=channel: self._remaining(c)
            self._writers[at] = lambda value, c=channel: self._configure(c, value)
            self._writers[at + 4] = lambda value, c=channel: self._set_length(c, value)

    def reset(self):
        super().reset()
        self._length = [0] * (CHANNELS + 1)
        self._drive()

    def _remaining(self, channel):
        self.chip.adc.catch_up()
        return self.reg[f"CNDTR{channel}"]

    def read_ISR(self):
        self.chip.adc.catch_up()
        return self.reg["ISR"]

    def write_IFCR(self, value):
        for channel in range(CHANNELS):
            bits = field(value, 4 * channel, 4)
            self.reg["ISR"] &= ~((0xF if bits & GIF else bits) << 4 * channel)
            if not field(self.reg["ISR"], 4 * channel, 4) & ~GIF:
                self.reg["ISR"] &= ~(GIF << 4 * channel)
        self._drive()

    def _configure(self, channel, value):
        self.chip.adc.catch_up()
        was_on = self.reg[f"CCR{channel}"] & EN
        self.reg[f"CCR{channel}"] = value
        if value & EN and not was_on:
            self._length[channel] = self.reg[f"CNDTR{channel}"]
        self._drive()
        self.chip.requests_changed()

    def _set_length(self, channel, value):
        if not self.reg[f"CCR{channel}"] & EN:
            self.reg[f"CNDTR{channel}"] = value & 0xFFFF

    def is_on(self, channel):
        return bool(self.reg[f"CCR{channel}"] & EN and self.reg[f"CNDTR{channel}"])

    def until_interrupt(self, channel):
        """Transfers until the channel's next interrupt; ``None``: it asks for none."""
        control, left, length = self.reg[f"CCR{channel}"], self.reg[f"CNDTR{channel}"], self._length[channel]
        wanted = []
        if control & HTIE:
            wanted.append((left - (length - length // 2)) % length or length)
        if control & TCIE:
            wanted.append(left)
        return min(wanted, default=None)

    def transfer(self, channel, values):
        """Delivers values to memory, as many as the channel takes."""
        while values and self.is_on(channel):
            control, left, length = self.reg[f"CCR{channel}"], self.reg[f"CNDTR{channel}"], self._length[channel]
            size = 1 << field(control, 10, 2)
            part, values = values[:left], values[left:]
            done = length - left
            address = self.reg[f"CMAR{channel}"] + (size * done if control & MINC else 0)
            if control & MINC:
                data = b"".join(value.to_bytes(size, "little") for value in part)
            else:
                data = part[-1].to_bytes(size, "little")
            if not self.chip.write_memory(address, data):
                self.reg[f"CCR{channel}"] &= ~EN
                self._flag(channel, TEIF)
                return
            left -= len(part)
            if done < length // 2 <= length - left:
                self._flag(channel, HTIF)
            if left == 0:
                self._flag(channel, TCIF)
                left = length if control & CIRC else 0
            self.reg[f"CNDTR{channel}"] = left

    def fail(self, channel):
        """A transfer error."""
        self.reg[f"CCR{channel}"] &= ~EN
        self._flag(channel, TEIF)

    def _flag(self, channel, bits):
        self.reg["ISR"] |= (bits | GIF) << 4 * (channel - 1)
        self._drive()

    def _drive(self):
        for channel in range(1, CHANNELS + 1):
            flags = field(self.reg["ISR"], 4 * (channel - 1), 4)
            is_high = flags & self.reg[f"CCR{channel}"] & (TCIE | HTIE | TEIE)
            self.chip.exceptions.set_line(self.interrupts[channel - 1], bool(is_high))
