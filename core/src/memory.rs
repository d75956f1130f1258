//! What must survive a loss of power, as bytes: a version, a small record in postcard, its CRC-32.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::detector::{Baseline, Detector, LatchedFlag, Level};
use crate::model::{MAX_PLANES, Pair};
use crate::packed::{pack_checked, unpack_checked};
use crate::state::Reason;

/// Bytes of the largest memory.
pub const MEMORY_BYTES: usize = 96;
pub type MemoryBytes = Vec<u8, MEMORY_BYTES>;

const VERSION: u8 = 1;

/// What a monitor has learned of its machine and must not forget.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    version: u8,
    /// Which model it belongs to.
    pub model_checksum: u32,
    level_um: Option<f32>,
    level_weight_s: f32,
    reference_um: Option<f32>,
    learned_s: f32,
    learned_readings: u8,
    streak: u16,
    suspicious_s: f32,
    /// Cause of the latched flag, zero without one.
    cause: u8,
    suspect: Option<u8>,
    pub unbalance_g_mm: Vec<Pair, MAX_PLANES>,
    /// Upper limit of the unbalance, [`Growth::most_g_mm`](crate::detector::Growth::most_g_mm).
    pub most_g_mm: Vec<f32, MAX_PLANES>,
}

impl Memory {
    /// What is to be remembered now; the bounds of planes that are not there are left out.
    pub fn new(
        model_checksum: u32,
        detector: &Detector,
        unbalance_g_mm: &[Pair],
        most_g_mm: &[f32; MAX_PLANES],
    ) -> Self {
        let baseline = detector.baseline();
        Self {
            version: VERSION,
            model_checksum,
            level_um: baseline.level.mean(),
            level_weight_s: baseline.level.weight_s(),
            reference_um: baseline.reference_um,
            learned_s: baseline.learned_s,
            learned_readings: baseline.learned_readings,
            streak: baseline.streak,
            suspicious_s: baseline.suspicious_s,
            cause: baseline.latched.map_or(0, |latched| latched.cause.code()),
            suspect: baseline.latched.and_then(|latched| latched.suspect),
            unbalance_g_mm: unbalance_g_mm.iter().copied().take(MAX_PLANES).collect(),
            most_g_mm: most_g_mm.iter().copied().take(unbalance_g_mm.len()).collect(),
        }
    }

    pub fn encode(&self) -> MemoryBytes {
        let mut buffer = [0; MEMORY_BYTES];
        // The buffer has room for the largest; a memory that was not written is refused when it is read.
        let written = pack_checked(self, &mut buffer).unwrap_or(0);
        buffer.into_iter().take(written).collect()
    }

    /// Reads what [`Memory::encode`] wrote. `None` if the bytes are cut short, damaged, or of another version. Bytes after the checksum are ignored.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        unpack_checked(bytes).filter(|memory: &Self| memory.version == VERSION)
    }

    /// The detector that goes on from here.
    pub fn detector(&self) -> Detector {
        let positive = |number: f32| if number.is_finite() { number.max(0.0) } else { 0.0 };
        let cause = Some(Reason::from_code(self.cause)).filter(|cause| *cause != Reason::None);
        Detector::resume(Baseline {
            level: Level::resume(self.level_um, self.level_weight_s),
            reference_um: self.reference_um.filter(|reference| reference.is_finite() && *reference >= 0.0),
            learned_s: positive(self.learned_s),
            learned_readings: self.learned_readings,
            streak: self.streak,
            suspicious_s: positive(self.suspicious_s),
            latched: cause.map(|cause| LatchedFlag { cause, suspect: self.suspect }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: [f32; MAX_PLANES] = [9.0, 8.0, 7.0, 6.0];

    fn remembered() -> Detector {
        Detector::resume(Baseline {
            level: Level::resume(Some(2.5), 864_000.0),
            reference_um: Some(1.5),
            learned_s: 61.0,
            learned_readings: 255,
            streak: u16::MAX,
            suspicious_s: 11.0,
            latched: Some(LatchedFlag { cause: Reason::Jump, suspect: Some(6) }),
        })
    }

    #[test]
    fn everything_comes_back_and_the_largest_fits() {
        let unbalance = [[1.0, -2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]];
        let memory = Memory::new(u32::MAX, &remembered(), &unbalance, &MOST);
        let mut bytes = memory.encode();
        assert!((60..=MEMORY_BYTES).contains(&bytes.len()), "{}", bytes.len());
        let two = Memory::new(7, &Detector::default(), &unbalance[..2], &MOST);
        assert!(two.encode().len() <= 72);
        while bytes.push(0xff).is_ok() {}
        let again = Memory::decode(&bytes).unwrap();
        assert_eq!((again.detector(), again.unbalance_g_mm.as_slice()), (remembered(), &unbalance[..]));
        assert_eq!(again.most_g_mm, MOST);
        assert_eq!(Memory::decode(&two.encode()).unwrap().detector(), Detector::default());
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_refused() {
        let bytes = Memory::new(7, &remembered(), &[[1.0, 2.0]], &MOST).encode();
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Memory::decode(&damaged), None, "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert_eq!(Memory::decode(&bytes[..length]), None, "{length} bytes");
        }
        let other = Memory { version: VERSION + 1, ..Memory::new(7, &remembered(), &[], &MOST) };
        assert_eq!(Memory::decode(&other.encode()), None);
    }

    #[test]
    fn a_record_with_numbers_that_cannot_be_starts_without_them() {
        let mut spoilt = Memory::new(7, &remembered(), &[], &MOST);
        (spoilt.level_um, spoilt.reference_um) = (Some(f32::NAN), Some(-1.0));
        (spoilt.learned_s, spoilt.suspicious_s, spoilt.cause) = (f32::INFINITY, -3.0, 0);
        let detector = spoilt.detector();
        let baseline = detector.baseline();
        assert_eq!((baseline.level.mean(), baseline.reference_um, baseline.latched), (None, None, None));
        assert_eq!((baseline.learned_s, baseline.suspicious_s), (0.0, 0.0));
    }
}
