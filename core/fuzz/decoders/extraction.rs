//! Samples and marks.

use rotor_edge_core::extraction::{
    Converter, Extraction, ExtractionConfig, Extractor, KeyphasorDetector, Outcome,
};

use super::Bytes;

/// Samples of the probes and of the keyphasor's channel: steady turns at first, with arbitrary samples among them.
pub fn extraction(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let [samples, revolutions, hysteresis] = bytes.array::<3>().map(u16::from);
    let config = ExtractionConfig {
        revolutions: (revolutions % 4).max(1),
        converter: Converter { rails: [-4096, 0], zero_count: 0.0, mv_per_count: 24_000.0 / 4096.0 },
        ..ExtractionConfig::<4>::new()
    };
    let mut detector = KeyphasorDetector::new(i32::from(bytes.u16() as i16), i32::from(hysteresis));
    let mut extractor = Extractor::new(config).expect("a possible configuration");
    let turn = samples.max(1);
    for sample in 0_u16.. {
        let mut counts = [-1000; 4];
        let mut key = i32::from(if sample % turn == 0 { i16::MAX } else { i16::MIN });
        if sample >= 8 * turn {
            if bytes.is_empty() {
                break;
            }
            let what = bytes.u8();
            if what & 1 != 0 {
                key = i32::from(bytes.u16() as i16);
            }
            if what & 2 != 0 {
                counts = bytes.array::<4>().map(|byte| i32::from(byte as i8) << 8);
            }
        }
        let mark = detector.push(key);
        assert!(mark.is_none_or(|age| (0.0..=1.0).contains(&age)));
        if let Some(Extraction { reading, keyphasor, outcome, gap_mv, .. }) = extractor.push(counts, mark) {
            assert_eq!(keyphasor.is_usable(), outcome == Outcome::Measured);
            assert!(gap_mv.iter().all(|gap_mv| gap_mv.is_finite()));
            // who believes a phase has one
            assert!(!keyphasor.is_usable() || reading.speed_rpm.is_finite());
            assert!(keyphasor.is_usable() || reading.valid_mask() == 0);
        }
    }
}
