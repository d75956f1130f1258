//! What changes often, in two pages of flash that take turns: record after record, the newest counts. A page is erased only
//! when the other is full, and holds nothing then that is not older than what is in the other. Whatever write or erasure a
//! cut in power falls into, the record before or the new one is found.
//!
//! ```text
//! cell   u32 mark, u32 number, u64 counter, u32 length, u32 CRC-32 over all of the cell but itself, u64 nonce, memory
//! ```
//!
//! The length is that of nonce and memory. A cell with the mark before this one has no nonce; it is read as if that were zero.
//!
//! Wear: pages of 2,048 bytes take 13 cells. One record an hour for 20 years is 175,320, 6,743 erasures of each page, of
//! 10,000 that such flash is good for.

#[cfg(test)]
mod tests;

use crate::flash::{Mapped, SaveError, checksum, word, write};

const MARK: u32 = u32::from_le_bytes(*b"REj2");
const MARK_WITHOUT_NONCE: u32 = u32::from_le_bytes(*b"REj1");
const HEAD_BYTES: usize = 24;
const CHECKSUM_PLACE: usize = HEAD_BYTES - 4;
const NONCE_BYTES: usize = 8;
pub const MEMORY_BYTES: usize = 120;
const CELL_BYTES: usize = HEAD_BYTES + NONCE_BYTES + MEMORY_BYTES;
const PAGES: usize = 2;

/// What a record holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record<'a> {
    /// Last counter accepted.
    pub counter: u64,
    /// Nonce from which authenticated readings go on; zero: none was stored.
    pub nonce: u64,
    /// The memory's bytes.
    pub memory: &'a [u8],
}

/// Where a record lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    page: usize,
    cell: usize,
}

/// A journal in a stretch of flash that nothing else uses.
pub struct Journal<F> {
    flash: F,
}

impl<F: Mapped> Journal<F> {
    /// `flash` may hold anything; its first half becomes one page, its second half the other.
    pub fn new(flash: F) -> Self {
        Self { flash }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The record written last.
    pub fn last(&self) -> Option<Record<'_>> {
        let (place, _) = self.newest()?;
        self.read(place).map(|(_, record)| record)
    }

    /// Writes a record behind the last one.
    ///
    /// Errors: [`SaveError`].
    pub fn append(&mut self, record: Record<'_>) -> Result<(), SaveError> {
        if record.memory.len() > MEMORY_BYTES {
            return Err(SaveError::Length);
        }
        let newest = self.newest();
        let number = newest.map_or(0, |(_, number)| number.wrapping_add(1));
        let cell = encode(number, record);
        if let Some((Place { page, cell: last }, _)) = newest
            && self.put(page, last + 1, number, &cell).is_ok()
        {
            return Ok(());
        }
        let page = newest.map_or(0, |(place, _)| (place.page + 1) % PAGES);
        let start = self.start(Place { page, cell: 0 });
        self.flash.erase(start, start + self.page_bytes() as u32).map_err(|_| SaveError::Flash)?;
        self.put(page, 0, number, &cell)
    }

    /// Writes into the first cell of a page that takes it, from `first` on: one that was being written when power failed does
    /// not, though it may look blank.
    fn put(&mut self, page: usize, first: usize, number: u32, cell: &Cell) -> Result<(), SaveError> {
        let mut result = Err(SaveError::Length);
        for place in (first..self.cells()).map(|cell| Place { page, cell }) {
            if self.cell(place).iter().any(|&byte| byte != 0xff) {
                continue;
            }
            let start = self.start(place);
            result = write(&mut self.flash, start, cell);
            if result.is_ok() {
                match self.read(place) {
                    Some((read, _)) if read == number => return Ok(()),
                    _ => result = Err(SaveError::Verify),
                }
            }
        }
        result
    }

    fn page_bytes(&self) -> usize {
        let half = self.flash.capacity() / PAGES;
        half - half % F::ERASE_SIZE
    }

    fn cells(&self) -> usize {
        self.page_bytes() / CELL_BYTES
    }

    fn start(&self, Place { page, cell }: Place) -> u32 {
        (page * self.page_bytes() + cell * CELL_BYTES) as u32
    }

    fn cell(&self, place: Place) -> &[u8] {
        let start = self.start(place) as usize;
        self.flash.mapped().get(start..start + CELL_BYTES).unwrap_or_default()
    }

    /// Number and record of a cell, if it is whole.
    fn read(&self, place: Place) -> Option<(u32, Record<'_>)> {
        let cell = self.cell(place);
        let content = cell.get(HEAD_BYTES..)?.get(..word(cell, 16) as usize)?;
        let long = |place| u64::from(word(cell, place)) | u64::from(word(cell, place + 4)) << 32;
        let (nonce, memory) = match word(cell, 0) {
            MARK => (long(HEAD_BYTES), content.get(NONCE_BYTES..)?),
            MARK_WITHOUT_NONCE => (0, content),
            _ => return None,
        };
        let is_whole = checksum(&[cell.get(..CHECKSUM_PLACE)?, content]) == word(cell, CHECKSUM_PLACE);
        is_whole.then_some((word(cell, 4), Record { counter: long(8), nonce, memory }))
    }

    /// Numbers would wrap after half a million years of one an hour.
    fn newest(&self) -> Option<(Place, u32)> {
        (0..PAGES)
            .flat_map(|page| (0..self.cells()).map(move |cell| Place { page, cell }))
            .filter_map(|place| self.read(place).map(|(number, _)| (place, number)))
            .max_by_key(|&(_, number)| number)
    }
}

type Cell = [u8; CELL_BYTES];

fn encode(number: u32, Record { counter, nonce, memory }: Record<'_>) -> Cell {
    let mut cell = [0xff; CELL_BYTES];
    let length = NONCE_BYTES + memory.len();
    let [counter, nonce] = [counter, nonce].map(|long| [long as u32, (long >> 32) as u32]);
    let values = [MARK, number, counter[0], counter[1], length as u32, 0, nonce[0], nonce[1]];
    let (words, _) = cell.as_chunks_mut::<4>();
    for (word, value) in words.iter_mut().zip(values) {
        *word = value.to_le_bytes();
    }
    for (to, from) in cell.iter_mut().skip(HEAD_BYTES + NONCE_BYTES).zip(memory) {
        *to = *from;
    }
    let (head, content) = cell.split_at(HEAD_BYTES);
    let covered = [head.get(..CHECKSUM_PLACE), content.get(..length)].map(Option::unwrap_or_default);
    let check = checksum(&covered);
    for (to, from) in cell.iter_mut().skip(CHECKSUM_PLACE).zip(check.to_le_bytes()) {
        *to = from;
    }
    cell
}
