//! What the programs for the emulated board share.

#![no_std]

pub mod clock;
pub mod instructions;
pub mod log;
pub mod sample;
pub mod stack;
pub mod state;
pub mod uart;

use cortex_m_rt::{ExceptionFrame, exception};

/// Ends like a panic, so that each program reports it in its way.
// SAFETY: called by the processor alone.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    panic!("hard fault at {:#010x}", frame.pc())
}
