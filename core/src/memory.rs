//! What must survive a loss of power, as bytes: a version, a small record as postcard 1 encodes it, its CRC-32.

use heapless::Vec;

use crate::detector::{Baseline, Detector, LatchedFlag, Level, Reference, Suspicion};
use crate::model::{MAX_PLANES, Pair};
use crate::packed::{pack_checked, packed, unpack_checked};
use crate::scalar;
use crate::state::Reason;

/// Bytes of the largest memory.
pub const MEMORY_BYTES: usize = 96;
pub type MemoryBytes = Vec<u8, MEMORY_BYTES>;

const VERSION: u8 = 2;
/// Had the suspicious readings in a row in place of the sum's quarters, and the unbalance last found.
const VERSION_OF_RUNS: u8 = 1;

/// What a monitor has learned of its machine and must not forget.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    version: u8,
    /// Which model it belongs to.
    pub model_checksum: u32,
    level_um: Option<f32>,
    level_weight_s: f32,
    reference_um: Option<f32>,
    learned_s: f32,
    learned_readings: u8,
    /// Suspicious readings less a quarter of the others, in quarters.
    suspicious_quarters: u16,
    /// Suspicious time less a quarter of the other.
    suspicious_s: f32,
    /// Cause of the latched flag, zero without one.
    cause: u8,
    suspect: Option<u8>,
    /// The unbalance last trusted.
    pub unbalance_g_mm: Vec<Pair, MAX_PLANES>,
    /// Upper limit of the unbalance, [`Estimator::most_g_mm`](crate::stages::Estimator::most_g_mm).
    pub most_g_mm: Vec<f32, MAX_PLANES>,
}

packed!(Memory {
    version,
    model_checksum,
    level_um,
    level_weight_s,
    reference_um,
    learned_s,
    learned_readings,
    suspicious_quarters,
    suspicious_s,
    cause,
    suspect,
    unbalance_g_mm,
    most_g_mm,
});

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
            suspicious_quarters: baseline.suspicion.quarters,
            suspicious_s: baseline.suspicion.sum_s,
            cause: baseline.latched.map_or(0, |latched| latched.cause.code()),
            suspect: baseline.latched.and_then(|latched| latched.suspect),
            unbalance_g_mm: unbalance_g_mm.iter().copied().take(MAX_PLANES).collect(),
            most_g_mm: most_g_mm.iter().copied().take(unbalance_g_mm.len()).collect(),
        }
    }

    /// As it is after the flag was acknowledged: see [`Detector::acknowledge`].
    pub fn acknowledged(mut self) -> Self {
        (self.cause, self.suspect) = (0, None);
        (self.suspicious_quarters, self.suspicious_s) = (0, 0.0);
        for most in &mut self.most_g_mm {
            *most = f32::MAX;
        }
        self
    }

    #[inline(never)]
    pub fn encode(&self) -> MemoryBytes {
        let mut buffer = [0; MEMORY_BYTES];
        // The buffer has room for the largest; a memory that was not written is refused when it is read.
        let written = pack_checked(self, &mut buffer).unwrap_or(0);
        buffer.into_iter().take(written).collect()
    }

    /// Reads what [`Memory::encode`] wrote, in this version or the one before. `None` if the bytes are cut short, damaged, or
    /// of another version. Bytes after the checksum are ignored.
    ///
    /// ```
    /// use rotor_edge_core::detector::Detector;
    /// use rotor_edge_core::memory::Memory;
    /// let memory = Memory::new(0x1234, &Detector::default(), &[[300.0, 400.0]], &[900.0; 4]);
    /// let mut bytes = memory.encode();
    /// assert_eq!(Memory::decode(&bytes), Some(memory));
    /// bytes[3] ^= 1;
    /// assert_eq!(Memory::decode(&bytes), None);
    /// ```
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        unpack_checked(bytes).filter(|memory: &Self| [VERSION, VERSION_OF_RUNS].contains(&memory.version))
    }

    /// The detector that goes on from here.
    pub fn detector(&self) -> Detector {
        let positive = |number: f32| if scalar::is_amount(number) { number } else { 0.0 };
        let cause = Some(Reason::from_code(self.cause)).filter(|cause| *cause != Reason::None);
        let suspicious_s = positive(self.suspicious_s);
        let suspicion = if self.version == VERSION_OF_RUNS {
            Suspicion::resume_run(self.suspicious_quarters, suspicious_s)
        } else {
            Suspicion::resume(suspicious_s, self.suspicious_quarters)
        };
        // Before the first judged reading nothing was trusted yet.
        let reference = match self.level_um {
            Some(_) => Reference::resume(&self.unbalance_g_mm, &self.most_g_mm),
            None => Reference::default(),
        };
        let baseline = Baseline {
            level: Level::resume(self.level_um, self.level_weight_s),
            reference_um: self.reference_um.filter(|reference| scalar::is_amount(*reference)),
            learned_s: positive(self.learned_s),
            learned_readings: self.learned_readings,
            suspicion,
            latched: cause.map(|cause| LatchedFlag { cause, suspect: self.suspect }),
        };
        Detector::resume(baseline, reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: [f32; MAX_PLANES] = [9.0, 8.0, 7.0, 6.0];

    fn remembered(reference: Reference) -> Detector {
        let baseline = Baseline {
            level: Level::resume(Some(2.5), 864_000.0),
            reference_um: Some(1.5),
            learned_s: 61.0,
            learned_readings: 255,
            suspicion: Suspicion::resume(11.0, u16::MAX),
            latched: Some(LatchedFlag { cause: Reason::Jump, suspect: Some(6) }),
        };
        Detector::resume(baseline, reference)
    }

    #[test]
    fn everything_comes_back_and_the_largest_fits() {
        let unbalance = [[1.0, -2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]];
        let trusted = Reference::resume(&unbalance, &MOST);
        let memory = Memory::new(u32::MAX, &remembered(trusted), &unbalance, &MOST);
        let mut bytes = memory.encode();
        assert!((60..=MEMORY_BYTES).contains(&bytes.len()), "{}", bytes.len());
        let two = Memory::new(7, &Detector::default(), &unbalance[..2], &MOST);
        assert!(two.encode().len() <= 72);
        while bytes.push(0xff).is_ok() {}
        let again = Memory::decode(&bytes).unwrap();
        assert_eq!(
            (again.detector(), again.unbalance_g_mm.as_slice()),
            (remembered(trusted), &unbalance[..])
        );
        assert_eq!(again.most_g_mm, MOST);
        assert_eq!(Memory::decode(&two.encode()).unwrap().detector(), Detector::default());
    }

    #[test]
    fn acknowledged_memory_has_no_flag_suspicion_or_reference() {
        let trusted = Reference::resume(&[[1.0, 2.0]], &MOST);
        let memory = Memory::new(7, &remembered(trusted), &[[1.0, 2.0]], &MOST).acknowledged();
        let mut acknowledged = remembered(trusted);
        acknowledged.acknowledge();
        assert_eq!(memory.detector(), acknowledged);
        assert_eq!(memory.most_g_mm, [f32::MAX]);
    }

    /// Written by version 1: two planes of 5100 and 2100 g·mm at most, two suspicious readings in 11 s, a flag.
    const BEFORE: [u8; 63] = [
        0x01, 0xf8, 0xac, 0xd1, 0x91, 0x01, 0x01, 0x00, 0x00, 0x20, 0x40, 0x00, 0xf0, 0x52, 0x49, 0x01, 0x00,
        0x00, 0xc0, 0x3f, 0x00, 0x00, 0x74, 0x42, 0x0c, 0x02, 0x00, 0x00, 0x30, 0x41, 0x0d, 0x01, 0x01, 0x02,
        0x00, 0x80, 0x3b, 0x45, 0x00, 0x00, 0x7a, 0xc5, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xfa, 0x44, 0x02,
        0x00, 0x60, 0x9f, 0x45, 0x00, 0x40, 0x03, 0x45, 0xee, 0x2f, 0x4b, 0xa3,
    ];

    #[test]
    fn memory_of_version_before_loads_and_goes_on() {
        let memory = Memory::decode(&BEFORE).unwrap();
        let unbalance = [[3000.0, -4000.0], [0.0, 2000.0]];
        assert_eq!((memory.model_checksum, memory.unbalance_g_mm.as_slice()), (0x1234_5678, &unbalance[..]));
        assert_eq!(memory.most_g_mm, [5100.0, 2100.0]);
        let baseline = Baseline {
            level: Level::resume(Some(2.5), 864_000.0),
            reference_um: Some(1.5),
            learned_s: 61.0,
            learned_readings: 12,
            suspicion: Suspicion { sum_s: 11.0, quarters: 8, run: 2, run_s: 11.0 },
            latched: Some(LatchedFlag { cause: Reason::Jump, suspect: Some(1) }),
        };
        let reference = Reference::resume(&unbalance, &[5100.0, 2100.0]);
        assert_eq!(memory.detector(), Detector::resume(baseline, reference));
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_refused() {
        let bytes = Memory::new(7, &remembered(Reference::default()), &[[1.0, 2.0]], &MOST).encode();
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Memory::decode(&damaged), None, "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert_eq!(Memory::decode(&bytes[..length]), None, "{length} bytes");
        }
        let other =
            Memory { version: VERSION + 1, ..Memory::new(7, &remembered(Reference::default()), &[], &MOST) };
        assert_eq!(Memory::decode(&other.encode()), None);
    }

    #[test]
    fn a_record_with_numbers_that_cannot_be_starts_without_them() {
        let mut spoilt = Memory::new(7, &remembered(Reference::default()), &[[f32::NAN; 2]], &MOST);
        (spoilt.level_um, spoilt.reference_um) = (Some(f32::NAN), Some(-1.0));
        (spoilt.learned_s, spoilt.suspicious_s, spoilt.cause) = (f32::INFINITY, -3.0, 0);
        let detector = spoilt.detector();
        let baseline = detector.baseline();
        assert_eq!((baseline.level.mean(), baseline.reference_um, baseline.latched), (None, None, None));
        assert_eq!((baseline.learned_s, baseline.suspicion.sum_s), (0.0, 0.0));
        assert_eq!(detector, Detector::resume(*baseline, Reference::default()));
    }
}
