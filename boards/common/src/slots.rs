//! Model and command counter in flash, in two slots: a save goes to the slot that is not in use, and its head, with a
//! checksum over all of it, is written last. Whatever write or erasure a cut in power falls into, one whole slot remains.
//!
//! ```text
//! slot   head: u32 mark, u32 number of the save, u64 counter, u32 length of the model, u32 0, u32 0, u32 CRC-32
//!        model as deployed; length 0: none yet, the board starts with its own
//! ```

#[cfg(test)]
mod tests;

use embedded_storage::nor_flash::NorFlash;

const MARK: u32 = u32::from_le_bytes(*b"REs1");
const HEAD_BYTES: usize = 32;
/// Bytes read or written at a time: a multiple of what flash can write at once.
const CHUNK_BYTES: usize = 32;
const SLOTS: u32 = 2;

type Head = [u8; HEAD_BYTES];
static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Why nothing was saved; what was saved before is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SaveError {
    /// The model is longer than a slot.
    Length,
    /// The flash refused to erase, write or read.
    Flash,
    /// What was written reads otherwise.
    Verify,
}

/// What a slot holds, without the model itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Record {
    number: u32,
    counter: u64,
    model_bytes: u32,
}

/// Two slots in a stretch of flash that nothing else uses.
pub struct Slots<F> {
    flash: F,
}

/// Where the bytes of the model to be saved come from.
#[derive(Clone, Copy)]
enum Source<'a> {
    New(&'a [u8]),
    /// The slot in use.
    Slot(u32),
}

impl<F: NorFlash> Slots<F> {
    /// `flash` may hold anything; its first half becomes one slot, its second half the other.
    pub fn new(flash: F) -> Self {
        const {
            assert!(CHUNK_BYTES.is_multiple_of(F::WRITE_SIZE) && CHUNK_BYTES.is_multiple_of(F::READ_SIZE));
        }
        Self { flash }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The counter saved last and the model that belongs to it, copied into `buffer`; `None` for the model if none was
    /// ever saved (or it does not fit), `None` altogether if nothing was.
    pub fn load<'a>(&mut self, buffer: &'a mut [u8]) -> Option<(u64, Option<&'a [u8]>)> {
        let (slot, record) = self.newest()?;
        let Some(model) = buffer.get_mut(..record.model_bytes as usize) else {
            return Some((record.counter, None));
        };
        for (place, chunk) in (0..).step_by(CHUNK_BYTES).zip(model.chunks_mut(CHUNK_BYTES)) {
            let read = self.chunk(Source::Slot(slot), place).ok()?;
            for (to, from) in chunk.iter_mut().zip(read) {
                *to = from;
            }
        }
        Some((record.counter, (!model.is_empty()).then_some(model)))
    }

    /// Saves the counter, and the model or with `None` the one saved before.
    ///
    /// Errors: [`SaveError`].
    pub fn save(&mut self, counter: u64, model: Option<&[u8]>) -> Result<(), SaveError> {
        let newest = self.newest();
        let (slot, number) = match newest {
            Some((slot, record)) => ((slot + 1) % SLOTS, record.number.wrapping_add(1)),
            None => (0, 0),
        };
        let (source, length) = match (model, newest) {
            (Some(model), _) => (Source::New(model), model.len()),
            (None, Some((slot, record))) => (Source::Slot(slot), record.model_bytes as usize),
            (None, None) => (Source::New(&[]), 0),
        };
        let model_bytes = u32::try_from(length).map_err(|_| SaveError::Length)?;
        let record = Record { number, counter, model_bytes };
        if HEAD_BYTES + length.next_multiple_of(CHUNK_BYTES) > self.slot_bytes() as usize {
            return Err(SaveError::Length);
        }
        let start = self.start(slot);
        self.flash.erase(start, start + self.slot_bytes()).map_err(|_| SaveError::Flash)?;
        for place in (0..length).step_by(CHUNK_BYTES) {
            let chunk = self.chunk(source, place)?;
            let address = start + (HEAD_BYTES + place) as u32;
            self.flash.write(address, &chunk).map_err(|_| SaveError::Flash)?;
        }
        let head = self.head(&record, source)?;
        self.flash.write(start, &head).map_err(|_| SaveError::Flash)?;
        if self.read(slot) == Some(record) { Ok(()) } else { Err(SaveError::Verify) }
    }

    fn slot_bytes(&self) -> u32 {
        let half = self.flash.capacity() as u32 / SLOTS;
        half - half % F::ERASE_SIZE as u32
    }

    fn start(&self, slot: u32) -> u32 {
        slot * self.slot_bytes()
    }

    /// The whole slot that was saved last. Numbers wrap; two slots in use differ by one.
    fn newest(&mut self) -> Option<(u32, Record)> {
        match (self.read(0), self.read(1)) {
            (Some(first), Some(second)) if second.number == first.number.wrapping_add(1) => Some((1, second)),
            (Some(first), _) => Some((0, first)),
            (None, second) => Some((1, second?)),
        }
    }

    /// What a slot holds, if its checksum is right.
    fn read(&mut self, slot: u32) -> Option<Record> {
        let mut head: Head = [0; HEAD_BYTES];
        self.flash.read(self.start(slot), &mut head).ok()?;
        let (words, _) = head.as_chunks::<4>();
        let word = |place: usize| words.get(place).map_or(0, |word| u32::from_le_bytes(*word));
        let record = Record {
            number: word(1),
            counter: u64::from(word(2)) | u64::from(word(3)) << 32,
            model_bytes: word(4),
        };
        let room = self.slot_bytes() as usize - HEAD_BYTES;
        let plausible = word(0) == MARK && record.model_bytes as usize <= room;
        (plausible && self.head(&record, Source::Slot(slot)) == Ok(head)).then_some(record)
    }

    /// The head of a record, with the checksum over itself and the model.
    fn head(&mut self, record: &Record, source: Source<'_>) -> Result<Head, SaveError> {
        let mut head: Head = [0; HEAD_BYTES];
        let (words, _) = head.as_chunks_mut::<4>();
        let low = record.counter as u32;
        let high = (record.counter >> 32) as u32;
        for (word, value) in words.iter_mut().zip([MARK, record.number, low, high, record.model_bytes]) {
            *word = value.to_le_bytes();
        }
        let mut digest = CRC.digest();
        digest.update(&head);
        let length = record.model_bytes as usize;
        for place in (0..length).step_by(CHUNK_BYTES) {
            let chunk = self.chunk(source, place)?;
            digest.update(chunk.get(..length - place).unwrap_or(&chunk));
        }
        if let Some(last) = head.last_chunk_mut() {
            *last = digest.finalize().to_le_bytes();
        }
        Ok(head)
    }

    /// The model's bytes from `place` on, filled up with ones at the end.
    fn chunk(&mut self, source: Source<'_>, place: usize) -> Result<[u8; CHUNK_BYTES], SaveError> {
        let mut chunk = [0xff; CHUNK_BYTES];
        match source {
            Source::New(model) => {
                for (to, from) in chunk.iter_mut().zip(model.iter().skip(place)) {
                    *to = *from;
                }
            }
            Source::Slot(slot) => {
                let address = self.start(slot) + (HEAD_BYTES + place) as u32;
                self.flash.read(address, &mut chunk).map_err(|_| SaveError::Flash)?;
            }
        }
        Ok(chunk)
    }
}
