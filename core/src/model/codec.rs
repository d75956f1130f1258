//! The deployed bytes.
//!
//! | place | bytes | what |
//! |---|---|---|
//! | 0 | 4 | schema, little endian |
//! | 4 | 1 | modes |
//! | 5 | 1 | probes |
//! | 6 | 1 | planes |
//! | 7 | | the fields of [`Model`] in their order, as postcard 1 encodes them |
//! | end | 4 | CRC-32 of the fields, little endian |
//!
//! That is an f32 as four bytes (little endian), a list as its length in one byte (there is none of 128 entries or more)
//! before the entries, an option as 0 or 1 before what it holds, a variant as its number in one byte, a u8 as it is; arrays
//! and matrices (by columns) as their entries alone.

use super::{
    Counts, Forcing, ForcingLaw, Knot, KnotRange, MAX_FORCINGS, MAX_KNOTS, MAX_SUPPORTS, MODEL_SCHEMA, Model,
    ModelError, Noise, Pedestal, Probe, Shaft, Shape, Support,
};
use crate::packed::{Packed, Reader, Sink, checksum_of, confirmed, pack_checked, packed};

const SCHEMA_BYTES: usize = 4;
/// Schema and the three counts.
const HEAD_BYTES: usize = SCHEMA_BYTES + 3;
const F32: usize = 4;
/// Length of a list with fewer than 128 entries; also the mark of an option or a variant.
const MARK: usize = 1;

packed!(Model<SHAPES, PROBES, PLANES> where [const SHAPES: usize, const PROBES: usize, const PLANES: usize] {
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
});
packed!(Shaft<SHAPES> where [const SHAPES: usize] { forward_s2, backward_s2, springs_n_m });
packed!(Shape<SHAPES> where [const SHAPES: usize] { forward, backward });
packed!(Support<SHAPES> where [const SHAPES: usize] {
    shape,
    stiffness_n_m,
    damping_n_s_m,
    mass_kg,
    stiffness_slope,
    reference_speed_rad_s,
    table,
    hardening_per_um2,
    pedestal,
}, too many: ModelError::Supports);
packed!(KnotRange { first, count });
packed!(Knot { speed_rad_s, stiffness_n_m, damping_n_s_m }, too many: ModelError::Knots);
packed!(Pedestal { stiffness_n_m, damping_n_s_m, mass_kg });
packed!(Forcing<SHAPES> where [const SHAPES: usize] { shape, amplitude, law }, too many: ModelError::Forcings);
packed!(Probe<SHAPES> where [const SHAPES: usize] { shape, direction, gain, runout_um, bearing, mount });
packed!(Noise { relative, floor_um });

impl Packed for ForcingLaw {
    const EMPTY: Self = Self::Constant;

    fn write(&self, to: &mut impl Sink) {
        to.put(u8::from(*self == Self::SpeedSquared));
    }

    fn read(&mut self, from: &mut Reader) {
        *self = if from.is_second() { Self::SpeedSquared } else { Self::Constant };
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

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Model<SHAPES, PROBES, PLANES> {
    /// Bytes of the largest model of these sizes; a buffer of that size always suffices for [`Model::encode`].
    pub const fn max_size_bytes() -> usize {
        let shape = SHAPES * F32;
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
        Counts { shapes: SHAPES as u8, probes: self.probes.len() as u8, planes: self.planes.len() as u8 }
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
        checksum_of(self)
    }

    /// Field by field into its place: as one value a model would be on the stack three times over. What was read is not
    /// checked, and after an error it is of no use. Returns the checksum.
    #[inline(never)]
    pub(crate) fn read(&mut self, bytes: &[u8]) -> Result<u32, ModelError> {
        let (schema, _) = bytes.split_first_chunk::<SCHEMA_BYTES>().ok_or(ModelError::Encoding)?;
        if u32::from_le_bytes(*schema) != MODEL_SCHEMA {
            return Err(ModelError::Schema);
        }
        let counts = Counts::read(bytes).ok_or(ModelError::Encoding)?;
        if usize::from(counts.shapes) != SHAPES {
            return Err(ModelError::BasisSize);
        }
        if usize::from(counts.probes) > PROBES {
            return Err(ModelError::Probes);
        }
        if usize::from(counts.planes) > PLANES {
            return Err(ModelError::Planes);
        }
        let body = bytes.get(HEAD_BYTES..).unwrap_or_default();
        let mut reader = Reader::new(body);
        Packed::read(self, &mut reader);
        let rest = reader.rest()?;
        // The counts lie outside of the checksum: what it covers decides.
        let checksum = confirmed(body, rest).filter(|_| self.own_counts() == counts);
        checksum.ok_or(ModelError::Encoding)
    }
}
