//! The stack's high-water mark: free stack is painted at the start, and what was overwritten has been used.

use core::ptr::addr_of;

const PAINT: u32 = 0x5afe_57ac;
/// Left alone below the stack pointer while painting.
const MARGIN_WORDS: usize = 16;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

fn lowest() -> *const u32 {
    addr_of!(_stack_end)
}

/// Bytes that the linker gave the stack.
pub fn size_bytes() -> usize {
    addr_of!(_stack_start) as usize - lowest() as usize
}

/// Paints what is free; to be called first of all.
#[inline(never)]
pub fn paint() {
    let end = cortex_m::register::msp::read() as usize - 4 * MARGIN_WORDS;
    let mut word = lowest().cast_mut();
    while (word as usize) < end {
        // SAFETY: between the end of the stack and its pointer, less a margin, nothing lives.
        unsafe { word.write_volatile(PAINT) };
        word = word.wrapping_add(1);
    }
}

/// Most bytes ever in use since [`paint`].
pub fn high_water_bytes() -> usize {
    let mut word = lowest();
    // SAFETY: reads within RAM, below the stack's beginning; every bit pattern is a u32.
    while word < addr_of!(_stack_start) && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    addr_of!(_stack_start) as usize - word as usize
}
