"""Virtual time in nanoseconds, and what is to happen when."""

import heapq
import itertools

SECOND_NS = 1_000_000_000


class Event:
    """Something that is to happen; may be cancelled until then."""

    __slots__ = ("action", "time_ns")

    def __init__(self, time_ns, action):
        self.time_ns, self.action = time_ns, action

    def cancel(self):
        self.action = None


class Timeline:
    """One clock for the chip, the wire and the machine. Time passes only by :meth:`advance`."""

    def __init__(self):
        self.now_ns = 0
        self._queue = []
        self._order = itertools.count()

    def at(self, time_ns, action):
        """Has ``action()`` called at a time, or at once if that has passed; equal times in the order of asking."""
        event = Event(max(time_ns, self.now_ns), action)
        heapq.heappush(self._queue, (event.time_ns, next(self._order), event))
        return event

    def after(self, delay_ns, action):
        return self.at(self.now_ns + delay_ns, action)

    def next_ns(self):
        """When something happens next; ``None``: never."""
        while self._queue and self._queue[0][2].action is None:
            heapq.heappop(self._queue)
        return self._queue[0][0] if self._queue else None

    def advance(self, until_ns):
        """Lets time pass, with everything that falls due."""
        while (due_ns := self.next_ns()) is not None and due_ns <= until_ns:
            self.now_ns = max(self.now_ns, due_ns)
            _, _, event = heapq.heappop(self._queue)
            action, event.action = event.action, None
            action()
        self.now_ns = max(self.now_ns, until_ns)
