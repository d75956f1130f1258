"""The program that would be flashed, deployed to and played to over the bus, against the host: the same bits."""

import monitor
from conftest import NODE
from g474 import VirtualTimeBus
from scene import causes
from test_monitor import same_to_the_bit


def test_the_whole_record_gives_the_hosts_bits(board, desk):
    with VirtualTimeBus(board) as bus:
        answers = monitor.play(bus, NODE, desk.record)
    assert sorted(answers) == sorted(desk.answers)
    for row, result in answers.items():
        same_to_the_bit(result, desk.answers[row])
    assert causes(board) == [["BOR"]]
