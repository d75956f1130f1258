//! Why the program ended, kept in memory that a reset leaves alone, for the next start's log.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use defmt::intern;
use embassy_stm32::pac;

use crate::state::STATE_START;

const MARK: u32 = u32::from_le_bytes(*b"REf1");
/// The end of a source file's name.
const NAME_BYTES: usize = 24;
/// Size of one bank: errors are reported by bank and place in it.
const BANK_BYTES: u32 = 256 * 1024;

/// What ended the program; the log says so at the next start.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Cause {
    /// A panic; the line.
    Panic = 1,
    /// A fault of the processor; the address of the instruction.
    HardFault,
    /// An interrupt or exception without a handler; its number.
    Exception,
    /// Flash outside the stored state cannot be read any more; where, from its beginning.
    Flash,
    /// The crystal stopped.
    CrystalStopped,
    /// The crystal swings again.
    CrystalBack,
    /// The converter stopped.
    Converter,
    /// The model on trial was not confirmed.
    TrialOver,
}

#[derive(Clone, Copy)]
#[repr(C)]
struct Record {
    mark: u32,
    cause: u32,
    detail: u32,
    name: [u8; NAME_BYTES],
}

struct Kept(UnsafeCell<MaybeUninit<Record>>);

// SAFETY: written once, by what ends the program, and read before anything else runs.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".uninit.KEPT")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// Notes why, and resets.
pub fn stop(cause: Cause, detail: u32) -> ! {
    stop_in(cause, detail, "")
}

fn stop_in(cause: Cause, detail: u32, file: &str) -> ! {
    cortex_m::interrupt::disable();
    let mut name = [0; NAME_BYTES];
    for (to, from) in name.iter_mut().rev().zip(file.bytes().rev()) {
        *to = from;
    }
    let record = Record { mark: MARK, cause: cause as u32, detail, name };
    // SAFETY: interrupts are off, and nothing runs after this.
    unsafe { KEPT.0.get().write_volatile(MaybeUninit::new(record)) };
    SCB::sys_reset()
}

/// Logs what [`stop`] noted before the reset, once.
pub fn report() {
    // SAFETY: every bit pattern is a record, and only `stop`, which does not return, writes another.
    let Record { mark, cause, detail, name } = unsafe { KEPT.0.get().cast::<Record>().read_volatile() };
    // SAFETY: as above.
    unsafe { KEPT.0.get().cast::<u32>().write_volatile(0) };
    if mark != MARK {
        return;
    }
    // Interned, their letters are in the log's table and not in flash.
    let cause = match cause {
        1 => intern!("a panic in line"),
        2 => intern!("a fault of the processor at"),
        3 => intern!("an interrupt that nobody handles, number"),
        4 => intern!("flash that cannot be read at"),
        5 => intern!("the crystal, which stopped:"),
        6 => intern!("the crystal, which swings again:"),
        7 => intern!("the converter, which stopped:"),
        _ => intern!("a trial, whose model was not confirmed:"),
    };
    defmt::error!("the program ended by {=istr} {:#x} {=[u8]:a}", cause, detail, name);
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    match info.location() {
        Some(place) => stop_in(Cause::Panic, place.line(), place.file()),
        None => stop(Cause::Panic, 0),
    }
}

// SAFETY: called by the processor alone.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop(Cause::HardFault, frame.pc())
}

// SAFETY: called by the processor alone.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    stop(Cause::Exception, number as u32)
}

/// Flash with two wrong bits in a double word, or a crystal that stopped. A word of the stored state that lost power while it
/// was written is one of the former: the mark is cleared, and the checksum over it does the rest. Anywhere else the
/// program itself cannot be trusted any more.
// SAFETY: called by the processor alone.
#[exception]
unsafe fn NonMaskableInt() {
    if pac::RCC.cifr().read().cssf() {
        stop(Cause::CrystalStopped, 0);
    }
    let mark = pac::FLASH.eccr().read();
    if !mark.eccd() && !mark.eccd2() {
        stop(Cause::Exception, NMI);
    }
    let place = mark.addr_ecc() + if mark.bk_ecc() { BANK_BYTES } else { 0 };
    if mark.sysf_ecc() || mark.eccd2() || place < STATE_START {
        stop(Cause::Flash, place);
    }
    pac::FLASH.eccr().modify(|mark| mark.set_eccd(true));
}

/// Number of the interrupt that cannot be masked.
const NMI: u32 = -14_i32 as u32;
