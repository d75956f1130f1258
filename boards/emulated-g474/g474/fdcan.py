"""FDCAN1: classic frames, filters, message RAM, two receive FIFOs, three transmit buffers, error states (RM0440, 44)."""

from . import message_ram as ram
from .peripheral import Peripheral, field
from .timeline import SECOND_NS
from .wire import IDLE_SEQUENCES, OFF, PASSIVE, WARNING, Frame, Participant

INIT, CCE, ASM, CSA, CSR, MON, DAR, TEST = (1 << bit for bit in range(8))
RF0N, RF0F, RF0L, RF1N, RF1F, RF1L, HPM, TC, TCF, TFE = (1 << bit for bit in range(10))
EP_FLAG, EW_FLAG, BO_FLAG, PEA = 1 << 17, 1 << 18, 1 << 19, 1 << 21
LINE_GROUPS = (0x7, 0x38, 0x1C0, 0x1E00, 0xE000, 0x30000, 0xFC0000)
"""Bits of IR that each bit of ILS moves to the second line."""
EP, EW, BO, NO_CHANGE = 1 << 5, 1 << 6, 1 << 7, 7
INTERRUPTS = 21, 22
BUFFERS = FIFO_ELEMENTS = 3


class Fdcan(Peripheral, Participant):
    """0x40006400, and a participant of the wire."""

    REGISTERS = {
        0x00: "CREL", 0x04: "ENDN", 0x0C: "DBTP", 0x10: "TEST", 0x14: "RWD", 0x18: "CCCR", 0x1C: "NBTP", 0x20: "TSCC",
        0x24: "TSCV", 0x28: "TOCC", 0x2C: "TOCV", 0x40: "ECR", 0x44: "PSR", 0x48: "TDCR", 0x50: "IR", 0x54: "IE",
        0x58: "ILS", 0x5C: "ILE", 0x80: "RXGFC", 0x84: "XIDAM", 0x88: "HPMS", 0x90: "RXF0S", 0x94: "RXF0A",
        0x98: "RXF1S", 0x9C: "RXF1A", 0xC0: "TXBC", 0xC4: "TXFQS", 0xC8: "TXBRP", 0xCC: "TXBAR", 0xD0: "TXBCR",
        0xD4: "TXBTO", 0xD8: "TXBCF", 0xDC: "TXBTIE", 0xE0: "TXBCIE", 0xE4: "TXEFS", 0xE8: "TXEFA", 0x100: "CKDIV",
    }  # fmt: skip
    RESET = {
        "CREL": 0x32141218, "ENDN": 0x87654321, "DBTP": 0x00000A33, "CCCR": INIT, "NBTP": 0x06000A03, "TOCC": 0xFFFF0000,
        "TOCV": 0xFFFF, "XIDAM": 0x1FFFFFFF,
    }  # fmt: skip
    CLOCK = ("APB1ENR1", 25)

    def __init__(self, chip, name, base, memory):
        Participant.__init__(self, name)
        self.memory = memory
        self.is_stuck = False
        """A controller that takes frames and sends none."""
        Peripheral.__init__(self, chip, name, base)

    def reset(self):
        super().reset()
        self.transmit_errors = self.receive_errors = 0
        self.is_off = self.is_recovering = False
        self._last_error = NO_CHANGE
        self.fifos = [ram.Fifo(self.memory, base, FIFO_ELEMENTS) for base in (ram.RX_FIFO_0, ram.RX_FIFO_1)]
        self._requests = []
        """Transmit buffers in the order of their requests."""
        self._put = 0
        self._sending = None
        self._states = 0
        self._drive()

    # on the wire
    @property
    def bit_rate(self):
        nbtp = self.reg["NBTP"]
        quanta = 1 + (field(nbtp, 8, 8) + 1) + (field(nbtp, 0, 7) + 1)
        divider = max(2 * field(self.reg["CKDIV"], 0, 4), 1)
        return self.chip.rcc.fdcan_hz / divider / (field(nbtp, 16, 9) + 1) / quanta

    def is_on(self):
        is_there = self.is_clocked() and self.chip.rcc.fdcan_hz and self.chip.pins_are("A11", "A12", 9)
        return bool(is_there and not self.reg["CCCR"] & (INIT | CSR) and not self.is_off)

    def acknowledges(self):
        return self.is_on() and not self.reg["CCCR"] & MON

    def head(self):
        if self.is_stuck or not self._requests or self.reg["CCCR"] & (MON | ASM):
            return None
        return self.memory.transmit_frame(self._next_buffer())

    def _next_buffer(self):
        if self.reg["TXBC"] >> 24 & 1:
            return min(self._requests, key=lambda buffer: (self.memory.transmit_frame(buffer).identifier, buffer))
        return self._requests[0]

    def started(self, frame):
        self._sending = self._next_buffer()

    def sent(self, frame):
        super().sent(frame)
        buffer, self._sending = self._sending, None
        self.reg["TXBTO"] |= 1 << buffer
        self._finish(buffer, is_cancelled=self.reg["TXBCR"] >> buffer & 1)
        self._last_error = 0
        self._flag(TC if self.reg["TXBTIE"] >> buffer & 1 else 0)
        self._flag(0 if self._requests else TFE)
        self._note_states()

    def _finish(self, buffer, is_cancelled):
        self._requests.remove(buffer)
        self.reg["TXBCR"] &= ~(1 << buffer)
        if is_cancelled:
            self.reg["TXBCF"] |= 1 << buffer
            self._flag(TCF if self.reg["TXBCIE"] >> buffer & 1 else 0)

    def failed(self, error):
        super().failed(error)
        buffer, self._sending = self._sending, None
        self._last_error = error
        self._flag(PEA)
        if buffer in self._requests and (self.reg["CCCR"] & DAR or self.reg["TXBCR"] >> buffer & 1):
            self._finish(buffer, is_cancelled=True)
        self._note_states()

    def misheard(self, error):
        super().misheard(error)
        self._last_error = error
        self._flag(PEA)
        self._note_states()

    def heard(self, frame):
        super().heard(frame)
        self._last_error = 0
        self._note_states()
        place, filter_index = self.memory.accepting(frame, self.reg["RXGFC"], self.reg["XIDAM"])
        if place is None:
            return
        new, full, lost = ((RF0N, RF0F, RF0L), (RF1N, RF1F, RF1L))[place]
        overwrites = self.reg["RXGFC"] >> (9 - place) & 1
        if self.fifos[place].put(frame, self._timestamp(), filter_index, overwrites):
            self._flag(new | (full if self.fifos[place].is_full() else 0))
        else:
            self._flag(lost)

    def _note_states(self):
        """Warning, passive, bus-off, and their flags when one of them changes."""
        errors = max(self.transmit_errors, self.receive_errors)
        if self.transmit_errors >= OFF and not self.is_off:
            self.is_off = True
            self.reg["CCCR"] |= INIT
        states = (EW if errors >= WARNING else 0) | (EP if errors >= PASSIVE else 0) | (BO if self.is_off else 0)
        changed, self._states = states ^ self._states, states
        self._flag((EP_FLAG if changed & EP else 0) | (EW_FLAG if changed & EW else 0) | (BO_FLAG if changed & BO else 0))

    def _recover(self):
        self.is_recovering = False
        if self.reg["CCCR"] & INIT or not self.is_off:
            return
        self.is_off = False
        self.transmit_errors = self.receive_errors = 0
        self._note_states()
        self.wire.kick()

    # registers
    def write_CCCR(self, value):
        old = self.reg["CCCR"]
        if not value & INIT:
            value &= ~CCE
        value = value & ~CSA | (CSA if value & CSR else 0)
        if value & CCE and not old & CCE:
            self._requests.clear()
            self.reg["TXBTO"] = self.reg["TXBCF"] = 0
        self.reg["CCCR"] = value
        if old & INIT and not value & INIT:
            if self.is_off:
                if not self.is_recovering:
                    self.is_recovering = True
                    self.wire.when_idle(IDLE_SEQUENCES, self._recover)
            else:
                self.wire.kick()

    def read_ECR(self):
        passive = self.receive_errors >= PASSIVE
        return min(self.transmit_errors, 255) | min(self.receive_errors, 127) << 8 | passive << 15

    def read_PSR(self):
        error, self._last_error = self._last_error, NO_CHANGE
        return error | self._activity() << 3 | self._states

    def _activity(self):
        """Synchronising, idle, receiving or sending."""
        if self.reg["CCCR"] & INIT or self.is_recovering:
            return 0
        return 3 if self._sending is not None else 2 if self.wire.is_busy() else 1

    def read_TSCV(self):
        return self._timestamp()

    def _timestamp(self):
        if field(self.reg["TSCC"], 0, 2) != 1 or not self.bit_rate:
            return 0
        prescaler = field(self.reg["TSCC"], 16, 4) + 1
        return int(self.timeline.now_ns * self.bit_rate / SECOND_NS / prescaler) & 0xFFFF

    def write_IR(self, value):
        self.reg["IR"] &= ~value
        self._drive()

    def write_IE(self, value):
        self.reg["IE"] = value
        self._drive()

    def write_ILE(self, value):
        self.reg["ILE"] = value
        self._drive()

    def write_ILS(self, value):
        self.reg["ILS"] = value
        self._drive()

    def read_RXF0S(self):
        return self.fifos[0].status() | bool(self.reg["IR"] & RF0L) << 25

    def read_RXF1S(self):
        return self.fifos[1].status() | bool(self.reg["IR"] & RF1L) << 25

    def write_RXF0A(self, value):
        self.fifos[0].release(value & 7)

    def write_RXF1A(self, value):
        self.fifos[1].release(value & 7)

    def read_TXFQS(self):
        pending = len(self._requests)
        is_full = pending == BUFFERS
        if self.reg["TXBC"] >> 24 & 1:
            put = next((buffer for buffer in range(BUFFERS) if buffer not in self._requests), 0)
            return put << 16 | is_full << 21
        get = self._requests[0] if self._requests else self._put
        return BUFFERS - pending | get << 8 | self._put << 16 | is_full << 21

    def read_TXBRP(self):
        return sum(1 << buffer for buffer in self._requests)

    def read_TXBAR(self):
        return 0

    def write_TXBAR(self, value):
        if self.reg["CCCR"] & CCE:
            return
        for buffer in range(BUFFERS):
            if value >> buffer & 1 and buffer not in self._requests:
                self._requests.append(buffer)
                self._put = (buffer + 1) % BUFFERS
                for register in ("TXBTO", "TXBCF"):
                    self.reg[register] &= ~(1 << buffer)
        self.wire.kick()

    def write_TXBCR(self, value):
        for buffer in list(self._requests):
            if value >> buffer & 1:
                self.reg["TXBCR"] |= 1 << buffer
                if buffer != self._sending:
                    self._finish(buffer, is_cancelled=True)

    def read_TXBCF(self):
        if self._sending is not None and self.reg["TXBCR"] >> self._sending & 1:
            self.chip.spin(None)
        return self.reg["TXBCF"]

    def _flag(self, bits):
        if bits:
            self.reg["IR"] |= bits
            self._drive()

    def _drive(self):
        active = self.reg["IR"] & self.reg["IE"]
        second = sum(group for place, group in enumerate(LINE_GROUPS) if self.reg["ILS"] >> place & 1)
        for line, bits in enumerate((active & ~second, active & second)):
            self.chip.exceptions.set_line(INTERRUPTS[line], bool(bits and self.reg["ILE"] >> line & 1))
