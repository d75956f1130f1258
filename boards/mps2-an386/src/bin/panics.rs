//! Panics at its first start with the firmware's own handler, and ends well at its second: reported and reset.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use rotor_edge_mps2_an386::log::report_and_reset;
use rotor_edge_mps2_an386::state::StateMemory;
use rotor_edge_mps2_an386::uart;

const MARK: [u8; 8] = *b"panicked";

#[entry]
fn main() -> ! {
    uart::start();
    // SAFETY: once, here.
    let (mut memory, _) = unsafe { StateMemory::take() };
    let mut found = [0; MARK.len()];
    let read = memory.read(0, &mut found).is_ok();
    if read && found == MARK {
        debug::exit(debug::EXIT_SUCCESS);
    }
    let marked = memory.erase(0, StateMemory::ERASE_SIZE as u32).and_then(|()| memory.write(0, &MARK));
    panic!("on purpose, marked: {:?}", marked.is_ok());
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    report_and_reset(info)
}
