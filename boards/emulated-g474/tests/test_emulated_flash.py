"""The flash by its registers: locked, double words once, pages, errors of the error code with their address."""

import pytest

from g474.flash import BANK_2, BSY, ECC_BANK_2, ECCD, KEYS, LOCK, PER, PG, PGAERR, PGSERR, PROGERR, SIZERR, STRT, Change
from registers import chip, peek, poke

BKER = 1 << 11


@pytest.fixture
def made():
    return chip()


def unlock(made):
    for key in KEYS:
        poke(made.flash, "KEYR", key)


def write(made, address, low, high):
    made.flash.program(address, 4, low)
    made.flash.program(address + 4, 4, high)


def read(made, address):
    return made.flash.read_bank_2(address - BANK_2, 4)


def erase(made, page):
    poke(made.flash, "CR", PER | BKER | page << 3)
    poke(made.flash, "CR", PER | BKER | page << 3 | STRT)


def test_locked_it_takes_nothing_and_a_wrong_key_locks_it_until_a_reset(made):
    write(made, BANK_2, 1, 2)
    assert peek(made.flash, "SR") & PGSERR and read(made, BANK_2) == 0xFFFFFFFF
    poke(made.flash, "KEYR", 0x12345678)
    unlock(made)
    assert peek(made.flash, "CR") & LOCK
    made.flash.reset()
    unlock(made)
    assert not peek(made.flash, "CR") & LOCK


def test_a_double_word_is_written_once_and_then_only_to_zero(made):
    unlock(made)
    poke(made.flash, "CR", PG)
    write(made, BANK_2 + 8, 0x11223344, 0x55667788)
    assert (read(made, BANK_2 + 8), read(made, BANK_2 + 12)) == (0x11223344, 0x55667788)
    write(made, BANK_2 + 8, 0x11223344, 0x55667788)
    assert peek(made.flash, "SR") & PROGERR
    poke(made.flash, "SR", PROGERR)
    write(made, BANK_2 + 8, 0, 0)
    assert read(made, BANK_2 + 8) == 0 and not peek(made.flash, "SR") & PROGERR


def test_halves_of_other_sizes_or_places_are_refused(made):
    unlock(made)
    poke(made.flash, "CR", PG)
    made.flash.program(BANK_2, 2, 1)
    assert peek(made.flash, "SR") & SIZERR
    made.flash.program(BANK_2 + 4, 4, 1)
    assert peek(made.flash, "SR") & PGAERR
    assert read(made, BANK_2) == 0xFFFFFFFF


def test_a_page_is_erased_in_22_ms_and_a_word_written_in_82_us(made):
    unlock(made)
    poke(made.flash, "CR", PG)
    start_ns = made.timeline.now_ns
    write(made, BANK_2 + 2048, 1, 2)
    while peek(made.flash, "SR") & BSY:
        pass
    assert made.timeline.now_ns - start_ns == 82_000
    poke(made.flash, "CR", 0)
    start_ns = made.timeline.now_ns
    erase(made, 1)
    while peek(made.flash, "SR") & BSY:
        pass
    assert made.timeline.now_ns - start_ns == 22_000_000
    assert read(made, BANK_2 + 2048) == 0xFFFFFFFF


def test_what_is_busy_holds_up_who_reads_its_bank(made):
    unlock(made)
    erase(made, 0)
    start_ns = made.timeline.now_ns
    read(made, BANK_2 + 4096)
    assert made.timeline.now_ns - start_ns == 22_000_000


def test_a_word_with_two_wrong_bits_pends_nmi_and_says_where(made):
    made.damage(BANK_2 + 0x3F010)
    read(made, BANK_2 + 0x3F000)
    assert not made.exceptions.pending
    read(made, BANK_2 + 0x3F014)
    assert made.exceptions.pending == {2}
    assert peek(made.flash, "ECCR") == ECCD | ECC_BANK_2 | 0x3F010
    poke(made.flash, "ECCR", ECCD)
    assert not peek(made.flash, "ECCR") & ECCD


def test_a_torn_write_is_neither_old_nor_new_and_its_error_is_seen(made):
    change = Change(0, BANK_2 + 16, bytes(8))
    made.flash.tear(change, lambda before, after: before & 0xF0 | after & 0x0F)
    assert read(made, BANK_2 + 16) == 0xF0F0F0F0 and made.exceptions.pending == {2}
