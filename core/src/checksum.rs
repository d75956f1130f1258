//! zlib's CRC-32 (Python: `binascii.crc32`), over models, memories, readings and results.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

// Without a table, of 1 kB: it is wanted a few times a second over a hundred bytes, and over a model at the start.
static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

pub(crate) type Digest = crc::Digest<'static, u32, NoTable>;

pub(crate) fn begin() -> Digest {
    CRC.digest()
}

pub(crate) fn of(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
