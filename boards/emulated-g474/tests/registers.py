"""A chip without a program, and its registers by name."""

from g474.chip import Chip

ENABLE_ALL = 0xFFFFFFFF


def chip(crystal_hz=24_000_000):
    """All peripherals have a clock; the chip's own oscillator runs, 16 MHz."""
    made = Chip()
    made.rcc.hse_hz = crystal_hz
    for register in ("AHB1ENR", "AHB2ENR", "APB1ENR1", "APB2ENR"):
        poke(made.rcc, register, ENABLE_ALL)
    return made


def poke(peripheral, register, value, size=4):
    peripheral.write(offset(peripheral, register), size, value)


def peek(peripheral, register):
    return peripheral.read(offset(peripheral, register), 4)


def offset(peripheral, register):
    return next(place for place, name in peripheral.REGISTERS.items() if name == register)


def pending(made):
    """Interrupts that wait, by number."""
    return {exception - 16 for exception in made.exceptions.pending if exception >= 16}
