"""The message RAM of FDCAN1: filters, elements of the FIFOs, transmit buffers (RM0440, 44.3.3)."""

from .peripheral import Peripheral, field
from .wire import Frame

BYTES = 0x350
STANDARD_FILTERS, EXTENDED_FILTERS, RX_FIFO_0, RX_FIFO_1, TX_BUFFERS = 0x000, 0x070, 0x0B0, 0x188, 0x278
ELEMENT_BYTES = 72
EXTENDED, REMOTE = 1 << 30, 1 << 29
RANGE, DUAL, CLASSIC, DISABLED = range(4)
STORE_IN_0, STORE_IN_1, REJECT, PRIORITY, PRIORITY_IN_0, PRIORITY_IN_1 = range(1, 7)
PLACES = {STORE_IN_0: 0, STORE_IN_1: 1, PRIORITY_IN_0: 0, PRIORITY_IN_1: 1}
NO_FILTER = 1 << 31


class MessageRam(Peripheral):
    """0x4000A400."""

    CLOCK = ("APB1ENR1", 25)

    def __init__(self, chip, name, base):
        self.bytes = bytearray(3 * BYTES)
        super().__init__(chip, name, base)

    def read(self, offset, size):
        return int.from_bytes(self.bytes[offset : offset + size], "little")

    def write(self, offset, size, value):
        self.bytes[offset : offset + size] = value.to_bytes(size, "little")

    def word(self, offset):
        return self.read(offset, 4)

    def transmit_frame(self, buffer):
        """The frame in a transmit buffer."""
        base = TX_BUFFERS + ELEMENT_BYTES * buffer
        first, second = self.word(base), self.word(base + 4)
        is_extended, is_remote = bool(first & EXTENDED), bool(first & REMOTE)
        identifier = first & 0x1FFFFFFF if is_extended else field(first, 18, 11)
        length = min(field(second, 16, 4), 8)
        data = b"" if is_remote else bytes(self.bytes[base + 8 : base + 8 + length])
        return Frame(identifier, data, is_extended, is_remote, length)

    def accepting(self, frame, rxgfc, xidam):
        """The FIFO that takes a frame and the filter's index; ``None``: none does."""
        if frame.is_remote and rxgfc >> (0 if frame.is_extended else 1) & 1:
            return None, NO_FILTER
        if frame.is_extended:
            filters = self._extended_filters(field(rxgfc, 24, 4), xidam)
        else:
            filters = self._standard_filters(field(rxgfc, 16, 5))
        for index, (action, matches) in enumerate(filters):
            if action and matches(frame.identifier):
                return PLACES.get(action), index
        unmatched = field(rxgfc, 2 if frame.is_extended else 4, 2)
        return (unmatched if unmatched < 2 else None), NO_FILTER

    def _standard_filters(self, number):
        for place in range(min(number, 28)):
            word = self.word(STANDARD_FILTERS + 4 * place)
            first, second = field(word, 16, 11), field(word, 0, 11)
            yield field(word, 27, 3), _matcher(field(word, 30, 2), first, second, 0x7FF)

    def _extended_filters(self, number, mask):
        for place in range(min(number, 8)):
            low, high = self.word(EXTENDED_FILTERS + 8 * place), self.word(EXTENDED_FILTERS + 8 * place + 4)
            kind = field(high, 30, 2)
            # the fourth kind is a range to which the mask of all extended identifiers does not apply
            masked = 0x1FFFFFFF if kind == DISABLED else mask
            yield field(low, 29, 3), _matcher(0 if kind == DISABLED else kind, low & 0x1FFFFFFF, high & 0x1FFFFFFF, masked)


def _matcher(kind, first, second, mask):
    if kind == RANGE:
        return lambda identifier: first <= identifier & mask <= second
    if kind == DUAL:
        return lambda identifier: identifier & mask in (first, second)
    if kind == CLASSIC:
        return lambda identifier: (identifier ^ first) & second == 0
    return lambda identifier: False


class Fifo:
    """A receive FIFO."""

    def __init__(self, memory, base, elements):
        self.memory, self.base, self.elements = memory, base, elements
        self.get = self.level = 0
        self.lost = 0

    def is_full(self):
        return self.level == self.elements

    def put(self, frame, timestamp, filter_index, overwrites):
        """Stores a frame; ``False`` if there is no room."""
        if self.is_full():
            self.lost += 1
            if not overwrites:
                return False
            self.release(self.get)
        base = self.base + ELEMENT_BYTES * ((self.get + self.level) % self.elements)
        identifier = frame.identifier | EXTENDED if frame.is_extended else frame.identifier << 18
        self.memory.write(base, 4, identifier | (REMOTE if frame.is_remote else 0))
        matched = filter_index if filter_index == NO_FILTER else filter_index << 24
        self.memory.write(base + 4, 4, matched | frame.dlc() << 16 | timestamp)
        self.memory.bytes[base + 8 : base + 16] = frame.data.ljust(8, b"\0")
        self.level += 1
        return True

    def release(self, index):
        """Elements up to this one are read."""
        released = (index - self.get) % self.elements + 1
        if released <= self.level:
            self.get = (index + 1) % self.elements
            self.level -= released

    def status(self):
        put = (self.get + self.level) % self.elements
        return self.level | self.get << 8 | put << 16 | self.is_full() << 24
