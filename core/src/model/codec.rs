//! The deployed bytes: schema (u32, little endian), N (u8), then the model in postcard with its CRC-32.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};
use postcard::ser_flavors::Flavor;

use super::{MAX_FORCINGS, MAX_PLANES, MAX_SUPPORTS, MODEL_SCHEMA, Model, ModelError};
use crate::reading::PROBES;

/// zlib's CRC-32 (Python: `binascii.crc32`).
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const SCHEMA_BYTES: usize = 4;
const F32: usize = 4;
/// Length of a list with fewer than 128 entries; also the mark of an option or a variant.
const MARK: usize = 1;

/// Where postcard writes when only the checksum is wanted.
struct Checksum(Digest<'static, u32>);

impl Flavor for Checksum {
    type Output = u32;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.update(&[byte]);
        Ok(())
    }

    fn finalize(self) -> postcard::Result<u32> {
        Ok(self.0.finalize())
    }
}

impl<const N: usize> Model<N> {
    /// Bytes of the largest model of this basis size; a buffer of that size always suffices for [`Model::encode`].
    pub const fn max_size_bytes() -> usize {
        let shape = N * F32;
        let shaft = 3 * N * N * F32 + F32;
        let support = shape + (4 + 4 + 4) * F32 + MARK + 3 * F32;
        let forcing = shape + 2 * F32 + MARK;
        let probe = shape + 6 * F32;
        let lists = 3 * MARK + MAX_PLANES * shape + MAX_SUPPORTS * support + MAX_FORCINGS * forcing;
        let rest = PROBES * probe + (2 * MAX_PLANES + 1 + 2) * F32;
        SCHEMA_BYTES + 1 + shaft + lists + rest + 4
    }

    /// Writes the model into `buffer` and returns how many bytes it took.
    ///
    /// Errors: [`ModelError::Space`] if the buffer is too small.
    pub fn encode(&self, buffer: &mut [u8]) -> Result<usize, ModelError> {
        let (schema, rest) = buffer.split_first_chunk_mut::<SCHEMA_BYTES>().ok_or(ModelError::Space)?;
        let (size, body) = rest.split_first_mut().ok_or(ModelError::Space)?;
        *schema = MODEL_SCHEMA.to_le_bytes();
        *size = u8::try_from(N).map_err(|_| ModelError::BasisSize)?;
        let written = postcard::to_slice_crc32(self, body, CRC.digest()).map_err(|_| ModelError::Space)?;
        Ok(SCHEMA_BYTES + 1 + written.len())
    }

    /// The CRC-32 that [`Model::encode`] appends: which model this is.
    pub fn checksum(&self) -> u32 {
        postcard::serialize_with_flavor(self, Checksum(CRC.digest())).unwrap_or_default()
    }

    /// Reads what [`Model::encode`] wrote and checks it. Bytes after the checksum are ignored, so that a whole page of
    /// flash may be handed in.
    ///
    /// Errors: [`ModelError::Schema`], [`ModelError::BasisSize`], [`ModelError::Encoding`], and those of [`Model::check`].
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, ModelError> {
        // One variable, returned as it is: a model is not small, and a second copy would be on the stack.
        let mut decoded = Self::parse(bytes);
        if let Ok(model) = &decoded
            && let Err(error) = model.check()
        {
            decoded = Err(error);
        }
        decoded
    }

    /// Not inlined: postcard's stack is free again when the model is checked.
    #[inline(never)]
    fn parse(bytes: &[u8]) -> Result<Self, ModelError> {
        let (schema, rest) = bytes.split_first_chunk::<SCHEMA_BYTES>().ok_or(ModelError::Encoding)?;
        if u32::from_le_bytes(*schema) != MODEL_SCHEMA {
            return Err(ModelError::Schema);
        }
        let (&size, body) = rest.split_first().ok_or(ModelError::Encoding)?;
        if usize::from(size) != N {
            return Err(ModelError::BasisSize);
        }
        postcard::from_bytes_crc32(body, CRC.digest()).map_err(|_| ModelError::Encoding)
    }
}
