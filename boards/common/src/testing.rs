//! Flash for tests, that behaves as flash does and loses power at a chosen moment.

use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_read,
};

use crate::flash::Mapped;

pub const WORD: usize = 8;

/// Flash of double words, each writable once after an erasure, in pages of so many bytes.
#[derive(Debug, Clone)]
pub struct Flash<const PAGE: usize> {
    pub bytes: Vec<u8>,
    pub written: Vec<bool>,
    /// Words still to be written or pages to be erased before power fails; that one is half done.
    pub power: usize,
    pub seed: u64,
    /// Writes to words that had been written, which it refuses.
    pub refused: usize,
    /// Erasures of each page.
    pub erasures: Vec<usize>,
}

#[derive(Debug)]
pub struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const PAGE: usize> ErrorType for Flash<PAGE> {
    type Error = Dead;
}

impl<const PAGE: usize> Flash<PAGE> {
    /// Not erased, but filled.
    pub fn new(pages: usize, fill: impl FnMut() -> u8) -> Self {
        let mut bytes = vec![0; pages * PAGE];
        bytes.fill_with(fill);
        let written = vec![true; bytes.len() / WORD];
        Self { bytes, written, power: usize::MAX, seed: 1, refused: 0, erasures: vec![0; pages] }
    }

    /// With power again.
    pub fn restarted(mut self) -> Self {
        self.power = usize::MAX;
        self
    }

    pub fn random(&mut self) -> u8 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 56) as u8
    }

    /// Whether there is still power for a step, and whether it is the one that is cut.
    fn spend(&mut self) -> Result<bool, Dead> {
        match self.power {
            0 => Err(Dead),
            _ => {
                self.power -= 1;
                Ok(self.power == 0)
            }
        }
    }
}

impl<const PAGE: usize> ReadNorFlash for Flash<PAGE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        check_read(self, offset, bytes.len()).map_err(|_| Dead)?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const PAGE: usize> Mapped for Flash<PAGE> {
    fn mapped(&self) -> &[u8] {
        &self.bytes
    }
}

impl<const PAGE: usize> NorFlash for Flash<PAGE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        assert!((from as usize).is_multiple_of(PAGE) && (to as usize).is_multiple_of(PAGE));
        for page in (from as usize..to as usize).step_by(PAGE) {
            let cut = self.spend()?;
            self.erasures[page / PAGE] += 1;
            for at in page..page + PAGE {
                // Half an erasure leaves anything.
                self.bytes[at] = if cut { self.random() } else { 0xff };
                self.written[at / WORD] = cut;
            }
            if cut {
                return Err(Dead);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        for (word, bytes) in (offset as usize / WORD..).zip(bytes.chunks(WORD)) {
            let cut = self.spend()?;
            if self.written[word] {
                self.refused += 1;
                return Err(Dead);
            }
            self.written[word] = true;
            // Half a write has cleared some of the bits that it was to clear, or none that is seen yet.
            let is_unseen = cut && self.random().is_multiple_of(4);
            for (at, &byte) in (word * WORD..).zip(bytes) {
                self.bytes[at] = match cut {
                    true if is_unseen => 0xff,
                    true => byte | self.random(),
                    false => byte,
                };
            }
            if cut {
                return Err(Dead);
            }
        }
        Ok(())
    }
}
