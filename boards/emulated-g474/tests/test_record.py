"""The program that would be flashed, deployed to and played to by the program over the bus, against the host: the same bits."""

from conftest import NODE, SAMPLE, answers_of
from g474.slcan import SlcanServer
from scene import causes


def test_the_whole_record_gives_the_hosts_bits(board, desk, key_file):
    with SlcanServer(board) as server:
        there = ["--bus", f"slcan:127.0.0.1:{server.port}", "--external", "--node", NODE, "--key", key_file]
        answers = answers_of(desk.rotor, SAMPLE / "record.csv", *there)
    assert len(answers) > 400 and sorted(answers) == sorted(desk.answers)
    for row, answer in answers.items():
        assert answer == desk.answers[row]
    assert causes(board) == [["BOR"]]
