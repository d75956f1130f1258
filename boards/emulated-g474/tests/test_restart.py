"""Rows 1 to 3, 17, 20, 26: what ends the program, and that the next start says why."""

import re
import struct

import pytest
from elftools.elf.elffile import ELFFile
from unicorn import arm_const as arm

from g474.chip import RAM
from scene import causes, log, said, start

FREE = RAM + 0x40
"""The far end of the stack, which nothing reaches."""
FOREVER, UNDEFINED = b"\xfe\xe7", b"\x00\xde"
WATCHDOG_S = 0.6


def go(board, code):
    """The program jumps into the weeds, where this code lies."""
    core = board.chip.core
    core.uc.mem_write(FREE, code)
    core.uc.ctl_remove_cache(FREE, FREE + 16)
    core.pc, core.is_asleep = FREE, False


@pytest.mark.parametrize("masks_interrupts", [False, True])
def test_a_program_that_hangs_is_reset_within_its_time_and_the_log_says_by_whom(board, masks_interrupts):
    board.chip.core.uc.reg_write(arm.UC_ARM_REG_PRIMASK, int(masks_interrupts))
    hung_s = board.now_s
    go(board, FOREVER)
    board.run(2 * WATCHDOG_S)
    assert causes(board) == [["BOR"], ["IWDG"]]
    assert board.chip.resets[-1][0] - hung_s <= WATCHDOG_S
    assert "reset by the watchdog" in log(board)
    assert said(board, "Heartbeat", board.chip.resets[-1][0]), "it works again"


@pytest.mark.parametrize("after_s", [0.002, 0.004, 0.006, 0.012])
def test_a_start_that_hangs_is_reset_too(deployed_flash, after_s):
    board = start(deployed_flash, run_s=after_s)
    go(board, FOREVER)
    board.run(WATCHDOG_S + 0.3)
    assert causes(board) == [["BOR"], ["IWDG"]] and said(board, "Heartbeat")


def test_a_fault_of_the_processor_resets_at_once_and_the_log_says_where(deployed_flash):
    board = start(deployed_flash)
    fault_s = board.now_s
    go(board, UNDEFINED)
    board.run(0.3)
    assert causes(board) == [["BOR"], ["SFT"]] and board.chip.resets[-1][0] - fault_s < 1e-3
    assert f"{FREE:#x}" in log(board) and "reset by the program itself" in log(board)


def test_an_interrupt_that_nobody_handles_resets_at_once_and_the_log_says_which(board):
    nobodys = 54
    board.chip.exceptions.enabled.add(16 + nobodys)
    board.chip.exceptions.pend(16 + nobodys)
    board.run(0.3)
    assert causes(board) == [["BOR"], ["SFT"]] and re.search(rf"nobody handles.*{nobodys:#x}", log(board))


def test_a_stack_that_runs_over_ends_in_a_reset(deployed_flash):
    board = start(deployed_flash)
    over_s = board.now_s
    board.chip.core.uc.reg_write(arm.UC_ARM_REG_SP, RAM + 8)
    go(board, b"\xff\xb5" + FOREVER)  # push {r0-r7, lr}
    board.run(2 * WATCHDOG_S)
    assert len(causes(board)) == 2 and board.chip.resets[-1][0] - over_s <= WATCHDOG_S
    assert said(board, "Heartbeat", board.chip.resets[-1][0])


def test_a_damaged_word_of_the_program_resets_for_as_long_as_it_lasts(deployed_flash):
    board = start(deployed_flash)
    place = symbols(board.image)["DMA1_CHANNEL1"]  # the converter's samples: runs all the time, and only after the start's log
    board.chip.damage(place)
    board.run(0.5)
    assert len(causes(board)) > 3 and causes(board)[1:] == [["SFT"]] * (len(causes(board)) - 1)
    assert f"cannot be read at {(place & ~7) - 0x08000000:#x}" in log(board)
    board.chip.flash.double_errors.clear()
    board.run(0.5)
    resets = len(causes(board))
    board.run(1.0)
    assert len(causes(board)) == resets and said(board, "Heartbeat", board.now_s - 1.1)


def test_a_brown_out_resets_at_the_level_of_the_option_bytes_and_the_log_says_so(board):
    board.chip.pwr.set_supply(2.81)
    board.run(0.1)
    assert causes(board) == [["BOR"]]
    board.chip.pwr.set_supply(2.7)
    board.run(0.1)
    heard = len(board.wire.log)
    board.run(1.0)
    assert len(board.wire.log) == heard, "held in reset"
    board.chip.pwr.set_supply(3.3)
    board.run(0.3)
    assert causes(board) == [["BOR"], ["BOR"]] and "reset by brown-out" in log(board)


def test_the_reset_button_is_told_from_other_causes(board):
    board.chip.reset_pin()
    board.run(0.3)
    assert "reset by the reset pin" in log(board) and "watchdog" not in log(board)


def test_a_panic_resets_at_once_and_the_log_says_file_and_line(board):
    core = board.chip.core
    # Location { file, length, line, column }; it is the last argument of whatever panics
    file, location = FREE + 0x40, FREE + 0x20
    core.uc.mem_write(file, b"src/somewhere.rs")
    core.uc.mem_write(location, struct.pack("<4I", file, 16, 1234, 5))
    for register in range(4):
        core.uc.reg_write(arm.UC_ARM_REG_R0 + register, location)
    panicked_s = board.now_s
    core.pc, core.is_asleep = panics(board.image), False
    board.run(0.3)
    assert causes(board) == [["BOR"], ["SFT"]] and board.chip.resets[-1][0] - panicked_s < 1e-3
    assert f"panic in line {1234:#x}" in log(board) and "somewhere.rs" in log(board)


def panics(image):
    """The function through which every panic goes; where only one place leads to another, that place is built into it."""
    return next(place for name, place in symbols(image).items() if "9panic_fmt" in name)


def symbols(image):
    """Names of the program and their addresses."""
    with open(image, "rb") as file:
        return {symbol.name: symbol["st_value"] & ~1 for symbol in ELFFile(file).get_section_by_name(".symtab").iter_symbols()}
