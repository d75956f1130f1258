"""What the program logs: the ring in memory that a debugger would empty (SEGGER's RTT)."""

import struct

import unicorn
from elftools.elf.elffile import ELFFile

from .chip import RAM
from .timeline import SECOND_NS

SYMBOL, MARK = "_SEGGER_RTT", b"SEGGER RTT"
UP_0 = 24
"""The first ring to the host: name, buffer, size, place of writing, place of reading, flags."""
PERIOD_NS = SECOND_NS // 50


class Log:
    """Empties the ring regularly and before each reset. :attr:`starts` holds the bytes of each start of the program."""

    def __init__(self, chip, image):
        self.chip = chip
        self.starts = [bytearray()]
        with open(image, "rb") as file:
            found = ELFFile(file).get_section_by_name(".symtab").get_symbol_by_name(SYMBOL)
        self._address = found[0]["st_value"] if found else None
        if self._address:
            self._empty_regularly()

    def _empty_regularly(self):
        self.empty()
        self.chip.timeline.after(PERIOD_NS, self._empty_regularly)

    def restarted(self):
        """The program begins anew."""
        self.empty()
        self.starts.append(bytearray())
        if self._address:
            self.chip.core.uc.mem_write(self._address, bytes(len(MARK)))

    def empty(self):
        """Takes what is there."""
        uc = self.chip.core.uc
        if not self._address or bytes(uc.mem_read(self._address, len(MARK))) != MARK:
            return
        ring = self._address + UP_0
        _, buffer, size, write, read = struct.unpack("<5I", uc.mem_read(ring, 20))
        if not RAM <= buffer or max(write, read) >= size:
            return
        try:
            data = bytes(uc.mem_read(buffer, size))
        except unicorn.UcError:
            return
        self.starts[-1] += data[read:write] if write >= read else data[read:] + data[:write]
        uc.mem_write(ring + 16, struct.pack("<I", write))
