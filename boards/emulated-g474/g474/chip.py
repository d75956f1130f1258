"""An STM32G474RE: the core, its memories, the peripherals at their addresses, resets and power."""

import random
import struct

import unicorn
from elftools.elf.elffile import ELFFile

from .adc import INPUTS, Adc, AdcCommon
from .core import Core
from .dma import CHANNELS as DMA_CHANNELS
from .dma import Dma, DmaMux
from .exti import Exti
from .fdcan import Fdcan
from .flash import BANK_2, BANK_BYTES, START, WORD_BYTES, Flash
from .gpio import Gpio
from .message_ram import MessageRam
from .nvic import NMI, Dwt, Exceptions, SystemControl
from .pins import timer_inputs
from .pwr import Pwr
from .rcc import Rcc
from .small import Dbgmcu, Rtc, Syscfg, Tamp
from .tim import Timer
from .timeline import SECOND_NS, Timeline
from .watchdogs import Iwdg, Wwdg

RAM, RAM_BYTES = 0x20000000, 128 * 1024
CCM, CCM_BYTES = 0x10000000, 32 * 1024
SYSTEM, SYSTEM_BYTES = 0x1FFF0000, 64 * 1024
FACTORY_DATA = {0x1FFF7590: b"emulated-g474", 0x1FFF75A8: struct.pack("<HH", 1036, 1655), 0x1FFF75E0: b"\x00\x02"}
"""Identification, calibration of the temperature sensor and the reference, size of the flash in KiB."""
PERIPHERALS = [(0x40000000, 0x30000), (0x48000000, 0x2000), (0x50000000, 0x61000), (0xE0000000, 0x100000)]
BLOCK = 0x100
SPIN_NS = 100_000
"""How far a loop is taken that polls for what never comes."""


class Chip:
    """Holds everything together. Time passes in :meth:`run`."""

    def __init__(self, timeline=None):
        self.timeline = timeline or Timeline()
        self.exceptions = Exceptions()
        self.peripherals = []
        self.unknown = set()
        """Registers that the program used and that are not modelled: (peripheral, offset)."""
        self.resets = []
        """(time, causes) of every reset."""
        self.core = Core(self.timeline, self.exceptions, lambda: self.scb.reg["VTOR"] or START)
        self._blocks = {}
        self._place_peripherals()
        self._map_memory()
        self._reset_causes = set()
        self._is_stopping = False
        self.is_powered = False
        self.on_reset = lambda: None

    def _place_peripherals(self):
        self.rcc = Rcc(self, "RCC", 0x40021000)
        add = self._add
        add(self.rcc, 1024)
        self.scb = add(SystemControl(self, "SCS", 0xE000E000), 4096)
        add(Dwt(self, "DWT", 0xE0001000), 4096)
        add(Dbgmcu(self, "DBGMCU", 0xE0042000), 1024)
        self.flash = add(Flash(self, "FLASH", 0x40022000), 1024)
        self.exti = add(Exti(self, "EXTI", 0x40010400), 1024)
        self.pwr = add(Pwr(self, "PWR", 0x40007000), 1024)
        self.tamp = add(Tamp(self, "TAMP", 0x40002400), 1024)
        add(Rtc(self, "RTC", 0x40002800), 1024)
        add(Syscfg(self, "SYSCFG", 0x40010000), 512)
        self.iwdg = add(Iwdg(self, "IWDG", 0x40003000), 1024)
        self.wwdg = add(Wwdg(self, "WWDG", 0x40002C00), 1024)
        self.gpio = {
            letter: add(Gpio(self, f"GPIO{letter}", 0x48000000 + 0x400 * place, place), 1024)
            for place, letter in enumerate("ABCDEFG")
        }
        self.timers = {}
        for name, base, clock, interrupt, options in [
            ("TIM2", 0x40000000, ("APB1ENR1", 0), 28, {"bits": 32, "requests": (56, 57, 58, 59)}),
            ("TIM3", 0x40000400, ("APB1ENR1", 1), 29, {"requests": (61, 62, 63, 64)}),
            ("TIM4", 0x40000800, ("APB1ENR1", 2), 30, {"requests": (67, 68, 69, 70)}),
            ("TIM5", 0x40000C00, ("APB1ENR1", 3), 50, {"bits": 32, "requests": (72, 73, 74, 75)}),
            ("TIM6", 0x40001000, ("APB1ENR1", 4), 54, {}),
            ("TIM7", 0x40001400, ("APB1ENR1", 5), 55, {}),
            ("TIM15", 0x40014000, ("APB2ENR", 16), 24, {"requests": (78,)}),
            ("TIM16", 0x40014400, ("APB2ENR", 17), 25, {"requests": (82,)}),
            ("TIM17", 0x40014800, ("APB2ENR", 18), 26, {"requests": (84,)}),
        ]:
            self.timers[name] = add(Timer(self, name, base, clock, interrupt, **options), 1024)
        self.dmamux = add(DmaMux(self, "DMAMUX", 0x40020800), 1024)
        self.dmas = [add(Dma(self, f"DMA{number + 1}", 0x40020000 + 0x400 * number, number), 1024) for number in range(2)]
        self.adc = add(Adc(self, "ADC1", 0x50000000), 256)
        self.adc_common = add(AdcCommon(self, "ADC12_COMMON", 0x50000300), 256)
        self.message_ram = add(MessageRam(self, "FDCAN1_RAM", 0x4000A400), 0xA00)
        self.fdcan = add(Fdcan(self, "FDCAN1", 0x40006400, self.message_ram), 1024)

    def _add(self, peripheral, size):
        self.peripherals.append(peripheral)
        for block in range(peripheral.base // BLOCK, (peripheral.base + size + BLOCK - 1) // BLOCK):
            self._blocks[block] = peripheral
        return peripheral

    def _map_memory(self):
        uc = self.core.uc
        uc.mem_map(START, BANK_BYTES, unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC)
        uc.mem_map(SYSTEM, SYSTEM_BYTES, unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC)
        for address, data in FACTORY_DATA.items():
            uc.mem_write(address, data)
        uc.mem_map(RAM, RAM_BYTES)
        uc.mem_map(CCM, CCM_BYTES)
        for base, size in PERIPHERALS:
            uc.mmio_map(base, size, self._read, base, self._write, base)
        uc.mmio_map(BANK_2, BANK_BYTES, self._read_bank_2, None, self._write_bank_2, None)
        uc.hook_add(unicorn.UC_HOOK_MEM_WRITE_PROT, self._write_bank_1)

    # what the program reads and writes
    def _read(self, _, offset, size, base):
        self.core.tick()
        address = base + offset
        peripheral = self._blocks.get(address // BLOCK)
        if peripheral is None:
            self.unknown.add(("nothing", address))
            return 0
        return peripheral.read(address - peripheral.base, size)

    def _write(self, _, offset, size, value, base):
        self.core.tick()
        address = base + offset
        peripheral = self._blocks.get(address // BLOCK)
        if peripheral is None:
            self.unknown.add(("nothing", address))
        else:
            peripheral.write(address - peripheral.base, size, value)

    def _read_bank_2(self, _, offset, size, __):
        return self.flash.read_bank_2(offset, size)

    def _write_bank_2(self, _, offset, size, value, __):
        self.flash.program(BANK_2 + offset, size, value)

    def _write_bank_1(self, _, __, address, size, value, ___):
        is_flash = START <= address < BANK_2
        if is_flash:
            self.flash.program(address, size, value)
        return is_flash

    # what peripherals ask for
    def write_memory(self, address, data):
        """A write by DMA; ``False``: there is no memory."""
        try:
            self.core.uc.mem_write(address, data)
        except unicorn.UcError:
            return False
        return True

    def flash_changed(self):
        self.core.uc.mem_write(START, bytes(self.flash.banks[0]))
        self.core.uc.ctl_remove_cache(START, BANK_2)

    def pend_nmi(self):
        self.exceptions.pend(NMI)
        self.core.break_off()

    def request_reset(self, cause):
        self._reset_causes.add(cause)

    def hold_in_reset(self, cause):
        """Nothing runs while the reason lasts, watchdogs included."""
        self._reset_causes = {cause}
        self._reset_peripherals()

    def stall(self, until_ns):
        """The core waits for a memory; everything else goes on."""
        self.timeline.advance(until_ns)

    def spin(self, until_ns):
        """The program polls for something that comes at that time (``None``: nobody knows): skips to it, or to what
        happens before. What interrupts it does so."""
        if self.exceptions.is_ready() or self._reset_causes:
            return
        now_ns = self.timeline.now_ns
        times = [until_ns if until_ns is not None and until_ns > now_ns else now_ns + SPIN_NS]
        if (next_ns := self.timeline.next_ns()) is not None:
            times.append(next_ns)
        self.timeline.advance(max(min(times), now_ns))

    def _dma_channels(self, request):
        for channel in self.dmamux.channels(request):
            number, place = divmod(channel, DMA_CHANNELS)
            yield self.dmas[number], place + 1

    def request_dma(self, request, values):
        """Hands values to the channels that serve a request; ``False``: none does."""
        served = False
        for dma, channel in self._dma_channels(request):
            if dma.is_on(channel):
                dma.transfer(channel, values)
                served = True
        return served

    def until_dma_interrupt(self, request):
        waits = [dma.until_interrupt(channel) for dma, channel in self._dma_channels(request) if dma.is_on(channel)]
        return min((wait for wait in waits if wait is not None), default=None)

    def trigger_changes(self):
        """What a trigger has started so far is converted before it changes."""
        self.adc.catch_up()

    def requests_changed(self):
        self.adc.replan()

    def pin_changed(self, letter, pin, level):
        for timer, channel in timer_inputs(letter, pin, self.gpio[letter].alternate(pin)):
            self.timers[timer].edge(channel, level)
        external = self._blocks[0x400100].reg[f"EXTICR{pin // 4 + 1}"] >> 4 * (pin % 4) & 0xF
        if "ABCDEFG"[external : external + 1] == letter:
            self.exti.edge(pin, level)

    def pins_are(self, *pins_and_function):
        """Whether pins like ``"A11"`` have an alternate function."""
        *pins, function = pins_and_function
        return all(self.gpio[pin[0]].alternate(int(pin[1:])) == function for pin in pins)

    # from outside
    def flash_image(self, path):
        """Programs an ELF file, as a debugger does it: whole pages, nothing else is touched."""
        code = []
        with open(path, "rb") as file:
            for segment in ELFFile(file).iter_segments():
                if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                    bank, offset = divmod(segment["p_paddr"] - START, BANK_BYTES)
                    self.flash.banks[bank][offset : offset + segment["p_filesz"]] = segment.data()
                    code.append((segment["p_paddr"], segment.data()))
        self.flash_changed()
        for address, data in code:
            self.core.watch_sleep(address, data)

    def connect(self, pin, signal):
        """Connects a pin to a voltage over time: ``signal(time_s)`` in V."""
        self.adc.signals[INPUTS[pin]] = signal

    def damage(self, address):
        """Two bits of a double word flip: read, it is reported by an interrupt that cannot be masked. In the program's
        bank it reads as before, so that what is seen comes of the report."""
        word = address & ~7
        self.flash.double_errors.add(word)
        if word >= BANK_2:
            self.flash.banks[1][word - BANK_2] ^= 0x21
        else:
            for hook in (unicorn.UC_HOOK_MEM_READ, unicorn.UC_HOOK_CODE):
                self.core.uc.hook_add(hook, lambda *_: self.flash.check(word), begin=word, end=word + WORD_BYTES - 1)
            self.core.uc.ctl_remove_cache(START, BANK_2)

    def power_on(self, seed=0):
        """Memory holds noise, and so do not the backup registers: they are zero."""
        noise = random.Random(seed)
        self.core.uc.mem_write(RAM, noise.randbytes(RAM_BYTES))
        self.core.uc.mem_write(CCM, noise.randbytes(CCM_BYTES))
        self.tamp.erase()
        self.is_powered = True
        self._reset_causes.add("BOR")

    def power_off(self):
        self.is_powered = False
        self.rcc._reset_flags = 0
        self._reset_peripherals()

    def reset_pin(self):
        self._reset_causes.add("PIN")

    def _reset_peripherals(self):
        for peripheral in self.peripherals:
            peripheral.reset()

    def _reset(self):
        causes, self._reset_causes = sorted(self._reset_causes), set()
        self.on_reset()
        self.resets.append((self.timeline.now_ns / SECOND_NS, causes))
        self._reset_peripherals()
        self.rcc.note_reset(causes)
        self.core.reset()

    def stop(self):
        """Ends :meth:`run` soon."""
        self._is_stopping = True

    def run(self, seconds):
        """Lets virtual time pass, until :meth:`stop` at most; ``True`` if that was called."""
        return run([self], seconds)

    def is_awake(self):
        """Whether the core executes; what is due before that, a reset or an exception, happens."""
        if not self.is_powered or self.pwr.is_browned_out():
            return False
        if self._reset_causes:
            self._reset()
        if not self.rcc.hclk_hz:
            return False
        self.core.take_exceptions()
        return not self.core.is_idle()

    def take_stop(self):
        was_stopping, self._is_stopping = self._is_stopping, False
        return was_stopping


def run(chips, seconds):
    """Lets time pass for chips that share it; what they execute in a slice happens at once. ``True``: one was stopped."""
    timeline = chips[0].timeline
    end_ns = timeline.now_ns + int(seconds * SECOND_NS)
    while timeline.now_ns < end_ns:
        if any([chip.take_stop() for chip in chips]):
            return True
        awake = [chip for chip in chips if chip.is_awake()]
        start_ns, next_ns = timeline.now_ns, timeline.next_ns()
        next_ns = end_ns if next_ns is None else min(next_ns, end_ns)
        if not awake or next_ns <= start_ns:
            timeline.advance(max(next_ns, start_ns))
            continue
        stop_ns = next_ns
        for chip in awake:
            if timeline.now_ns <= stop_ns:
                timeline.now_ns = start_ns
            rest_ns = chip.core.execute(max(stop_ns - timeline.now_ns, 1), chip.rcc.hclk_hz)
            stop_ns = timeline.now_ns + rest_ns
        timeline.advance(stop_ns)
    return False
