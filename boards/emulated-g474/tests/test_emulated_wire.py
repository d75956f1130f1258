"""The wire: lengths against the standard's worked limits, arbitration, errors and their confinement."""

from g474.timeline import Timeline
from g474.wire import ACKNOWLEDGE, BIT_DOMINANT, BIT_RECESSIVE, Adapter, Babbler, Frame, Participant, Wire, frame_bits, stuffed


class Node(Adapter):
    """An adapter whose errors count, as a controller's do."""

    def is_on(self):
        return self.transmit_errors < 256

    failed = Participant.failed


def wire(*names, kind=Adapter):
    made = Wire(Timeline())
    return made, [made.join(kind(name)) for name in names]


def order(made):
    return [(sender, frame.identifier) for _, sender, frame in made.log]


def test_a_frames_length_is_the_standards_between_no_stuffing_and_the_worst():
    # 47 bits around the data with an 11-bit identifier, intermission included; at worst a stuff bit behind each four after
    # the first five of the 34 + 8 n bits that are stuffed
    for length in range(9):
        for fill in (0x00, 0xFF, 0x55, 0xAA):
            number = frame_bits(Frame(0x155, bytes([fill]) * length)) + 3
            assert 47 + 8 * length <= number <= 47 + 8 * length + (34 + 8 * length - 1) // 4
    assert frame_bits(Frame(0x000, bytes(8))) > frame_bits(Frame(0x155, bytes([0x55]) * 8))


def test_never_six_equal_bits_before_the_end():
    for identifier in (0, 0x7FF, 0x0F8, 0x555):
        for data in (bytes(8), b"\xff" * 8, b"\x0f\xf0" * 4, b"\xf8\x3e\x0f\x83"):
            sent = stuffed(Frame(identifier, data))
            assert "000000" not in sent and "111111" not in sent


def test_the_lower_identifier_goes_first_and_an_extended_one_after_its_base():
    made, (one, two, three) = wire("one", "two", "three")
    two.send(Frame(0x200))
    one.send(Frame(0x300))
    three.send(Frame(0x200 << 18, is_extended=True))
    one.send(Frame(0x100))
    made.timeline.advance(5_000_000)
    # 0x300 holds up the 0x100 behind it: a queue is no set of mailboxes
    assert order(made) == [("two", 0x200), ("three", 0x200 << 18), ("one", 0x300), ("one", 0x100)]


def test_frames_take_their_bits_and_three_between_them():
    made, (one, _) = wire("one", "other")
    frame = Frame(0x123, b"\x01\x02")
    one.send(frame)
    one.send(frame)
    made.timeline.advance(5_000_000)
    (first_ns, _, _), (second_ns, _, _) = made.log
    assert first_ns == frame_bits(frame) * 2000 and second_ns - first_ns == (frame_bits(frame) + 3) * 2000


def test_a_babbling_node_of_higher_priority_leaves_nothing_to_others_and_one_of_lower_priority_everything():
    for identifier, sent in [(0x000, 0), (0x7FF, 5)]:
        made, (one, _) = wire("one", "other")
        babbler = made.join(Babbler(Frame(identifier, b"\x55" * 8)))
        made.kick()
        for _ in range(5):
            one.send(Frame(0x100))
        made.timeline.advance(10_000_000)
        assert sum(sender == "one" for sender, _ in order(made)) == sent
        made.leave(babbler)
        made.timeline.advance(20_000_000)
        assert sum(sender == "one" for sender, _ in order(made)) == 5


def test_whom_nobody_acknowledges_repeats_for_ever_and_never_goes_off_the_bus():
    made, (alone,) = wire("alone", kind=Node)
    alone.send(Frame(0x100))
    made.timeline.advance(100_000_000)
    assert made.log == [] and {error for _, _, error in made.errors} == {ACKNOWLEDGE}
    assert alone.is_passive() and alone.transmit_errors == 128
    made.join(Adapter("other"))
    made.timeline.advance(101_000_000)
    assert order(made) == [("alone", 0x100)]


def test_on_a_shorted_wire_a_sender_is_off_after_32_frames():
    made, (one, _) = wire("one", "other", kind=Node)
    made.is_shorted = True
    one.send(Frame(0x100))
    made.timeline.advance(100_000_000)
    assert [error for _, _, error in made.errors] == [BIT_DOMINANT] * 32 and not one.is_on()


def test_equal_identifiers_with_other_data_destroy_each_other_until_the_loser_is_passive():
    made, (one, two) = wire("one", "two", kind=Node)
    made.join(Adapter("other"))
    one.send(Frame(0x100, b"\x00"))
    two.send(Frame(0x100, b"\x01"))
    made.timeline.advance(100_000_000)
    # sixteen collisions make both passive; then the recessive bit loses alone, and goes second
    assert [error for _, name, error in made.errors if name == "one"] == [BIT_RECESSIVE] * 16
    assert order(made) == [("one", 0x100), ("two", 0x100)]


def test_equal_frames_of_two_senders_are_one_frame():
    made, (one, two) = wire("one", "two", kind=Node)
    heard = []
    made.join(Adapter("other")).on_heard = heard.append
    one.send(Frame(0x100, b"\x01"))
    two.send(Frame(0x100, b"\x01"))
    made.timeline.advance(100_000_000)
    assert len(heard) == 1 and made.errors == []
