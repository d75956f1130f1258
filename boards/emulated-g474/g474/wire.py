"""A CAN wire: arbitration, acknowledge, errors and their confinement, bit by bit where that decides anything (ISO 11898-1).

Frames take the time of their bits, stuffing included. The wire is the same everywhere: there is no propagation.
"""

from dataclasses import dataclass
from functools import lru_cache

from .timeline import SECOND_NS

STUFF, FORM, ACKNOWLEDGE, BIT_RECESSIVE, BIT_DOMINANT, CRC = range(1, 7)
"""What was wrong, numbered as in FDCAN_PSR.LEC."""
PASSIVE, OFF, WARNING = 128, 256, 96
INTERMISSION_BITS, ERROR_FLAG_BITS, DELIMITER_BITS, SUSPEND_BITS = 3, 6, 8, 8
IDLE_BITS, IDLE_SEQUENCES = 11, 129
AFTER_CRC_BITS = 1 + 2 + 7
"""CRC delimiter, acknowledge, end of frame: never stuffed."""
CRC15 = 0x4599


@dataclass(frozen=True)
class Frame:
    """A classic frame."""

    identifier: int
    data: bytes = b""
    is_extended: bool = False
    is_remote: bool = False
    length: int | None = None

    def dlc(self):
        return len(self.data) if self.length is None else self.length


@lru_cache(maxsize=4096)
def bits(frame):
    """The bits from the start of the frame to the end of its CRC, before stuffing; 0 is dominant."""
    if frame.is_extended:
        low = frame.identifier & 0x3FFFF
        plain = f"0{frame.identifier >> 18:011b}11{low:018b}{frame.is_remote:b}00{frame.dlc():04b}"
    else:
        plain = f"0{frame.identifier:011b}{frame.is_remote:b}00{frame.dlc():04b}"
    if not frame.is_remote:
        plain += "".join(f"{byte:08b}" for byte in frame.data)
    crc = 0
    for bit in plain:
        is_one = (crc >> 14 & 1) != int(bit)
        crc = (crc << 1 & 0x7FFF) ^ (CRC15 if is_one else 0)
    return plain + f"{crc:015b}"


@lru_cache(maxsize=4096)
def stuffed(frame):
    """The same as it is sent: five equal bits are followed by another one."""
    sent, run = [], 0
    for bit in bits(frame):
        run = run + 1 if sent and sent[-1] == bit else 1
        sent.append(bit)
        if run == 5:
            sent.append("1" if bit == "0" else "0")
            run = 1
    return "".join(sent)


def frame_bits(frame):
    """Bits of a whole frame, without the intermission."""
    return len(stuffed(frame)) + AFTER_CRC_BITS


class Participant:
    """Somebody on a wire; an adapter that hears, acknowledges and sends nothing by itself."""

    bit_rate = None
    """Bits a second; ``None``: that of the wire."""

    def __init__(self, name):
        self.name, self.wire = name, None
        self.transmit_errors = self.receive_errors = 0
        self.resumes_ns = 0

    def is_on(self):
        return True

    def acknowledges(self):
        return self.is_on()

    def is_passive(self):
        return self.transmit_errors >= PASSIVE or self.receive_errors >= PASSIVE

    def head(self):
        """The frame that waits to be sent, or ``None``."""
        return None

    def started(self, frame):
        """This frame is on the wire."""

    def sent(self, frame):
        self.transmit_errors = max(self.transmit_errors - 1, 0)

    def heard(self, frame):
        if self.receive_errors > 0:
            self.receive_errors = min(self.receive_errors - 1, PASSIVE - 1)

    def failed(self, error):
        """What it sent was not a whole frame. An error-passive one whom nobody answers counts no further."""
        if not (error == ACKNOWLEDGE and self.is_passive()):
            self.transmit_errors += 8

    def misheard(self, error):
        self.receive_errors = min(self.receive_errors + 1, OFF - 1)


class Wire:
    """The bus. :attr:`is_shorted`: no dominant bit gets through. :attr:`log`: (end, name of the sender, frame)."""

    def __init__(self, timeline, bit_rate=500_000):
        self.timeline, self.bit_rate = timeline, bit_rate
        self.bit_ns = SECOND_NS // bit_rate
        self.participants = []
        self.is_shorted = False
        self.log, self.errors = [], []
        self.busy_ns = 0
        self._free_ns = 0
        self._is_busy = False
        self._next = None
        self._waiting = []

    def join(self, participant):
        self.participants.append(participant)
        participant.wire = self
        return participant

    def leave(self, participant):
        self.participants.remove(participant)
        participant.wire = None

    def kick(self):
        """Somebody has something to send."""
        if not self._is_busy and self._next is None:
            self._next = self.timeline.at(max(self._free_ns, self.timeline.now_ns), self._arbitrate)

    def is_busy(self):
        """A frame, or what became of it, is on the wire."""
        return self._is_busy

    def when_idle(self, sequences, action):
        """Calls back after so many times eleven recessive bits; every frame ends with one."""
        self._waiting.append([sequences, action])
        if len(self._waiting) == 1:
            self.timeline.after(IDLE_BITS * self.bit_ns, self._idle_tick)

    def _idle_tick(self):
        if not self._is_busy:
            self._idle_sequence()
        if self._waiting:
            self.timeline.after(IDLE_BITS * self.bit_ns, self._idle_tick)

    def _idle_sequence(self):
        for waiting in list(self._waiting):
            waiting[0] -= 1
            if waiting[0] == 0:
                self._waiting.remove(waiting)
                waiting[1]()

    def _rate_is_right(self, participant):
        return participant.bit_rate is None or abs(participant.bit_rate / self.bit_rate - 1) < 0.01

    def _arbitrate(self):
        self._next = None
        ready, later = [], []
        for participant in self.participants:
            frame = participant.head() if participant.is_on() else None
            if frame is not None:
                (ready if participant.resumes_ns <= self.timeline.now_ns else later).append((participant, frame))
        if not ready:
            if later:
                self._next = self.timeline.at(min(participant.resumes_ns for participant, _ in later), self._arbitrate)
            return
        strongest = min(_priority(frame) for _, frame in ready)
        senders = [(participant, frame) for participant, frame in ready if _priority(frame) == strongest]
        self._is_busy = True
        for participant, frame in senders:
            participant.started(frame)
        error = self._error(senders)
        if error is None:
            self._take(frame_bits(senders[0][1]), lambda: self._succeed(senders))
        else:
            self._fail(senders, *error)

    def _take(self, number, then):
        self.busy_ns += number * self.bit_ns
        self.timeline.after(number * self.bit_ns, then)

    def _error(self, senders):
        """What goes wrong: (bit, who sees it first, error), or ``None``."""
        names = [participant for participant, _ in senders]
        if self.is_shorted:
            return 1, names, BIT_DOMINANT
        strangers = [p for p in self.participants if p.is_on() and not self._rate_is_right(p)]
        if strangers and not (strangers == [p for p in strangers if p.is_passive()] and names[0] not in strangers):
            return 8, names, STUFF
        if len({frame for _, frame in senders}) > 1:
            sent = [stuffed(frame) for _, frame in senders]
            place = next(place for place, wanted in enumerate(zip(*sent)) if len(set(wanted)) > 1)
            losers = [participant for (participant, _), text in zip(senders, sent) if text[place] == "1"]
            if any(not participant.is_passive() for participant in losers):
                return place, names, BIT_RECESSIVE
            for loser in losers:
                self._note(loser, BIT_RECESSIVE)
                loser.failed(BIT_RECESSIVE)
            senders[:] = [(participant, frame) for participant, frame in senders if participant not in losers]
        answering = [p for p in self.participants if p not in names and p.acknowledges() and self._rate_is_right(p)]
        if not answering:
            return frame_bits(senders[0][1]) - AFTER_CRC_BITS + 2, names, ACKNOWLEDGE
        return None

    def _note(self, participant, error):
        self.errors.append((self.timeline.now_ns, participant.name, error))

    def _fail(self, senders, bit, who, error):
        def ended():
            for participant in self.participants:
                if participant in who:
                    self._note(participant, error)
                    if participant.is_passive():
                        participant.resumes_ns = self.timeline.now_ns + (INTERMISSION_BITS + SUSPEND_BITS) * self.bit_ns
                    participant.failed(error)
                elif participant.is_on() and not self.is_shorted and error != ACKNOWLEDGE:
                    participant.misheard(STUFF)
            self._release()

        self._take(bit + 1 + ERROR_FLAG_BITS + DELIMITER_BITS, ended)

    def _succeed(self, senders):
        frame = senders[0][1]
        for participant, _ in senders:
            self.log.append((self.timeline.now_ns, participant.name, frame))
            participant.sent(frame)
            if participant.is_passive():
                participant.resumes_ns = self.timeline.now_ns + (INTERMISSION_BITS + SUSPEND_BITS) * self.bit_ns
        names = [participant for participant, _ in senders]
        for participant in self.participants:
            if participant not in names and participant.is_on() and self._rate_is_right(participant):
                participant.heard(frame)
        self._release()

    def _release(self):
        self._is_busy = False
        self._free_ns = self.timeline.now_ns + INTERMISSION_BITS * self.bit_ns
        if self._waiting:
            self._idle_sequence()
        self.kick()


def _priority(frame):
    """Order of arbitration: the lower one wins."""
    if frame.is_extended:
        return frame.identifier >> 18, 1, 1, frame.identifier & 0x3FFFF, frame.is_remote
    return frame.identifier, frame.is_remote, 0, 0, 0


class Adapter(Participant):
    """A participant with a queue, as a computer's adapter is one; :attr:`on_heard` gets each frame."""

    def __init__(self, name="host"):
        super().__init__(name)
        self.queue = []
        self.on_heard = lambda frame: None

    def send(self, frame):
        self.queue.append(frame)
        self.wire.kick()

    def head(self):
        return self.queue[0] if self.queue else None

    def sent(self, frame):
        super().sent(frame)
        self.queue.pop(0)

    def heard(self, frame):
        super().heard(frame)
        self.on_heard(frame)

    def failed(self, error):
        """Never off the bus."""


class Babbler(Participant):
    """A faulty node that sends one frame after the other without a pause."""

    def __init__(self, frame, name="babbler"):
        super().__init__(name)
        self.frame = frame

    def head(self):
        return self.frame

    def failed(self, error):
        """Never off the bus."""
