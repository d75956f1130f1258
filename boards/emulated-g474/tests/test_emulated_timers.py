"""Timers, watchdogs, converter and DMA by their registers."""

import math

import pytest

from g474.adc import ADEN, ADSTART
from g474.dma import CIRC, EN, HTIE, MINC, TCIE
from g474.chip import RAM
from registers import chip, peek, pending, poke

HZ = 16_000_000
INPUT, RISING, FALLING, BOTH = 1, 0x1, 0x3, 0xB
UPDATE_AS_TRIGGER = 2 << 4


@pytest.fixture
def made():
    return chip()


def start(timer, prescaler, top):
    poke(timer, "PSC", prescaler - 1)
    poke(timer, "ARR", top - 1)
    poke(timer, "EGR", 1)
    poke(timer, "SR", 0)
    poke(timer, "CR1", 1)


def test_it_counts_its_clock_and_flags_each_turn(made):
    timer = made.timers["TIM3"]
    start(timer, 16, 1000)
    made.timeline.advance(2_500_000)
    assert peek(timer, "CNT") == 500 and peek(timer, "SR") & 1
    poke(timer, "SR", ~1 & 0xFFFF)
    poke(timer, "DIER", 1)
    made.timeline.advance(2_999_000)
    assert 29 not in pending(made)
    made.timeline.advance(3_000_000)
    assert 29 in pending(made)


def test_a_compare_comes_at_its_count(made):
    timer = made.timers["TIM15"]
    start(timer, 16, 0x10000)
    poke(timer, "CCR2", 300)
    poke(timer, "DIER", 1 << 2)
    made.timeline.advance(299_000)
    assert 24 not in pending(made)
    made.timeline.advance(300_000)
    assert 24 in pending(made) and peek(timer, "SR") & 1 << 2


@pytest.mark.parametrize("polarity, edges", [(RISING, [True]), (FALLING, [False]), (BOTH, [True, False])])
def test_capture_takes_the_count_at_the_chosen_edges_of_its_pin(made, polarity, edges):
    timer = made.timers["TIM2"]
    poke(made.gpio["B"], "MODER", 2 << 20)
    poke(made.gpio["B"], "AFRH", 1 << 8)
    poke(timer, "CCMR2", INPUT)
    poke(timer, "CCER", polarity << 8)
    start(timer, 1, 1 << 32)
    poke(timer, "DIER", 1 << 3)
    seen = []
    for number, level in enumerate([True, False, True, False]):
        made.timeline.advance((number + 1) * 1_000_000 + 137)
        made.gpio["B"].drive(10, level)
        if peek(timer, "SR") & 1 << 3:
            assert 28 in pending(made)
            seen.append((level, peek(timer, "CCR3")))
        assert not peek(timer, "SR") & 1 << 3, "reading the capture clears its flag"
    assert {level for level, _ in seen} == set(edges)
    for level, count in seen:
        assert count % 16_000 == 137 * HZ // 1_000_000_000


def test_a_capture_that_nobody_took_is_said_to_be_overwritten(made):
    timer = made.timers["TIM2"]
    poke(timer, "CCMR2", INPUT)
    poke(timer, "CCER", RISING << 8)
    start(timer, 1, 1 << 32)
    timer.edge(3, True)
    assert not peek(timer, "SR") & 1 << 11
    timer.edge(3, True)
    assert peek(timer, "SR") & 1 << 11


def test_the_independent_watchdog_resets_in_time_and_not_when_fed(made):
    poke(made.iwdg, "KR", 0x5555)
    poke(made.iwdg, "PR", 1)
    poke(made.iwdg, "RLR", 1999)
    poke(made.iwdg, "KR", 0xCCCC)
    resets = []
    made.request_reset = resets.append
    for _ in range(3):
        made.timeline.advance(made.timeline.now_ns + 499_000_000)
        poke(made.iwdg, "KR", 0xAAAA)
    made.timeline.advance(made.timeline.now_ns + 499_000_000)
    assert resets == []
    made.timeline.advance(made.timeline.now_ns + 2_000_000)
    assert resets == ["IWDG"]


def test_the_independent_watchdogs_settings_need_their_key(made):
    poke(made.iwdg, "PR", 4)
    poke(made.iwdg, "RLR", 7)
    assert (peek(made.iwdg, "PR"), peek(made.iwdg, "RLR")) == (0, 0xFFF)


def test_the_window_watchdog_resets_when_fed_too_early_or_too_late(made):
    resets = []
    made.request_reset = resets.append
    poke(made.wwdg, "CFR", 0x50)
    poke(made.wwdg, "CR", 0x80 | 0x7F)
    step_ns = 4096 * 1_000_000_000 // HZ
    made.timeline.advance(0x30 * step_ns)
    poke(made.wwdg, "CR", 0x80 | 0x7F)
    assert resets == []
    made.timeline.advance(made.timeline.now_ns + 0x10 * step_ns)
    poke(made.wwdg, "CR", 0x80 | 0x7F)
    assert resets == ["WWDG"]
    made.wwdg.reset()
    poke(made.wwdg, "CR", 0x80 | 0x41)
    made.timeline.advance(made.timeline.now_ns + 2 * step_ns - 1)
    assert resets == ["WWDG"]
    made.timeline.advance(made.timeline.now_ns + 1)
    assert resets == ["WWDG", "WWDG"]


def test_triggered_scans_fill_a_ring_in_halves_at_the_times_of_the_trigger(made):
    made.connect("PA0", lambda time_s: 1.65 + math.sin(math.tau * 50 * time_s))
    made.connect("PA1", lambda time_s: 0.825)
    poke(made.rcc, "CCIPR", 2 << 28)
    poke(made.adc, "SQR1", 1 | 1 << 6 | 2 << 12)
    poke(made.adc, "CFGR", 3 | 4 << 5 | 1 << 10)
    poke(made.adc, "CR", 1 << 28 | ADEN)
    poke(made.dmamux, "C0CR", 5)
    dma = made.dmas[0]
    poke(dma, "CNDTR1", 40)
    poke(dma, "CMAR1", RAM)
    poke(dma, "CCR1", EN | TCIE | HTIE | CIRC | MINC | 1 << 8 | 1 << 10)
    timer = made.timers["TIM3"]
    poke(timer, "CR2", UPDATE_AS_TRIGGER)
    start(timer, 16, 50)
    start_ns = made.timeline.now_ns
    poke(made.adc, "CR", 1 << 28 | ADEN | ADSTART)
    made.timeline.advance(start_ns + 499_000)
    assert 11 not in pending(made) and peek(dma, "CNDTR1") == 40 - 2 * 9
    made.timeline.advance(start_ns + 510_000)
    assert 11 in pending(made) and peek(dma, "ISR") & 4 and not peek(dma, "ISR") & 2
    made.timeline.advance(start_ns + 1_010_000)
    assert peek(dma, "ISR") & 2 and peek(dma, "CNDTR1") == 40
    counts = [int.from_bytes(made.core.uc.mem_read(RAM + 2 * place, 2), "little") for place in range(40)]
    assert counts[1::2] == [1024] * 20
    for scan, count in enumerate(counts[::2]):
        sampled_s = (start_ns + 50_000 * (scan + 1)) * 1e-9 + 2.5 / HZ
        volts = 1.65 + math.sin(math.tau * 50 * sampled_s)
        assert abs(count - volts / 3.3 * 4096) <= 0.5 + 1e-6


def test_the_supplys_detector_sees_a_sag_with_hysteresis(made):
    poke(made.pwr, "CR2", 6 << 1 | 1)
    lows = []
    for supply_v in (3.3, 2.95, 2.85, 2.95, 3.05):
        made.pwr.set_supply(supply_v)
        lows.append(peek(made.pwr, "SR2") >> 11 & 1)
    assert lows == [0, 0, 1, 1, 0]
