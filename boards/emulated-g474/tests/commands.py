"""Commands to the board in virtual time, with can-isotp: what the program does over SLCAN, without its clock."""

import isotp

import monitor
from conftest import NODE
from g474.wire import Adapter, Frame

TO_NODE, TO_HOST = (monitor.DBC.get_message_by_name(name).frame_id + NODE for name in ["ToNode", "ToHost"])
DEPLOY, RESTART, ACKNOWLEDGE, SET_THRESHOLDS, GET_THRESHOLDS = range(1, 6)
STEP_S = 0.0005
PATIENCE_S = 5.0
LAZY_MS = 1_000_000_000
"""can-isotp's own timeouts are of the real time, and do not matter here."""


class Client:
    """Somebody who has a key. Every command gets the next counter."""

    def __init__(self, board, key, counter=1):
        self.board, self.key, self.counter = board, key, counter

    def ask(self, command, body=b""):
        """(outcome, counter) of the board's answer."""
        self.counter += 1
        request = monitor.request(self.key, NODE, command, self.counter, body)
        outcome, counter, *_ = monitor.open_answer(self.key, self.exchange(request), request)
        return outcome, counter

    def exchange(self, request):
        board, heard = self.board, []
        adapter = board.wire.join(Adapter("client"))
        adapter.on_heard = lambda frame: heard.append(frame) if frame.identifier == TO_HOST else None
        layer = isotp.TransportLayerLogic(
            rxfn=lambda *_: isotp.CanMessage(arbitration_id=TO_HOST, data=heard.pop(0).data) if heard else None,
            txfn=lambda message: adapter.send(Frame(message.arbitration_id, bytes(message.data))),
            address=isotp.Address(isotp.AddressingMode.Normal_11bits, txid=TO_NODE, rxid=TO_HOST),
            params={
                "tx_padding": 0xCC,
                "rx_flowcontrol_timeout": LAZY_MS,
                "rx_consecutive_frame_timeout": LAZY_MS,
                "override_receiver_stmin": 0,
            },
        )
        layer.send(request)
        end_s = board.now_s + PATIENCE_S
        try:
            while not layer.available():
                assert board.now_s < end_s, "no answer to a command"
                layer.process()
                board.run(STEP_S)
            return bytes(layer.recv())
        finally:
            board.wire.leave(adapter)
