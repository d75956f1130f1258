//! The stretches of flash in which the program keeps what must survive.

use core::cell::RefCell;
use core::slice;

use embassy_embedded_hal::flash::partition::BlockingPartition;
use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, FLASH_BASE, Flash};
use embassy_stm32::peripherals::FLASH;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use rotor_edge_boards::flash::Mapped;
use static_cell::StaticCell;

/// The last pages of the second bank: two of journal, then two for each slot.
const JOURNAL_BYTES: u32 = 4 * 1024;
const SLOTS_BYTES: u32 = 8 * 1024;
const SLOTS_START: u32 = 512 * 1024 - SLOTS_BYTES;
/// Where they begin, from the beginning of flash; they end with it.
pub const STATE_START: u32 = SLOTS_START - JOURNAL_BYTES;

type WholeFlash = Mutex<NoopRawMutex, RefCell<Flash<'static, Blocking>>>;
type Part = BlockingPartition<'static, NoopRawMutex, Flash<'static, Blocking>>;

/// A stretch of flash that nothing else uses.
pub struct State {
    part: Part,
    start: u32,
    bytes: u32,
}

impl State {
    /// The slots' stretch and the journal's.
    pub fn take(flash: Peri<'static, FLASH>) -> (Self, Self) {
        static WHOLE: StaticCell<WholeFlash> = StaticCell::new();
        let whole = WHOLE.init(Mutex::new(RefCell::new(Flash::new_blocking(flash))));
        let part = |start, bytes| Self { part: BlockingPartition::new(whole, start, bytes), start, bytes };
        (part(SLOTS_START, SLOTS_BYTES), part(STATE_START, JOURNAL_BYTES))
    }
}

impl Mapped for State {
    fn mapped(&self) -> &[u8] {
        let start = FLASH_BASE + self.start as usize;
        // SAFETY: this is flash, and nothing writes to it while `self` is borrowed.
        unsafe { slice::from_raw_parts(start as *const u8, self.bytes as usize) }
    }
}

impl ErrorType for State {
    type Error = <Part as ErrorType>::Error;
}

impl ReadNorFlash for State {
    const READ_SIZE: usize = <Part as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.part.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.bytes as usize
    }
}

impl NorFlash for State {
    const WRITE_SIZE: usize = <Part as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Part as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.part.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.part.write(offset, bytes)
    }
}
