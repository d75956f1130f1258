"""The wire as SLCAN on a TCP port, as an adapter would give it: for programs that know nothing of virtual time.

Virtual time keeps step with the real one, or falls behind; it never runs ahead, so that nobody's timeouts end early.
"""

import socket
import threading
import time

from .wire import Adapter, Frame

STEP_S = 0.001
ACCEPTED, REFUSED, END = b"\r", b"\a", b"\r"
ANSWERS = {b"V": b"V1013\r", b"N": b"NG474\r", b"F": b"F00\r"}


class SlcanServer:
    """Serves a board on a port of this machine, in a thread of its own, from ``with`` to its end."""

    def __init__(self, board, port=0):
        self.board = board
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self.port = self._listener.getsockname()[1]
        self._adapter = board.wire.join(Adapter("slcan"))
        self._adapter.on_heard = self._heard
        self._connection, self._received, self._unsent, self._is_open = None, b"", b"", False
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self.error = None

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join()
        self._disconnect()
        self._listener.close()
        self.board.wire.leave(self._adapter)
        if self.error:
            raise self.error

    def _serve(self):
        try:
            due_s = time.monotonic()
            while not self._is_over.is_set():
                self._exchange()
                self.board.run(STEP_S)
                due_s = max(due_s + STEP_S, time.monotonic() - STEP_S)
                time.sleep(max(due_s - time.monotonic(), 0))
        except Exception as error:
            self.error = error

    def _exchange(self):
        try:
            if self._connection is None:
                self._connection, _ = self._listener.accept()
                self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._connection.setblocking(False)
            if self._unsent:
                self._unsent = self._unsent[self._connection.send(self._unsent) :]
            while data := self._connection.recv(4096):
                self._received += data
                *lines, self._received = self._received.split(END)
                for line in lines:
                    self._unsent += self._answer(line)
            self._disconnect()
        except BlockingIOError:
            pass
        except ConnectionError:
            self._disconnect()

    def _disconnect(self):
        if self._connection:
            self._connection.close()
        self._connection, self._received, self._unsent, self._is_open = None, b"", b"", False

    def _answer(self, line):
        kind, rest = line[:1], line[1:]
        if kind in ANSWERS:
            return ANSWERS[kind]
        if kind in (b"O", b"L", b"C"):
            self._is_open = kind != b"C"
        elif kind in (b"t", b"T", b"r", b"R"):
            return self._send(kind, rest)
        return ACCEPTED

    def _send(self, kind, rest):
        is_extended, is_remote = kind in b"TR", kind in b"rR"
        digits = 8 if is_extended else 3
        try:
            length = int(rest[digits : digits + 1])
            data = b"" if is_remote else bytes.fromhex(rest[digits + 1 : digits + 1 + 2 * length].decode())
            frame = Frame(int(rest[:digits], 16), data, is_extended, is_remote, length)
        except ValueError:
            return REFUSED
        if not self._is_open or not is_remote and len(data) != length:
            return REFUSED
        self._adapter.send(frame)
        return ACCEPTED

    def _heard(self, frame):
        if self._is_open:
            kind = "tTrR"[frame.is_extended + 2 * frame.is_remote]
            digits = 8 if frame.is_extended else 3
            self._unsent += f"{kind}{frame.identifier:0{digits}X}{frame.dlc()}{frame.data.hex().upper()}\r".encode()
