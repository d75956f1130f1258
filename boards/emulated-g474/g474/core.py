"""The Cortex-M4F: unicorn executes the instructions; exceptions, sleep and time are here.

Instructions are executed in slices that end where something else happens. An instruction is taken to last
``CYCLES_PER_INSTRUCTION`` cycles; how many of a slice were executed is known only if it was executed whole, otherwise half
of it is assumed. Slices begin short after each sleep, so that this matters little.
"""

import struct

import unicorn
from unicorn import arm_const as arm

from .nvic import HARD_FAULT, SVCALL
from .timeline import SECOND_NS

CYCLES_PER_INSTRUCTION = 1.4
SHORTEST_SLICE, LONGEST_SLICE = 64, 4096
ACCESS_NS = 40
"""What an access to a peripheral takes, at most until the end of the slice."""
NEVER = 0xFFFFFFFE
WFE, WFI, SEV = 0xBF20, 0xBF30, 0xBF40
ARM_SVC, ARM_BKPT, ARM_EXCEPTION_EXIT = 2, 7, 8
THUMB, STACK_WAS_MISALIGNED, IT_BITS, EXCEPTION_BITS = 1 << 24, 1 << 9, 0x0600FC00, 0x1FF
CONTROL_SPSEL, CONTROL_FPCA = 2, 4
BASIC_FRAME, EXTENDED_FRAME = 32, 104
HFSR_FORCED, HFSR_DEBUGEVT = 1 << 30, 1 << 31

STACKED = [arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12, arm.UC_ARM_REG_LR]
STACKED_FLOATS = [arm.UC_ARM_REG_D0 + place for place in range(8)]
CLEARED = [arm.UC_ARM_REG_R0 + place for place in range(13)] + [arm.UC_ARM_REG_LR]


class Core:
    """Executes what is in memory, and takes exceptions as the architecture (ARMv7-M) says."""

    def __init__(self, timeline, exceptions, vector_table):
        """``vector_table()``: its address."""
        self.timeline, self.exceptions, self.vector_table = timeline, exceptions, vector_table
        self.uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.uc.hook_add(unicorn.UC_HOOK_INTR, self._on_exception)
        self.on_fault = lambda bits: None
        self.instructions = 0
        self.faults = []
        """(program counter, what happened) of each fault since the start."""
        self._stop = None
        self._slice_end_ns = 0
        self.is_asleep = self.is_locked_up = self.event_register = False
        self.pc = 0

    def watch_sleep(self, address, code):
        """Finds the instructions that sleep or signal in a stretch of memory that holds a program."""
        actions = {WFE: self._on_wfe, WFI: self._on_wfi, SEV: self._on_sev}
        for offset in range(0, len(code) - 1, 2):
            action = actions.get(code[offset] | code[offset + 1] << 8)
            if action:
                place = address + offset
                self.uc.hook_add(unicorn.UC_HOOK_CODE, action, begin=place, end=place)

    def reset(self):
        for register in CLEARED + STACKED_FLOATS:
            self.uc.reg_write(register, 0)
        for register in [arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_BASEPRI, arm.UC_ARM_REG_FAULTMASK, arm.UC_ARM_REG_CONTROL]:
            self.uc.reg_write(register, 0)
        self.uc.reg_write(arm.UC_ARM_REG_XPSR, THUMB)
        self.uc.reg_write(arm.UC_ARM_REG_FPSCR, 0)
        stack, self.pc = struct.unpack("<II", self.uc.mem_read(self.vector_table(), 8))
        self.uc.reg_write(arm.UC_ARM_REG_SP, stack)
        self.is_asleep = self.is_locked_up = self.event_register = False
        self._slice = SHORTEST_SLICE

    def tick(self):
        """An access of the program: time passes within the slice."""
        self.timeline.now_ns = max(self.timeline.now_ns, min(self.timeline.now_ns + ACCESS_NS, self._slice_end_ns))

    def is_idle(self):
        """Whether nothing is executed until something happens; wakes up if it has."""
        if self.is_locked_up:
            return True
        if self.is_asleep and (self.event_register or self.exceptions.is_ready()):
            self.is_asleep = False
            self._slice = SHORTEST_SLICE
        return self.is_asleep

    def execute(self, limit_ns, hz):
        """One slice, no longer than a time; returns how long it took."""
        instruction_ns = CYCLES_PER_INSTRUCTION * SECOND_NS / hz
        count = min(self._slice, max(1, int(limit_ns / instruction_ns)))
        self._slice = min(2 * self._slice, LONGEST_SLICE)
        start_ns = self.timeline.now_ns
        self._slice_end_ns = start_ns + int(count * instruction_ns)
        self._stop = None
        fault = None
        try:
            self.uc.emu_start(self.pc | 1, NEVER, count=count)
        except unicorn.UcError as error:
            fault = error
        self.pc = self.uc.reg_read(arm.UC_ARM_REG_PC)
        if fault is not None or self._stop is not None:
            count = (count + 1) // 2
            self._stopped(fault)
        self.instructions += count
        return max(start_ns + int(count * instruction_ns) - self.timeline.now_ns, 0)

    def break_off(self):
        """Called by a memory access: it is repeated, alone, and what is pending is taken right behind it."""
        if self._stop is None:
            self._stop = "again"
            self.uc.emu_stop()

    def take_exceptions(self):
        if not self.exceptions.pending or self.is_locked_up:
            return
        masks = [arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_BASEPRI, arm.UC_ARM_REG_FAULTMASK]
        primask, basepri, faultmask = (self.uc.reg_read(mask) for mask in masks)
        exception = self.exceptions.next(primask & 1, basepri, faultmask & 1)
        if exception is not None:
            self._enter(exception)

    # what stops a slice
    def _on_exception(self, uc, number, _):
        self._stop = number
        uc.emu_stop()

    def _on_wfe(self, uc, *_):
        # unicorn does not know the instruction, so it is passed over in any case
        self._stop = "wait for an event"
        uc.emu_stop()

    def _on_wfi(self, uc, *_):
        self._stop = "sleep"
        uc.emu_stop()

    def _on_sev(self, *_):
        self.event_register = True

    def _stopped(self, fault):
        if fault is not None:
            self._fault(str(fault), HFSR_FORCED)
        elif self._stop in ("sleep", "wait for an event"):
            self.pc += 2
            self.is_asleep = not (self._stop == "wait for an event" and self.event_register)
            self.event_register = False
        elif self._stop == "again":
            self._stop = "again, alone"
            self.uc.emu_start(self.pc | 1, NEVER, count=1)
            self.pc = self.uc.reg_read(arm.UC_ARM_REG_PC)
        elif self._stop == ARM_EXCEPTION_EXIT:
            self._leave(self.pc | 1)
        elif self._stop == ARM_SVC:
            self.exceptions.pend(SVCALL)
        elif self._stop == ARM_BKPT:
            self._fault("breakpoint without a debugger", HFSR_DEBUGEVT)
        else:
            self._fault(f"exception {self._stop} of unicorn", HFSR_FORCED)

    def _fault(self, what, bits):
        """The configurable faults are not enabled: each becomes a hard fault, and one in its handler locks the core up."""
        self.faults.append((self.pc, what))
        self.on_fault(bits)
        if self.exceptions.execution_priority() <= -1 or self.uc.reg_read(arm.UC_ARM_REG_FAULTMASK) & 1:
            self.is_locked_up = True
        else:
            self._enter(HARD_FAULT)

    # entry and return
    def _enter(self, exception):
        uc = self.uc
        xpsr = uc.reg_read(arm.UC_ARM_REG_XPSR)
        control = uc.reg_read(arm.UC_ARM_REG_CONTROL)
        has_floats = bool(control & CONTROL_FPCA)
        if control & CONTROL_SPSEL:
            raise NotImplementedError("a program that uses the process stack")
        top = uc.reg_read(arm.UC_ARM_REG_SP)
        frame = (top - (EXTENDED_FRAME if has_floats else BASIC_FRAME)) & ~7
        saved = xpsr & ~STACK_WAS_MISALIGNED | (STACK_WAS_MISALIGNED if top & 4 else 0)
        words = struct.pack("<8I", *uc.reg_read_batch(STACKED), self.pc & ~1, saved)
        if has_floats:
            words += struct.pack("<8Q", *uc.reg_read_batch(STACKED_FLOATS))
            words += struct.pack("<II", uc.reg_read(arm.UC_ARM_REG_FPSCR), 0)
            uc.reg_write(arm.UC_ARM_REG_CONTROL, control & ~CONTROL_FPCA)
        try:
            uc.mem_write(frame, words)
        except unicorn.UcError:
            self.faults.append((self.pc, "the stack overflows"))
            self.is_locked_up = True
            return
        returns_to_handler = xpsr & EXCEPTION_BITS != 0
        uc.reg_write(arm.UC_ARM_REG_SP, frame)
        uc.reg_write(arm.UC_ARM_REG_LR, (0xFFFFFFE1 if has_floats else 0xFFFFFFF1) | (0 if returns_to_handler else 8))
        uc.reg_write(arm.UC_ARM_REG_XPSR, xpsr & ~(IT_BITS | EXCEPTION_BITS) | THUMB | exception)
        self.pc = struct.unpack("<I", uc.mem_read(self.vector_table() + 4 * exception, 4))[0]
        self.exceptions.enter(exception)
        self.is_asleep, self.event_register = False, True

    def _leave(self, exc_return):
        uc = self.uc
        exception = uc.reg_read(arm.UC_ARM_REG_XPSR) & EXCEPTION_BITS
        frame = uc.reg_read(arm.UC_ARM_REG_SP)
        has_floats = not exc_return & 0x10
        *general, self.pc, xpsr = struct.unpack("<8I", uc.mem_read(frame, BASIC_FRAME))
        for register, value in zip(STACKED, general):
            uc.reg_write(register, value)
        size = BASIC_FRAME
        control = uc.reg_read(arm.UC_ARM_REG_CONTROL) & ~CONTROL_FPCA
        if has_floats:
            size = EXTENDED_FRAME
            *floats, fpscr = struct.unpack("<8QI", uc.mem_read(frame + BASIC_FRAME, 68))
            for register, value in zip(STACKED_FLOATS, floats):
                uc.reg_write(register, value)
            uc.reg_write(arm.UC_ARM_REG_FPSCR, fpscr)
            control |= CONTROL_FPCA
        if exception != 2:
            uc.reg_write(arm.UC_ARM_REG_FAULTMASK, 0)
        uc.reg_write(arm.UC_ARM_REG_CONTROL, control)
        uc.reg_write(arm.UC_ARM_REG_SP, frame + size + (4 if xpsr & STACK_WAS_MISALIGNED else 0))
        uc.reg_write(arm.UC_ARM_REG_XPSR, xpsr & ~STACK_WAS_MISALIGNED | THUMB)
        self.exceptions.leave(exception)
        self.event_register = True
