"""The core, on a few instructions: exceptions by priority, sleep, floats kept, faults, instructions cut anywhere."""

import struct

import pytest
from unicorn import arm_const as arm

from g474.chip import RAM
from g474.flash import START
from registers import chip, peek, pending, poke

CODE, HANDLER, OTHER, FAULTS = START + 0x400, START + 0x500, START + 0x600, START + 0x700
FOREVER = [0xE7FE]
RETURN = [0x4770]
STORE_IPSR = [0xF3EF, 0x8305, 0x6003, 0x3004]  # mrs r3, ipsr; str r3, [r0]; adds r0, #4


def program(**places):
    """A chip with code at its places: ``main``, ``handler`` (interrupt 28), ``other`` (29), ``faults`` (hard fault, NMI)."""
    made = chip()
    vectors = [RAM + 0x1000, CODE | 1] + [FAULTS | 1] * 14 + [FAULTS | 1] * 102
    vectors[16 + 28], vectors[16 + 29] = HANDLER | 1, OTHER | 1
    bank = made.flash.banks[0]
    bank[: 4 * len(vectors)] = struct.pack(f"<{len(vectors)}I", *vectors)
    for name, address in [("main", CODE), ("handler", HANDLER), ("other", OTHER), ("faults", FAULTS)]:
        code = struct.pack(f"<{len(places.get(name, FOREVER))}H", *places.get(name, FOREVER))
        bank[address - START : address - START + len(code)] = code
    made.flash_changed()
    made.core.watch_sleep(START, bytes(bank[:0x800]))
    made.power_on()
    made.run(1e-6)
    return made


def register(made, number):
    return made.core.uc.reg_read(arm.UC_ARM_REG_R0 + number)


def test_a_more_urgent_interrupt_interrupts_and_a_less_urgent_one_waits():
    made = program(main=[0xBF00] + FOREVER, handler=STORE_IPSR + FOREVER, other=STORE_IPSR + RETURN)
    made.core.uc.reg_write(arm.UC_ARM_REG_R0, RAM)
    poke(made.scb, "IPR7", 0x10_80)  # 28 at 0x80, 29 at 0x10
    poke(made.scb, "ISER0", 3 << 28)
    poke(made.scb, "ISPR0", 1 << 28)
    made.run(5e-6)
    poke(made.scb, "ISPR0", 1 << 29)
    made.run(5e-6)
    seen = struct.unpack("<3I", made.core.uc.mem_read(RAM, 12))
    assert seen[:2] == (16 + 28, 16 + 29) and made.core.pc == HANDLER + 2 * len(STORE_IPSR)
    assert made.exceptions.active == [16 + 28]


def test_registers_and_floats_survive_an_interrupt_that_uses_them():
    spoil = [0x2000, 0xEE00, 0x0A10, 0xEEF0, 0x0A40, 0x2107, 0x220B] + RETURN
    add = [0xEE30, 0x0A20]  # vadd.f32 s0, s0, s1: the floats are in use
    made = program(main=add + [0x3001] + FOREVER, handler=spoil)
    uc = made.core.uc
    made.run(5e-6)
    before = {place: 0x3F800000 + place for place in range(16)}
    for place, value in before.items():
        uc.reg_write(arm.UC_ARM_REG_S0 + place, value)
    for place in range(4):
        uc.reg_write(arm.UC_ARM_REG_R0 + place, 100 + place)
    stack = uc.reg_read(arm.UC_ARM_REG_SP)
    poke(made.scb, "ISER0", 1 << 28)
    poke(made.scb, "ISPR0", 1 << 28)
    made.run(5e-6)
    assert not made.exceptions.active and made.core.pc == CODE + 6
    assert [register(made, place) for place in range(4)] == [100, 101, 102, 103]
    assert {place: uc.reg_read(arm.UC_ARM_REG_S0 + place) for place in range(16)} == before
    assert uc.reg_read(arm.UC_ARM_REG_SP) == stack


def test_masked_interrupts_wait_and_nmi_does_not():
    made = program(main=[0xB672] + FOREVER, handler=FOREVER, faults=FOREVER)  # cpsid i
    poke(made.scb, "ISER0", 1 << 28)
    poke(made.scb, "ISPR0", 1 << 28)
    made.run(5e-6)
    assert made.exceptions.active == [] and 28 in pending(made)
    made.pend_nmi()
    made.run(5e-6)
    assert made.exceptions.active == [2]


def test_wfe_sleeps_until_an_event_and_sev_before_it_is_one():
    made = program(main=[0xBF20, 0x3001, 0xBF40, 0xBF20, 0x3001, 0xBF20, 0x3001] + FOREVER, handler=RETURN)
    made.core.uc.reg_write(arm.UC_ARM_REG_R0, 0)
    made.run(1e-3)
    assert register(made, 0) == 0 and made.core.is_asleep
    executed = made.core.instructions
    made.run(1.0)
    assert made.core.instructions == executed, "sleep costs nothing"
    poke(made.scb, "ISER0", 1 << 28)
    poke(made.scb, "ISPR0", 1 << 28)
    made.run(1e-3)
    assert register(made, 0) >= 2, "the interrupt woke it, and sev made the second wfe pass"


def test_an_unknown_instruction_is_a_hard_fault_and_one_in_its_handler_locks_up():
    made = program(main=[0xDE00], faults=[0x3001] + FOREVER)
    made.run(5e-6)
    assert made.exceptions.active == [3] and len(made.core.faults) == 1
    made = program(main=[0xDE00], faults=[0xDE00])
    made.run(5e-6)
    assert made.core.is_locked_up


def test_memory_that_is_not_there_is_a_hard_fault():
    made = program(main=[0x2000, 0x4240, 0x6800] + FOREVER)  # movs r0, #0; negs; ldr [0xffffffff & ~3]
    made.core.uc.reg_write(arm.UC_ARM_REG_R0, 0)
    made = program(main=[0x2001, 0x0740, 0x6800] + FOREVER)  # r0 = 1 << 29 is memory; must not fault
    made.run(5e-6)
    assert made.core.faults == []
    made = program(main=[0x2003, 0x0740, 0x6800] + FOREVER)  # r0 = 3 << 29 is nothing
    made.run(5e-6)
    assert len(made.core.faults) == 1


@pytest.mark.parametrize("longest", [1, 2, 3, 1000])
def test_instructions_cut_anywhere_give_the_same(monkeypatch, longest):
    # r1 counts what a conditional block of three adds for odd r0: 64 times
    block = [0x2000, 0x2100, 0x07C2, 0xBF42, 0x3101, 0x3102, 0x3103, 0x3001, 0x2840, 0xD1F7] + FOREVER
    monkeypatch.setattr("g474.core.SHORTEST_SLICE", longest)
    monkeypatch.setattr("g474.core.LONGEST_SLICE", longest)
    made = program(main=block)
    made.run(2e-3)
    assert (register(made, 0), register(made, 1)) == (64, 32 * 6)


def test_a_reset_clears_registers_and_leaves_memory():
    made = program(main=[0xB672] + FOREVER)
    made.core.uc.mem_write(RAM + 0x2000, b"kept")
    made.reset_pin()
    made.run(5e-6)
    assert bytes(made.core.uc.mem_read(RAM + 0x2000, 4)) == b"kept"
    assert peek(made.rcc, "CSR") >> 26 & 1 and len(made.resets) == 2
