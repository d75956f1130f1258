//! What the programs for the emulated board share.

#![no_std]

pub mod clock;
pub mod instructions;
pub mod sample;
pub mod stack;
pub mod log;
pub mod state;
pub mod uart;
