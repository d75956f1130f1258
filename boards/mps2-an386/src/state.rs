//! Flash as this board would have it: a stretch of memory that survives a reset, with a flash's rules.

use core::ptr::addr_of;
use core::slice;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use rotor_edge_boards::flash::Mapped;

const PAGE_BYTES: usize = 2048;
const WORD_BYTES: usize = 8;
const ERASED: u8 = 0xff;

unsafe extern "C" {
    static _state_start: u8;
    static _state_bytes: u8;
}

/// Of it, the journal's part; the slots' follows.
const JOURNAL_BYTES: usize = 2 * PAGE_BYTES;

/// A part of the stretch that `memory.x` names.
pub struct StateMemory {
    start: usize,
    bytes: usize,
}

impl StateMemory {
    /// Takes the slots' part and the journal's.
    ///
    /// # Safety
    /// To be called once: two owners would write over each other.
    pub unsafe fn take() -> (Self, Self) {
        let (start, bytes) = (addr_of!(_state_start) as usize, addr_of!(_state_bytes) as usize);
        let slots = Self { start: start + JOURNAL_BYTES, bytes: bytes - JOURNAL_BYTES };
        (slots, Self { start, bytes: JOURNAL_BYTES })
    }

    fn at(&self, offset: u32) -> *mut u8 {
        (self.start + offset as usize) as *mut u8
    }

    fn each(&self, offset: u32, length: usize) -> impl Iterator<Item = *mut u8> + use<> {
        let first = self.at(offset);
        (0..length).map(move |place| first.wrapping_add(place))
    }
}

impl Mapped for StateMemory {
    fn mapped(&self) -> &[u8] {
        // SAFETY: within the stretch, of which only `self` uses this part, and writes while nobody reads.
        unsafe { slice::from_raw_parts(self.at(0), self.bytes) }
    }
}

/// A stretch outside the memory, or one that does not begin and end where it must.
#[derive(Debug)]
pub struct StateError(NorFlashErrorKind);

impl NorFlashError for StateError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl ErrorType for StateMemory {
    type Error = StateError;
}

impl ReadNorFlash for StateMemory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StateError> {
        check_read(self, offset, bytes.len()).map_err(StateError)?;
        for (place, byte) in self.each(offset, bytes.len()).zip(bytes) {
            // SAFETY: checked to lie within the stretch, which only `self` uses.
            *byte = unsafe { place.read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes
    }
}

impl NorFlash for StateMemory {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = PAGE_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), StateError> {
        check_erase(self, from, to).map_err(StateError)?;
        for place in self.each(from, (to - from) as usize) {
            // SAFETY: as above.
            unsafe { place.write_volatile(ERASED) };
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StateError> {
        check_write(self, offset, bytes.len()).map_err(StateError)?;
        for (place, &byte) in self.each(offset, bytes.len()).zip(bytes) {
            // SAFETY: as above. Writing can only clear bits.
            unsafe { place.write_volatile(place.read_volatile() & byte) };
        }
        Ok(())
    }
}
