"""The wire as a bus of python-can, in virtual time: waiting for a frame lets the board run."""

import can

from .timeline import SECOND_NS
from .wire import Adapter, Frame

LONGEST_WAIT_S = 60.0


class VirtualTimeBus(can.BusABC):
    """Timeouts of :meth:`recv` and timestamps are seconds of the board's time."""

    def __init__(self, board, name="python-can", **arguments):
        self.board = board
        self.channel_info = f"the wire of an emulated board, as {name}"
        self._adapter = board.wire.join(Adapter(name))
        self._adapter.on_heard = self._heard
        self._received = []
        super().__init__(channel=name, **arguments)

    def _heard(self, frame):
        message = can.Message(
            timestamp=self.board.timeline.now_ns / SECOND_NS,
            arbitration_id=frame.identifier,
            is_extended_id=frame.is_extended,
            is_remote_frame=frame.is_remote,
            dlc=frame.dlc(),
            data=frame.data,
        )
        self._received.append(message)
        self.board.chip.stop()

    def send(self, msg, timeout=None):
        self._adapter.send(
            Frame(msg.arbitration_id, bytes(msg.data), msg.is_extended_id, msg.is_remote_frame, msg.dlc)
        )

    def _recv_internal(self, timeout):
        end_ns = self.board.timeline.now_ns + int((LONGEST_WAIT_S if timeout is None else timeout) * SECOND_NS)
        while not self._received and (left_ns := end_ns - self.board.timeline.now_ns) > 0:
            self.board.run(left_ns / SECOND_NS)
        return (self._received.pop(0) if self._received else None), False

    def shutdown(self):
        super().shutdown()
        if self._adapter.wire:
            self.board.wire.leave(self._adapter)
