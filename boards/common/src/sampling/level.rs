//! Between a probe's negative voltage and the converter's positive one.

use rotor_edge_core::extraction::Converter;

/// Steps of a converter with 12 bits.
const STEPS: i32 = 4096;

/// Two resistors that meet at the converter's input: one from the probe, one from the converter's own reference. The
/// reference is in both, so that 0 V at the probe gives the same count whatever the reference is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelShift {
    /// Resistor from the probe, Ω.
    pub probe_ohm: f32,
    /// Resistor from the reference, Ω.
    pub reference_ohm: f32,
    /// The converter's reference, mV.
    pub reference_mv: f32,
}

impl LevelShift {
    /// What the converter's numbers stand for at the probe.
    pub const fn converter(&self) -> Converter {
        let (steps, ohm) = (STEPS as f32, self.probe_ohm + self.reference_ohm);
        Converter {
            rails: [0, STEPS - 1],
            zero_count: steps * self.probe_ohm / ohm,
            mv_per_count: self.reference_mv / steps * ohm / self.reference_ohm,
        }
    }

    /// The converter's number for a voltage at the probe.
    pub const fn count(&self, mv: f32) -> i32 {
        let Converter { zero_count, mv_per_count, .. } = self.converter();
        (zero_count + mv / mv_per_count) as i32
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub const BOARD: LevelShift =
        LevelShift { probe_ohm: 100_000.0, reference_ohm: 13_700.0, reference_mv: 3_300.0 };

    /// The converter's count, by the currents into its input, which add up to nothing.
    pub fn convert(level: &LevelShift, probe_mv: f64) -> u16 {
        let [probe_s, reference_s] = [level.probe_ohm, level.reference_ohm].map(|ohm| 1.0 / f64::from(ohm));
        let reference_mv = f64::from(level.reference_mv);
        let input_mv = (probe_mv * probe_s + reference_mv * reference_s) / (probe_s + reference_s);
        (input_mv / reference_mv * 4096.0).round().clamp(0.0, 4095.0) as u16
    }

    #[test]
    fn voltages_recover_counts_and_zero_by_kirchhoff() {
        let converter = BOARD.converter();
        for mv in (-24_000..=0).step_by(10) {
            let count = convert(&BOARD, f64::from(mv));
            // rounding to a number is half a step at most
            let error_counts = (converter.mv(f32::from(count)) - mv as f32) / converter.mv_per_count;
            assert!(error_counts.abs() < 0.501, "{mv} mV: {error_counts} counts");
            assert!((BOARD.count(mv as f32) - i32::from(count)).abs() <= 1);
        }
    }

    #[test]
    fn nothing_between_supply_and_ground_is_clipped() {
        let [low, high] = BOARD.converter().rails;
        for mv in [-24_000.0, 0.0] {
            let count = i32::from(convert(&BOARD, mv));
            assert!(low < count && count < high, "{mv} mV: {count} in {low}..{high}");
        }
        assert_eq!([convert(&BOARD, -1e6), convert(&BOARD, 1e6)], [0, 4095]);
    }
}
