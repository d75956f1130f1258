"""FLASH: two banks of 256 KiB, erased by pages of 2 KiB, written by double words with an error code (RM0440, 5).

The second bank is read through here, word by word, so that errors are met when they are read. The first holds the
program and lies in unicorn's memory; errors there are watched for where they were put.
"""

from dataclasses import dataclass

from .peripheral import Peripheral, field

START, BANK_BYTES, PAGE_BYTES, WORD_BYTES = 0x08000000, 256 * 1024, 2048, 8
BANK_2 = START + BANK_BYTES
ERASED = b"\xff" * WORD_BYTES
ERASE_NS, PROGRAM_NS = 22_000_000, 82_000
KEYS = (0x45670123, 0xCDEF89AB)
PG, PER, MER1, BKER, MER2, STRT, EOPIE, ERRIE, LOCK = (1 << bit for bit in (0, 1, 2, 11, 15, 16, 24, 25, 31))
EOP, PROGERR, WRPERR, PGAERR, SIZERR, PGSERR, BSY = (1 << bit for bit in (0, 3, 4, 5, 6, 7, 16))
ECCIE, ECCC, ECCD, ECC_BANK_2 = 1 << 24, 1 << 30, 1 << 31, 1 << 21
INTERRUPT = 4
OPTR_AS_DELIVERED = 0xFFEFF8AA | 1 << 22
BOR_LEVEL_BIT = 8


@dataclass(frozen=True)
class Change:
    """An erasure (``data`` is ``None``) or a double word written."""

    time_ns: int
    address: int
    data: bytes | None


class Flash(Peripheral):
    """0x40022000. :attr:`history` keeps every change, so that any cut in power can be played afterwards."""

    REGISTERS = {
        0x00: "ACR", 0x04: "PDKEYR", 0x08: "KEYR", 0x0C: "OPTKEYR", 0x10: "SR", 0x14: "CR", 0x18: "ECCR", 0x20: "OPTR",
        0x24: "PCROP1SR", 0x28: "PCROP1ER", 0x2C: "WRP1AR", 0x30: "WRP1BR", 0x44: "PCROP2SR", 0x48: "PCROP2ER",
        0x4C: "WRP2AR", 0x50: "WRP2BR", 0x70: "SEC1R", 0x74: "SEC2R",
    }  # fmt: skip
    RESET = {"ACR": 0x00040600, "CR": 0xC0000000, "WRP1AR": 0x7F, "WRP1BR": 0x7F, "WRP2AR": 0x7F, "WRP2BR": 0x7F}
    CLOCK = ("AHB1ENR", 8)

    def __init__(self, chip, name, base):
        self.banks = [bytearray(b"\xff" * BANK_BYTES), bytearray(b"\xff" * BANK_BYTES)]
        self.double_errors, self.single_errors = set(), set()
        """Addresses of double words with an error that is seen when they are read."""
        self.history = []
        self.optr = OPTR_AS_DELIVERED | 4 << BOR_LEVEL_BIT
        super().__init__(chip, name, base)

    def reset(self):
        super().reset()
        self._busy_until_ns = 0
        self._half = None
        self._keys = 0
        self._busy_event = None

    def brown_out_level(self):
        return field(self.optr, BOR_LEVEL_BIT, 3)

    # registers
    def read_OPTR(self):
        return self.optr

    def write_ACR(self, value):
        self.reg["ACR"] = value & 0x4073F

    def write_KEYR(self, value):
        if self._keys < len(KEYS) and value == KEYS[self._keys]:
            self._keys += 1
            if self._keys == len(KEYS):
                self.reg["CR"] &= ~LOCK
                self._keys = 0
        else:
            self._keys = len(KEYS)  # locked until the next reset

    def read_SR(self):
        if self._is_busy():
            self.chip.spin(self._busy_until_ns)
        return self.reg["SR"] | (BSY if self._is_busy() else 0)

    def write_SR(self, value):
        self.reg["SR"] &= ~value
        self._drive()

    def write_CR(self, value):
        if self.reg["CR"] & LOCK:
            if value & ~self.reg["CR"] & (PG | PER | MER1 | MER2 | STRT):
                self.chip.unknown.add((self.name, "a write to CR while it is locked"))
            return
        self.reg["CR"] = value & ~STRT
        if value & STRT:
            self._erase(value)
        self._drive()

    def write_ECCR(self, value):
        self.reg["ECCR"] = self.reg["ECCR"] & ~(value & (0xF << 28)) & ~ECCIE | value & ECCIE
        self._drive()

    def _is_busy(self):
        return self.timeline.now_ns < self._busy_until_ns

    def _begin(self, address, duration_ns):
        self._busy_until_ns = self.timeline.now_ns + duration_ns
        self._busy_event = self.timeline.at(self._busy_until_ns, self._end)
        if address < BANK_2:
            # the program lies in this bank: its next instruction cannot be fetched before the end
            self.chip.stall(self._busy_until_ns)

    def _end(self):
        if self.reg["CR"] & EOPIE:
            self.reg["SR"] |= EOP
        self._drive()

    def _error(self, bits):
        self.reg["SR"] |= bits
        self._drive()

    def _drive(self):
        errors = self.reg["SR"] & (PROGERR | WRPERR | PGAERR | SIZERR | PGSERR)
        is_high = errors and self.reg["CR"] & ERRIE or self.reg["SR"] & EOP and self.reg["CR"] & EOPIE
        is_high = is_high or self.reg["ECCR"] & ECCIE and self.reg["ECCR"] & ECCC
        self.chip.exceptions.set_line(INTERRUPT, bool(is_high))

    # erasing and writing
    def _erase(self, value):
        if self.reg["SR"] & (PROGERR | WRPERR | PGAERR | SIZERR | PGSERR) or value & PG:
            self._error(PGSERR)
        elif value & PER:
            address = (BANK_2 if value & BKER else START) + PAGE_BYTES * field(value, 3, 7)
            self._change(Change(self.timeline.now_ns, address, None))
            self._begin(address, ERASE_NS)

    def program(self, address, size, value):
        """The program stores to flash: two words, lower address first, make a double word."""
        if self.reg["CR"] & LOCK or not self.reg["CR"] & PG:
            self._error(PGSERR)
        elif size != 4:
            self._error(SIZERR)
        elif address % WORD_BYTES == 0:
            self._half = address, value
        elif self._half is None or self._half[0] != address - 4:
            self._error(PGAERR)
        else:
            start, low = self._half
            self._half = None
            self._write(start, low.to_bytes(4, "little") + value.to_bytes(4, "little"))

    def _write(self, address, data):
        if self._is_busy():
            self.chip.stall(self._busy_until_ns)
        if self.peek(address) != ERASED and data != bytes(WORD_BYTES):
            self._error(PROGERR)
            return
        self._change(Change(self.timeline.now_ns, address, data))
        self._begin(address, PROGRAM_NS)

    def _change(self, change):
        self.history.append(change)
        self.apply(change)

    def apply(self, change):
        """Makes a change without taking time."""
        bank, offset = divmod(change.address - START, BANK_BYTES)
        length = PAGE_BYTES if change.data is None else WORD_BYTES
        self.banks[bank][offset : offset + length] = b"\xff" * length if change.data is None else change.data
        for errors in (self.double_errors, self.single_errors):
            errors.difference_update(range(change.address, change.address + length, WORD_BYTES))
        if bank == 0:
            self.chip.flash_changed()

    def tear(self, change, kept):
        """A change that power fails in: ``kept`` says what of each byte is there already, and the error code is not."""
        if change.data is None:
            words = range(change.address, change.address + PAGE_BYTES, WORD_BYTES)
        else:
            words = [change.address]
        for address in words:
            old = self.peek(address)
            new = change.data or ERASED
            torn = bytes(kept(before, after) for before, after in zip(old, new))
            if torn != old:
                self.apply(Change(self.timeline.now_ns, address, torn))
                self.double_errors.add(address)

    def peek(self, address):
        """The double word at an address, without a read of the chip."""
        bank, offset = divmod(address - START, BANK_BYTES)
        return bytes(self.banks[bank][offset : offset + WORD_BYTES])

    # reading
    def read_bank_2(self, offset, size):
        if self._is_busy() and self.history and self.history[-1].address >= BANK_2:
            self.chip.stall(self._busy_until_ns)
        self.check(BANK_2 + offset)
        return int.from_bytes(self.banks[1][offset : offset + size], "little")

    def check(self, address):
        """A double word is read: its error, if it has one, is reported with its address."""
        word = address & ~7
        if word in self.double_errors and not self.reg["ECCR"] & ECCD:
            self._report(word, ECCD)
            self.chip.pend_nmi()
        elif word in self.single_errors and not self.reg["ECCR"] & ECCC:
            self._report(word, ECCC)
            self._drive()

    def _report(self, word, mark):
        if not self.reg["ECCR"] & (ECCC | ECCD):
            bank, offset = divmod(word - START, BANK_BYTES)
            place = offset | (ECC_BANK_2 if bank else 0)
            self.reg["ECCR"] = self.reg["ECCR"] & ECCIE | self.reg["ECCR"] & (ECCC | ECCD) | place
        self.reg["ECCR"] |= mark
