//! Samples and marks.

use rotor_edge_core::extraction::{Extraction, ExtractionConfig, Extractor, KeyphasorDetector};

use super::Bytes;

/// Samples of the probes and of the keyphasor's channel: steady turns at first, with arbitrary samples among them.
pub fn extraction(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let [samples, revolutions, hysteresis] = bytes.array::<3>().map(u16::from);
    let config = ExtractionConfig { revolutions: revolutions % 4, ..ExtractionConfig::new() };
    let mut detector = KeyphasorDetector::new(bytes.u16() as i16, hysteresis as i16);
    let mut extractor = Extractor::new();
    let turn = samples.max(1);
    for sample in 0_u16.. {
        let mut counts = [-1000; 4];
        let mut key = if sample % turn == 0 { i16::MAX } else { i16::MIN };
        if sample >= 8 * turn {
            if bytes.is_empty() {
                break;
            }
            let what = bytes.u8();
            if what & 1 != 0 {
                key = bytes.u16() as i16;
            }
            if what & 2 != 0 {
                counts = bytes.array::<4>().map(|byte| i16::from(byte as i8) << 8);
            }
        }
        let mark = detector.push(key);
        assert!(mark.is_none_or(|age| (0.0..=1.0).contains(&age)));
        if let Some(Extraction { reading, keyphasor, .. }) = extractor.push(&config, counts, mark) {
            // who believes a phase has one
            assert!(!keyphasor.is_usable() || reading.speed_rpm.is_finite());
            assert!(keyphasor.is_usable() || reading.valid_mask() == 0);
        }
    }
}
