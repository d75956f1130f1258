"""Commands over ISO-TP, with two implementations that are not ours at the other end: can-isotp from PyPI and the
kernel's. They send to our monitor, and our `deploy` sends to them; codes and layouts are made here with hmac and struct.
"""

import binascii
import re
import subprocess
import threading
import time
from collections import Counter

import isotp
import pytest

import monitor
from conftest import NODE, PROGRAM, SECONDS, VCAN, answers_of, first_readings
from test_monitor import next_heartbeat, same_to_the_bit

TO_NODE, TO_HOST = (monitor.DBC.get_message_by_name(name).frame_id + NODE for name in ["ToNode", "ToHost"])
READINGS = 30


class PyPi:
    """can-isotp on a python-can bus."""

    def __init__(self, wire, send_id, receive_id, block_size=8, separation_ms=0):
        address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=send_id, rxid=receive_id)
        parameters = {"blocksize": block_size, "stmin": separation_ms, "tx_padding": 0xCC, "blocking_send": True}
        self.stack = isotp.CanStack(wire.bus(), address=address, params=parameters)
        self.stack.start()

    def send(self, data):
        self.stack.send(data, send_timeout=SECONDS)

    def receive(self):
        data = self.stack.recv(block=True, timeout=SECONDS)
        assert data is not None, "no message over ISO-TP"
        return bytes(data)

    def close(self):
        self.stack.stop()


class Kernel:
    """The kernel's can-isotp."""

    def __init__(self, wire, send_id, receive_id, block_size=8, separation_ms=0):
        self.socket = isotp.socket(timeout=SECONDS)
        self.socket.set_fc_opts(bs=block_size, stmin=separation_ms)
        self.socket.set_opts(optflag=isotp.socket.flags.TX_PADDING, txpad=0xCC)
        self.socket.bind(VCAN, isotp.Address(isotp.AddressingMode.Normal_11bits, txid=send_id, rxid=receive_id))

    def send(self, data):
        self.socket.send(data)

    def receive(self):
        return self.socket.recv()

    def close(self):
        self.socket.close()


@pytest.fixture(params=["pypi", "kernel"])
def other(request, wire):
    """Opens an end of a pair of identifiers; the kernel's is on the kernel's bus alone, see conftest.py."""
    opened = []

    def end(*arguments, **options):
        implementation = {"pypi": PyPi, "kernel": Kernel}[request.param]
        opened.append(implementation(wire, *arguments, **options))
        return opened[-1]

    yield end
    for link in opened:
        link.close()


@pytest.fixture
def better(desk, tmp_path):
    """Another model: one bearing is stiffer."""
    stiffness = re.compile(r"(?<=stiffness_n_m\]\nxx = )\S+")
    text, changed = stiffness.subn(lambda xx: repr(1.1 * float(xx[0])), desk.rotor.read_text(), count=1)
    assert changed == 1
    path = tmp_path / "better.toml"
    path.write_text(text)
    return path


class FakeMonitor(threading.Thread):
    """Takes one command as a monitor would, and answers it."""

    def __init__(self, link, key, outcome="accepted"):
        super().__init__(daemon=True)
        self.link, self.key, self.outcome, self.request = link, key, outcome, None
        self.start()

    def run(self):
        self.request = self.link.receive()
        counter = int.from_bytes(self.request[4:12], "little")
        in_use = int.from_bytes(self.request[-20:-16], "little")
        self.link.send(monitor.answer(self.key, NODE, monitor.DEPLOY, self.outcome, counter, in_use, self.request))


def deploy(wire, rotor, key_file, *options):
    command = [PROGRAM, "deploy", rotor, "--bus", wire.spec, "--key", key_file, "--node", str(NODE), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.fixture
def key(tmp_path):
    key = bytes(range(32))
    path = tmp_path / "deploy.key"
    path.write_text(key.hex())
    return key, path


@pytest.mark.parametrize("block_size, separation_ms", [(0, 0), (1, 0), (8, 0), (3, 2)])
def test_deploy_follows_flow_control_of_independent_receiver(wire, other, desk, key, block_size, separation_ms):
    secret, key_file = key
    watcher = wire.join()
    fake = FakeMonitor(other(TO_HOST, TO_NODE, block_size=block_size, separation_ms=separation_ms), secret)
    begun = time.monotonic()
    done = deploy(wire, desk.rotor, key_file, "--counter", "77")
    took = time.monotonic() - begun
    fake.join(SECONDS)
    assert done.returncode == 0, done.stderr
    data = fake.request
    assert data == monitor.request(secret, NODE, monitor.DEPLOY, 77, data[12:-16])
    model = data[12:-16]
    # schema, shapes, probes, planes, then what postcard and its CRC-32 cover
    assert model[:7] == (4).to_bytes(4, "little") + bytes([6, 4, 2])
    assert binascii.crc32(model[7:-4]) == int.from_bytes(model[-4:], "little")
    consecutive = -(-(len(data) - 6) // 7)
    kinds = Counter()
    while kinds["Consecutive"] < consecutive:
        decoded = monitor.decode(watcher.recv(SECONDS))
        if decoded and decoded[0] == "ToNode":
            kinds[str(decoded[2]["Kind"])] += 1
        if decoded and decoded[0] == "ToHost" and decoded[2]["Kind"] == "FlowControl":
            kinds["FlowControl"] += 1
    assert kinds["First"] == 1 and kinds["Consecutive"] == consecutive
    assert kinds["FlowControl"] == (-(-consecutive // block_size) if block_size else 1)
    # within a block, frames keep their distance
    waits = consecutive - kinds["FlowControl"]
    assert took >= waits * separation_ms / 1000


def test_deploy_says_why_a_monitor_refused(wire, other, desk, key):
    secret, key_file = key
    fake = FakeMonitor(other(TO_HOST, TO_NODE), secret, outcome="storage")
    done = deploy(wire, desk.rotor, key_file)
    fake.join(SECONDS)
    assert done.returncode == 1 and "could not store" in done.stderr, done.stderr


@pytest.fixture
def better_model(wire, better, key):
    """The bytes of the better model, as `deploy` sends them."""
    secret, key_file = key
    link = PyPi(wire, TO_HOST, TO_NODE)
    fake = FakeMonitor(link, secret)
    done = deploy(wire, better, key_file)
    fake.join(SECONDS)
    link.close()
    wire.leave()
    assert done.returncode == 0, done.stderr
    return fake.request[12:-16]


@pytest.mark.quick
def test_a_model_sent_by_an_independent_sender_is_used(better_model, better, node, other, desk, tmp_path):
    link, bus = other(TO_NODE, TO_HOST), node.wire.join()

    def command(what, body=b"", key=node.key, counter=None, change=lambda data: data):
        """Outcome, counter (0 to who has not the key) and checksum."""
        data = change(monitor.request(key, NODE, what, counter or node.next_counter(), body))
        link.send(data)
        return monitor.open_answer(node.key, link.receive(), data)

    before = next_heartbeat(bus)["Checksum"]
    after = int.from_bytes(better_model[-4:], "little")
    assert before != after
    # none of these may change anything
    assert command(monitor.RESTART, key=bytes(32)) == ("forged", 0, before)
    for at in range(1, 28):
        flip = lambda data: data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
        assert command(monitor.RESTART, change=flip) == ("forged", 0, before), at
    counter = node.counter
    assert command(monitor.RESTART, counter=counter + (1 << 42) + 1)[0] == "counter"
    flip = lambda data: data[:600] + bytes([data[600] ^ 1]) + data[601:]
    assert command(monitor.DEPLOY, better_model, change=flip) == ("forged", 0, before)
    assert command(monitor.DEPLOY, better_model[:-1])[0] == "model"
    (answered,) = monitor.play(bus, NODE, desk.record[:1]).values()
    same_to_the_bit(answered, desk.answers[0])
    # and this must
    accepted = node.next_counter()
    assert command(monitor.DEPLOY, better_model, counter=accepted) == ("accepted", accepted, after)
    assert command(monitor.DEPLOY, better_model, counter=accepted) == ("replayed", accepted, after)
    assert command(monitor.RESTART)[0] == "accepted"
    expected = answers_of(better, first_readings(READINGS, tmp_path))
    assert expected[0]["unbalance_g_mm"] != desk.answers[0]["unbalance_g_mm"]
    for row, result in monitor.play(bus, NODE, desk.record[:READINGS]).items():
        same_to_the_bit(result, expected[row])
    counted = next_heartbeat(bus)
    commands = [counted[name] for name in ["Accepted", "Refused", "Forged", "Replayed", "Broken"]]
    assert commands == [2, 1, 29, 2, 0] and counted["Checksum"] == after
    assert f"model {better_model.hex()}" in node.state.read_text().lower()


def test_a_transfer_that_breaks_off_changes_nothing(better_model, node, desk):
    bus = node.wire.join()
    before = next_heartbeat(bus)["Checksum"]
    data = monitor.request(node.key, NODE, monitor.DEPLOY, node.next_counter(), better_model)
    first = bytes([0x10 | len(data) >> 8, len(data) & 0xFF]) + data[:6]
    bus.send(raw(first))
    assert monitor.wait_for(bus, "ToHost", NODE)["Kind"] == "FlowControl"
    for index in range(3):
        bus.send(raw(bytes([0x21 + index]) + data[6 + 7 * index : 13 + 7 * index]))
    heard = monitor.wait_for(bus, "Counters8", NODE, accept=lambda transfers: transfers["Broken"] == 1)
    assert heard["Conflicts"] == 0 and next_heartbeat(bus)["Checksum"] == before
    (answered,) = monitor.play(bus, NODE, desk.record[:1]).values()
    same_to_the_bit(answered, desk.answers[0])


def raw(data):
    message = monitor.message("ToNode", NODE, Kind="Single", Detail=0, Data=0)
    message.data = bytearray(data)
    message.dlc = len(data)
    return message
