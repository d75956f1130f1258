//! Between a probe's negative voltage and the converter's positive one.

/// Steps of a converter with 12 bits.
const STEPS: f32 = 4096.0;

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
    /// What the converter gives for 0 V at the probe.
    pub const fn zero_count(&self) -> i16 {
        (STEPS * self.probe_ohm / (self.probe_ohm + self.reference_ohm) + 0.5) as i16
    }

    /// One step of the converter, mV at the probe.
    pub const fn mv_per_count(&self) -> f32 {
        self.reference_mv / STEPS * (self.probe_ohm + self.reference_ohm) / self.reference_ohm
    }

    /// The converter's ends, from 0 V at the probe.
    pub const fn rails(&self) -> [i16; 2] {
        [-self.zero_count(), STEPS as i16 - 1 - self.zero_count()]
    }

    /// Counts from 0 V at the probe, for a voltage there.
    pub const fn counts(&self, mv: f32) -> i16 {
        (mv / self.mv_per_count()) as i16
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
        for mv in (-24_000..=0).step_by(10) {
            let counts = convert(&BOARD, f64::from(mv)) as i16 - BOARD.zero_count();
            let error_counts = f32::from(counts) - mv as f32 / BOARD.mv_per_count();
            assert!(error_counts.abs() < 1.001, "{mv} mV: {error_counts} counts");
        }
    }

    #[test]
    fn nothing_between_supply_and_ground_is_clipped() {
        let [low, high] = BOARD.rails();
        for mv in [-24_000.0, 0.0] {
            let counts = convert(&BOARD, mv) as i16 - BOARD.zero_count();
            assert!(low < counts && counts < high, "{mv} mV: {counts} in {low}..{high}");
        }
        assert_eq!([convert(&BOARD, -1e6), convert(&BOARD, 1e6)], [0, 4095]);
    }
}
