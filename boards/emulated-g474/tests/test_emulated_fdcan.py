"""FDCAN1 by its registers: filters, FIFOs, the order of sending, error states, bus-off and the way back."""

import pytest

from g474.fdcan import BO, BO_FLAG, CCE, EP, INIT, RF0L, RF0N, TC
from g474.wire import Adapter, Frame, Wire
from registers import chip, peek, pending, poke

FILTER_CLASSIC_TO_0, FILTER_RANGE_TO_1, FILTER_DUAL_REJECT = 2 << 30 | 1 << 27, 0 << 30 | 2 << 27, 1 << 30 | 3 << 27
REJECT_OTHERS = 2 << 4 | 2 << 2


@pytest.fixture
def joined():
    """A controller on a wire with an adapter, at 500 kbit/s from 16 MHz: 16 quanta, prescaler 2."""
    made = chip()
    wire = Wire(made.timeline)
    adapter = wire.join(Adapter())
    wire.join(made.fdcan)
    poke(made.gpio["A"], "MODER", 0xABFFFFFF & ~(0xF << 22) | 0xA << 22)
    poke(made.gpio["A"], "AFRH", 0x99 << 12)
    poke(made.rcc, "CCIPR", 2 << 24)
    can = made.fdcan
    poke(can, "CCCR", INIT | CCE)
    poke(can, "NBTP", 1 << 16 | (13 - 1) << 8 | (2 - 1))
    poke(can, "RXGFC", REJECT_OTHERS | 3 << 16)
    for place, word in enumerate(
        [FILTER_DUAL_REJECT | 0x105 << 16 | 0x106, FILTER_CLASSIC_TO_0 | 0x100 << 16 | 0x7F0, FILTER_RANGE_TO_1 | 0x200 << 16 | 0x20F]
    ):
        made.message_ram.write(4 * place, 4, word)
    for register in ("IE", "TXBTIE", "ILE"):
        poke(can, register, 0xFFFFFF)
    poke(can, "CCCR", 0)
    return made, can, wire, adapter


def put(made, buffer, identifier, data=b""):
    base = 0x278 + 72 * buffer
    made.message_ram.write(base, 4, identifier << 18)
    made.message_ram.write(base + 4, 4, len(data) << 16)
    made.message_ram.bytes[base + 8 : base + 8 + len(data)] = data
    poke(made.fdcan, "TXBAR", 1 << buffer)


def level(can, fifo):
    return peek(can, f"RXF{fifo}S") & 0xF


def test_filters_in_their_order_sort_reject_and_drop(joined):
    made, can, wire, adapter = joined
    for identifier in (0x101, 0x105, 0x203, 0x2FF, 0x10F):
        adapter.send(Frame(identifier, bytes([identifier & 0xFF])))
    adapter.send(Frame(0x101, is_extended=True))
    made.timeline.advance(10_000_000)
    assert (level(can, 0), level(can, 1)) == (2, 1)
    element = 0x0B0 + 72 * (peek(can, "RXF0S") >> 8 & 3)
    assert made.message_ram.word(element) >> 18 == 0x101
    assert made.message_ram.word(element + 4) >> 16 & 0xF == 1 and made.message_ram.word(element + 4) >> 24 == 1
    assert made.message_ram.bytes[element + 8] == 0x01
    assert peek(can, "IR") & RF0N and 21 in pending(made)


def test_the_fourth_frame_of_three_elements_is_lost_and_said_to_be(joined):
    made, can, _, adapter = joined
    for number in range(4):
        adapter.send(Frame(0x100, bytes([number])))
    made.timeline.advance(10_000_000)
    assert level(can, 0) == 3 and peek(can, "IR") & RF0L
    poke(can, "RXF0A", peek(can, "RXF0S") >> 8 & 3)
    assert level(can, 0) == 2 and made.message_ram.bytes[0x0B0 + 72 * (peek(can, "RXF0S") >> 8 & 3) + 8] == 1


@pytest.mark.parametrize("is_queue, expected", [(0, [0x300, 0x200, 0x100]), (1, [0x100, 0x200, 0x300])])
def test_a_fifo_sends_in_the_order_of_asking_and_a_queue_by_identifier(joined, is_queue, expected):
    made, can, wire, _ = joined
    poke(can, "TXBC", is_queue << 24)
    for buffer, identifier in enumerate([0x300, 0x200, 0x100]):
        put(made, buffer, identifier)
    assert peek(can, "TXFQS") >> 21 & 1 and peek(can, "TXBRP") == 7
    made.timeline.advance(10_000_000)
    assert [frame.identifier for _, _, frame in wire.log] == expected
    assert peek(can, "TXBTO") == 7 and peek(can, "TXBRP") == 0 and peek(can, "IR") & TC


def test_another_bit_rate_is_not_understood(joined):
    made, can, wire, adapter = joined
    poke(can, "NBTP", 3 << 16 | (13 - 1) << 8 | (2 - 1))
    adapter.send(Frame(0x100))
    made.timeline.advance(1_000_000)
    assert level(can, 0) == 0 and wire.log == [] and peek(can, "ECR") >> 8 & 0x7F > 0


def test_without_an_acknowledgement_it_is_passive_and_repeats(joined):
    made, can, wire, adapter = joined
    wire.leave(adapter)
    put(made, 0, 0x100)
    made.timeline.advance(100_000_000)
    status = peek(can, "PSR")
    assert status & EP and not status & BO and status & 7 == 3 and peek(can, "ECR") & 0xFF == 128
    assert peek(can, "PSR") & 7 in (3, 7)
    wire.join(adapter)
    made.timeline.advance(101_000_000)
    assert [frame.identifier for _, _, frame in wire.log] == [0x100]


def test_bus_off_stops_it_and_129_times_eleven_recessive_bits_after_init_is_cleared_it_sends_again(joined):
    made, can, wire, _ = joined
    wire.is_shorted = True
    put(made, 0, 0x100)
    made.timeline.advance(10_000_000)
    assert peek(can, "PSR") & BO and peek(can, "CCCR") & INIT and peek(can, "IR") & BO_FLAG
    wire.is_shorted = False
    made.timeline.advance(100_000_000)
    assert wire.log == []
    poke(can, "CCCR", 0)
    start_ns = made.timeline.now_ns
    made.timeline.advance(200_000_000)
    assert not peek(can, "PSR") & BO and peek(can, "ECR") & 0xFF == 0
    assert 129 * 11 * 2000 <= wire.log[0][0] - start_ns <= 130 * 11 * 2000 + 200_000


def test_a_cancelled_request_is_not_sent(joined):
    made, can, wire, adapter = joined
    put(made, 0, 0x300)
    put(made, 1, 0x200)
    poke(can, "TXBCR", 2)
    made.timeline.advance(10_000_000)
    assert [frame.identifier for _, _, frame in wire.log] == [0x300]
    assert peek(can, "TXBCF") == 2 and peek(can, "TXBTO") == 1
