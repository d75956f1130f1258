"""How fast python-can is over `rotor-edge bus`: the yardstick of `cargo bench -p rotor-edge-tests`.

Needs python-can and pyserial; one process sends, another receives, as two users' scripts would.

    cargo build --release && python tests/reference/time_python_can.py target/release/rotor-edge [INTERFACE ...]

Interfaces are slcan and socketcand unless given; socketcan is a kernel's vcan0, which needs room for all frames:
sysctl -w net.core.rmem_default=33554432
"""

import json
import multiprocessing
import statistics
import subprocess
import sys
import time

import can

FRAMES = 10_000  # fewer than wait for one client at most, so that none is dropped
ROUNDS = 7


def join(opened, interface):
    if interface == "socketcan":
        return can.Bus(interface="socketcan", channel="vcan0")
    if interface == "slcan":
        channel = f"socket://127.0.0.1:{opened['slcan_port']}"
        bus = can.Bus(interface="slcan", channel=channel, sleep_after_open=0)
        # nothing says that the channel is open, but what comes after does
        bus.get_version(20)
        return bus
    port = opened["socketcand_port"]
    return can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="vcan0", tcp_tune=True)


def receive(opened, interface, results):
    bus = join(opened, interface)
    results.put("ready")
    for _ in range(ROUNDS):
        for number in range(FRAMES):
            message = bus.recv(20)
            assert message is not None and int.from_bytes(message.data, "little") == number
        results.put(time.monotonic())


def measure(opened, interface):
    """Frames a second from the first sent to the last received: the median of all rounds."""
    results = multiprocessing.Queue()
    receiver = multiprocessing.Process(target=receive, args=(opened, interface, results), daemon=True)
    receiver.start()
    bus = join(opened, interface)
    results.get(timeout=20)
    time.sleep(0.5)
    rates = []
    for _ in range(ROUNDS):
        messages = [
            can.Message(arbitration_id=0x123, data=number.to_bytes(8, "little"), is_extended_id=False)
            for number in range(FRAMES)
        ]
        begun = time.monotonic()
        for message in messages:
            bus.send(message)
        rates.append(FRAMES / (results.get(timeout=60) - begun))
    receiver.join()
    bus.shutdown()
    return statistics.median(rates)


def main():
    command = [sys.argv[1], "bus", "--json", "--slcan", "0", "--socketcand", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        text = ""
        while not text.endswith("\n}\n"):
            text += program.stdout.readline()
        opened = json.loads(text)
        for interface in sys.argv[2:] or ["slcan", "socketcand"]:
            print(f"{interface:12} {measure(opened, interface):10.0f} frames/s")
        program.terminate()


if __name__ == "__main__":
    main()
