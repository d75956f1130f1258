//! The deployed bytes.
//!
//! | place | bytes | what |
//! |---|---|---|
//! | 0 | 4 | schema, little endian |
//! | 4 | 1 | modes N |
//! | 5 | 1 | probes |
//! | 6 | 1 | planes |
//! | 7 | | the fields of [`Model`] in their order, in postcard |
//! | end | 4 | CRC-32 of the fields, little endian |
//!
//! Postcard writes an f32 as four bytes (little endian), a list as its length in one byte (there is none of 128 entries or
//! more) before the entries, an option as 0 or 1 before what it holds, a variant as its number in one byte, a u8 as it is;
//! arrays and matrices (by columns) as their entries alone.

use heapless::Vec;
use nalgebra::{ArrayStorage, SVector};
use postcard::ser_flavors::Flavor;
use serde::Deserialize;

use crate::checksum::{self, Digest};
use crate::packed::{pack_checked, unpack};

use super::{Counts, MAX_FORCINGS, MAX_KNOTS, MAX_SUPPORTS, MODEL_SCHEMA, Model, ModelError, Noise, Shaft};

const SCHEMA_BYTES: usize = 4;
/// Schema and the three counts.
const HEAD_BYTES: usize = SCHEMA_BYTES + 3;
const F32: usize = 4;
/// Length of a list with fewer than 128 entries; also the mark of an option or a variant.
const MARK: usize = 1;

/// Where postcard writes when only the checksum is wanted.
struct Checksum(Digest);

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

impl Counts {
    /// Counts of the model in these bytes; `None` if they are too few or of another schema.
    ///
    /// ```
    /// use rotor_edge_core::model::{Counts, MODEL_SCHEMA};
    /// let [a, b, c, d] = MODEL_SCHEMA.to_le_bytes();
    /// let bytes = [a, b, c, d, 6, 8, 3];
    /// assert_eq!(Counts::read(&bytes), Some(Counts { shapes: 6, probes: 8, planes: 3 }));
    /// ```
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (schema, rest) = bytes.split_first_chunk::<SCHEMA_BYTES>()?;
        let &[shapes, probes, planes] = rest.first_chunk::<3>()?;
        (u32::from_le_bytes(*schema) == MODEL_SCHEMA).then_some(Self { shapes, probes, planes })
    }
}

impl<const N: usize, const PROBES: usize, const PLANES: usize> Model<N, PROBES, PLANES> {
    /// Bytes of the largest model of these sizes; a buffer of that size always suffices for [`Model::encode`].
    pub const fn max_size_bytes() -> usize {
        let shape = N * F32;
        let machine = 4;
        let shaft = 2 * shape + MARK + MAX_SUPPORTS * F32 + F32;
        let support = 2 * shape + (4 + 4 + 4) * F32 + (MARK + 2) + (MARK + 6 * F32);
        let knot = (1 + 4 + 4) * F32;
        let forcing = shape + 2 * F32 + MARK;
        let probe = 2 * shape + 6 * F32 + 1 + MARK + 1;
        let plane = shape + 2 * F32;
        let terms = MAX_SUPPORTS * support + MAX_KNOTS * knot + MAX_FORCINGS * forcing;
        let lists = 6 * MARK + PLANES * plane + PROBES * probe;
        HEAD_BYTES + machine + shaft + terms + lists + 1 + (1 + 2 + 2) * F32 + 4
    }

    fn own_counts(&self) -> Counts {
        // No list is as long as 256.
        Counts { shapes: N as u8, probes: self.probes.len() as u8, planes: self.planes.len() as u8 }
    }

    /// Writes the model into `buffer` and returns how many bytes it took.
    ///
    /// Errors: [`ModelError::Space`] if the buffer is too small.
    pub fn encode(&self, buffer: &mut [u8]) -> Result<usize, ModelError> {
        let (schema, rest) = buffer.split_first_chunk_mut::<SCHEMA_BYTES>().ok_or(ModelError::Space)?;
        let (sizes, body) = rest.split_first_chunk_mut::<3>().ok_or(ModelError::Space)?;
        let Counts { shapes, probes, planes } = self.own_counts();
        *schema = MODEL_SCHEMA.to_le_bytes();
        *sizes = [shapes, probes, planes];
        Ok(HEAD_BYTES + pack_checked(self, body).ok_or(ModelError::Space)?)
    }

    /// The CRC-32 that [`Model::encode`] appends: which model this is.
    pub fn checksum(&self) -> u32 {
        postcard::serialize_with_flavor(self, Checksum(checksum::begin())).unwrap_or_default()
    }

    /// No terms, and nothing that could be checked.
    pub(crate) const EMPTY: Self = Self {
        machine: [0; 4],
        shaft: Shaft {
            forward_s2: SVector::from_array_storage(ArrayStorage([[0.0; N]])),
            backward_s2: SVector::from_array_storage(ArrayStorage([[0.0; N]])),
            springs_n_m: Vec::new(),
        },
        internal_damping_s: 0.0,
        planes: Vec::new(),
        supports: Vec::new(),
        knots: Vec::new(),
        forcings: Vec::new(),
        probes: Vec::new(),
        masked: 0,
        initial_unbalance_g_mm: Vec::new(),
        unbalance_floor_g_mm: 0.0,
        noise: Noise { relative: 0.0, floor_um: 0.0 },
        speed_range_rpm: [0.0; 2],
    };

    /// Field by field into its place: as one value a model would be on the stack three times over. What was read is not
    /// checked, and after an error it is of no use. Returns the checksum.
    #[inline(never)]
    pub(crate) fn read(&mut self, bytes: &[u8]) -> Result<u32, ModelError> {
        let (schema, _) = bytes.split_first_chunk::<SCHEMA_BYTES>().ok_or(ModelError::Encoding)?;
        if u32::from_le_bytes(*schema) != MODEL_SCHEMA {
            return Err(ModelError::Schema);
        }
        let counts = Counts::read(bytes).ok_or(ModelError::Encoding)?;
        if usize::from(counts.shapes) != N {
            return Err(ModelError::BasisSize);
        }
        if usize::from(counts.probes) > PROBES {
            return Err(ModelError::Probes);
        }
        if usize::from(counts.planes) > PLANES {
            return Err(ModelError::Planes);
        }
        let body = bytes.get(HEAD_BYTES..).unwrap_or_default();
        let Self {
            machine,
            shaft,
            internal_damping_s,
            planes,
            supports,
            knots,
            forcings,
            probes,
            masked,
            initial_unbalance_g_mm,
            unbalance_floor_g_mm,
            noise,
            speed_range_rpm,
        } = self;
        let mut rest;
        (*machine, rest) =
            body.split_first_chunk().map(|(first, rest)| (*first, rest)).ok_or(ModelError::Encoding)?;
        take(&mut rest, shaft)?;
        take(&mut rest, internal_damping_s)?;
        take(&mut rest, planes)?;
        take_list(&mut rest, supports, ModelError::Supports)?;
        take_list(&mut rest, knots, ModelError::Knots)?;
        take_list(&mut rest, forcings, ModelError::Forcings)?;
        take(&mut rest, probes)?;
        take(&mut rest, masked)?;
        take(&mut rest, initial_unbalance_g_mm)?;
        take(&mut rest, unbalance_floor_g_mm)?;
        take(&mut rest, noise)?;
        take(&mut rest, speed_range_rpm)?;
        let fields = body.get(..body.len().saturating_sub(rest.len())).unwrap_or_default();
        let stated = rest.first_chunk().map(|checksum| u32::from_le_bytes(*checksum));
        // The counts lie outside of the checksum: what it covers decides.
        stated
            .filter(|stated| *stated == checksum::of(fields) && self.own_counts() == counts)
            .ok_or(ModelError::Encoding)
    }
}

/// Reads a list in postcard. A list that is longer than its capacity is refused by its own name.
fn take_list<'a, T: Deserialize<'a>, const MOST: usize>(
    rest: &mut &'a [u8],
    field: &mut Vec<T, MOST>,
    too_many: ModelError,
) -> Result<(), ModelError> {
    // The length is one byte: there is no list of 128 entries or more.
    if rest.first().is_some_and(|&length| usize::from(length) > MOST && length < 128) {
        return Err(too_many);
    }
    take(rest, field)
}

/// Reads a field in postcard and leaves what follows it.
#[inline(never)]
fn take<'a, T: Deserialize<'a>>(rest: &mut &'a [u8], field: &mut T) -> Result<(), ModelError> {
    let (read, left) = unpack(rest).ok_or(ModelError::Encoding)?;
    (*field, *rest) = (read, left);
    Ok(())
}
