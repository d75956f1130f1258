//! Flash that loses power at a chosen word.

use core::sync::atomic::{AtomicU32, Ordering};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use rotor_edge_boards::flash::Mapped;
use rotor_edge_mps2_an386::state::StateMemory;

/// Words still to be written and pages to be erased before power fails.
static POWER: AtomicU32 = AtomicU32::new(u32::MAX);

/// From now on power fails after so many words and pages.
pub fn fails_after(steps: u32) {
    POWER.store(steps, Ordering::Relaxed);
}

/// Power is back.
pub fn is_back() {
    POWER.store(u32::MAX, Ordering::Relaxed);
}

/// The board's memory, which both its parts lose power with.
pub struct Powered(pub StateMemory);

#[derive(Debug)]
pub struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Whether there is power for another step.
fn spend() -> Result<(), NoPower> {
    let left = POWER.load(Ordering::Relaxed).checked_sub(1).ok_or(NoPower)?;
    POWER.store(left, Ordering::Relaxed);
    Ok(())
}

impl Mapped for Powered {
    fn mapped(&self) -> &[u8] {
        self.0.mapped()
    }
}

impl ErrorType for Powered {
    type Error = NoPower;
}

impl ReadNorFlash for Powered {
    const READ_SIZE: usize = StateMemory::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NoPower> {
        self.0.read(offset, bytes).map_err(|_| NoPower)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Powered {
    const WRITE_SIZE: usize = StateMemory::WRITE_SIZE;
    const ERASE_SIZE: usize = StateMemory::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NoPower> {
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            spend()?;
            self.0.erase(page, page + Self::ERASE_SIZE as u32).map_err(|_| NoPower)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoPower> {
        for (at, word) in (offset..).step_by(Self::WRITE_SIZE).zip(bytes.chunks(Self::WRITE_SIZE)) {
            spend()?;
            self.0.write(at, word).map_err(|_| NoPower)?;
        }
        Ok(())
    }
}
