"""What the program says of an interface that it cannot use, on a real kernel."""

import subprocess

import pytest

from conftest import PROGRAM

pytestmark = pytest.mark.vcan


def refusal(interface):
    command = [PROGRAM, "watch", "--json", "--seconds", "1", "--bus", f"socketcan:{interface}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stdout == ""
    return done.stderr


def ip(*arguments):
    subprocess.run(["ip", "link", *arguments], check=True)


@pytest.fixture
def spare():
    """An interface of its own, which is not up."""
    ip("add", "dev", "vcan9", "type", "vcan")
    yield "vcan9"
    ip("delete", "vcan9")


def test_an_interface_that_is_down_is_told_with_the_way_up(spare):
    assert "vcan9 is down; `sudo ip link set vcan9 up`" in refusal(spare)


def test_non_can_interface_and_missing_interface_are_refused():
    assert "lo is no CAN interface" in refusal("lo")
    assert "there is no interface can7" in refusal("can7")
