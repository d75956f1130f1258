//! Flash that is read like memory, and what the stores in it have in common.

use embedded_storage::nor_flash::NorFlash;

/// Flash that the processor reads like memory.
pub trait Mapped: NorFlash {
    /// All of it, as it is now; as long as its capacity.
    fn mapped(&self) -> &[u8];
}

/// Why nothing was saved; what was saved before is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SaveError {
    /// It is longer than the room for it.
    Length,
    /// The flash refused to erase or write.
    Flash,
    /// What was written reads otherwise.
    Verify,
}

// Without a table, of 1 kB: it is wanted at the start and for a save, a few times an hour.
static CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);

/// Checksum over parts that follow each other.
pub(crate) fn checksum(parts: &[&[u8]]) -> u32 {
    let mut digest = CRC.digest();
    parts.iter().for_each(|part| digest.update(part));
    digest.finalize()
}

/// The little-endian word at a place; 0 beyond the end.
pub(crate) fn word(bytes: &[u8], place: usize) -> u32 {
    bytes.get(place..).and_then(<[u8]>::first_chunk).map_or(0, |word| u32::from_le_bytes(*word))
}

/// Bytes written at a time: a multiple of what flash can write at once.
const CHUNK_BYTES: usize = 32;

/// Writes bytes, filled up with ones to whole words of the flash.
pub(crate) fn write<F: NorFlash>(flash: &mut F, start: u32, bytes: &[u8]) -> Result<(), SaveError> {
    const {
        assert!(CHUNK_BYTES.is_multiple_of(F::WRITE_SIZE));
    }
    for (address, part) in (start..).step_by(CHUNK_BYTES).zip(bytes.chunks(CHUNK_BYTES)) {
        let mut chunk = [0xff; CHUNK_BYTES];
        for (to, from) in chunk.iter_mut().zip(part) {
            *to = *from;
        }
        let whole = chunk.get(..part.len().next_multiple_of(F::WRITE_SIZE)).unwrap_or(&chunk);
        flash.write(address, whole).map_err(|_| SaveError::Flash)?;
    }
    Ok(())
}
