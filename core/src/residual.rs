//! Residuals over time: when the model stops describing the machine, and which bearing shows it.

use serde::{Deserialize, Serialize};

use crate::reading::{MAX_PROBES, ProbeVector};

/// Longest memory of the gauge, readings.
pub const MAX_PERSISTENCE: usize = 8;

/// When a reading is suspicious, and when suspicion becomes a flag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualConfig {
    /// Rise of the residual above its level that is suspicious, relative: 0.5 means half as much again.
    pub rise: f32,
    /// Residual ratio e/f that is suspicious whatever the level.
    pub ratio_limit: f32,
    /// Residual ratio below which a rise is not suspicious: the model still describes the machine.
    pub ratio_floor: f32,
    /// Suspicious readings in a row that make a flag; the gauge sums over as many. 1 to [`MAX_PERSISTENCE`].
    pub persistence: u8,
    /// Readings over which the level is averaged (time constant of the exponential mean).
    pub level_readings: f32,
}

impl Default for ResidualConfig {
    fn default() -> Self {
        Self { rise: 0.5, ratio_limit: 1.0 / 3.0, ratio_floor: 0.1, persistence: 3, level_readings: 10.0 }
    }
}

impl ResidualConfig {
    fn persistence(&self) -> usize {
        usize::from(self.persistence).clamp(1, MAX_PERSISTENCE)
    }
}

/// One of the two bearings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bearing {
    /// The bearing of the first two probes.
    One,
    /// The bearing of the last two probes.
    Two,
}

/// Why there is no verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResidualError {
    /// A feature is not finite; nothing was changed.
    NotFinite,
}

/// Residual of one reading.
///
/// ```
/// use rotor_edge_core::reading::ProbeVector;
/// use rotor_edge_core::residual::Residual;
/// let calculated = [ProbeVector { cos_um: 1.0, sin_um: 1.0 }; 4];
/// let mut measured = calculated;
/// measured[3].sin_um = 3.0;
/// let residual = Residual::new(&calculated, &measured).unwrap();
/// assert_eq!((residual.e_um, residual.f_um, residual.ratio, residual.features), (2.0, 10.0, 0.2, 8));
/// assert_eq!(residual.probe_um[3], 2.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residual {
    /// `e = Σ|calculated − measured|` over the features of the probes that were measured, µm.
    pub e_um: f32,
    /// `f = Σ|measured|` over the same, µm.
    pub f_um: f32,
    /// `e/f`; zero if both are zero, the largest number if only f is.
    pub ratio: f32,
    /// `Σ|calculated − measured|` over each probe's two features, µm; zero for a lost probe.
    pub probe_um: [f32; MAX_PROBES],
    /// Features that took part: two for each probe that was measured.
    pub features: u8,
}

impl Residual {
    /// Residual of calculated against measured vectors; lost probes are left out.
    ///
    /// Errors: [`ResidualError::NotFinite`] if a calculated part that counts is not finite.
    pub fn new(calculated: &[ProbeVector], measured: &[ProbeVector]) -> Result<Self, ResidualError> {
        let mut residual = Self::default();
        let probes = residual.probe_um.iter_mut().zip(calculated.iter().zip(measured));
        for (probe_um, (calculated, measured)) in probes {
            if measured.is_finite() {
                *probe_um =
                    (calculated.cos_um - measured.cos_um).abs() + (calculated.sin_um - measured.sin_um).abs();
                residual.e_um += *probe_um;
                residual.f_um += measured.cos_um.abs() + measured.sin_um.abs();
                residual.features += 2;
            }
        }
        if !(residual.e_um.is_finite() && residual.f_um.is_finite()) {
            return Err(ResidualError::NotFinite);
        }
        residual.ratio =
            if residual.e_um == 0.0 { 0.0 } else { (residual.e_um / residual.f_um).min(f32::MAX) };
        Ok(residual)
    }

    /// The residual at the first two probes and at the others, µm.
    fn bearing_um(&self) -> [f32; 2] {
        let (first, rest) = self.probe_um.split_at(2);
        [first.iter().sum(), rest.iter().sum()]
    }
}

/// What the monitor makes of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The reading's residual.
    pub residual: Residual,
    /// The level it was compared with, µm; zero at the first reading.
    pub level_um: f32,
    /// `Σ` of each bearing's residual over the last `persistence` readings, µm.
    pub gauge_um: [f32; 2],
    /// The residual rose too much, or is too large a part of what was measured.
    pub suspicious: bool,
    /// Suspicious readings in a row, this one included.
    pub streak: u16,
    /// The streak reached the persistence.
    pub flagged: bool,
    /// With a flag: the bearing of the greater gauge.
    pub suspect: Option<Bearing>,
}

/// Memory of the residuals. A reading that was lost or skipped is simply not given to it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ResidualMonitor {
    level_um: f32,
    /// Readings in the level so far, up to `level_readings`.
    weight: f32,
    streak: u16,
    recent_um: [[f32; 2]; MAX_PERSISTENCE],
}

impl ResidualMonitor {
    /// A monitor without a past: its first readings set the level.
    pub fn new() -> Self {
        Self::default()
    }

    /// The running level of e, µm: a mean over readings that were not suspicious, so that an event cannot raise its own
    /// baseline. Zero before the first.
    pub fn level_um(&self) -> f32 {
        self.level_um
    }

    /// Judges a reading and remembers it.
    ///
    /// Errors: [`ResidualError::NotFinite`], and the memory stays as it was.
    pub fn update(&mut self, config: &ResidualConfig, residual: Residual) -> Result<Verdict, ResidualError> {
        let [one, two] = residual.bearing_um();
        if ![residual.e_um, residual.f_um, residual.ratio, one, two].iter().all(|x| x.is_finite()) {
            return Err(ResidualError::NotFinite);
        }
        let level_um = self.level_um;
        let rose = self.weight > 0.0 && residual.e_um > (1.0 + config.rise) * level_um;
        let suspicious = (rose && residual.ratio > config.ratio_floor) || residual.ratio > config.ratio_limit;
        if suspicious {
            self.streak = self.streak.saturating_add(1);
        } else {
            self.streak = 0;
            self.weight = (self.weight + 1.0).min(config.level_readings.max(1.0));
            self.level_um += (residual.e_um - level_um) / self.weight;
        }
        self.recent_um.rotate_right(1);
        self.recent_um[0] = residual.bearing_um();
        let recent = self.recent_um.iter().take(config.persistence());
        let gauge_um = recent.fold([0.0, 0.0], |[a, b], [one, two]| [a + one, b + two]);
        let flagged = usize::from(self.streak) >= config.persistence();
        let greater = if gauge_um[1] > gauge_um[0] { Bearing::Two } else { Bearing::One };
        let suspect = flagged.then_some(greater);
        Ok(Verdict { residual, level_um, gauge_um, suspicious, streak: self.streak, flagged, suspect })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(part: f32) -> ProbeVector {
        ProbeVector { cos_um: part, sin_um: part }
    }

    /// A reading with the residual `e` at one bearing and a feature sum of 100 µm.
    fn residual(e: f32, bearing: usize) -> Residual {
        let measured = [vector(12.5); 4];
        let mut calculated = measured;
        calculated[2 * bearing].cos_um += e;
        Residual::new(&calculated, &measured).unwrap()
    }

    fn run(readings: &[Residual]) -> std::vec::Vec<Verdict> {
        let mut monitor = ResidualMonitor::new();
        readings.iter().map(|&r| monitor.update(&ResidualConfig::default(), r).unwrap()).collect()
    }

    #[test]
    fn a_lasting_rise_is_flagged_at_the_third_reading_and_names_the_bearing() {
        let mut readings = std::vec![residual(10.0, 0); 10];
        readings.extend([residual(20.0, 1); 4]);
        let verdicts = run(&readings);
        let flagged: std::vec::Vec<bool> = verdicts.iter().map(|v| v.flagged).collect();
        assert_eq!(flagged.iter().position(|&f| f), Some(12));
        assert_eq!(verdicts[12].suspect, Some(Bearing::Two));
        assert_eq!(verdicts[11].suspect, None);
        assert_eq!(verdicts[13].streak, 4);
    }

    #[test]
    fn a_single_bad_reading_is_suspicious_but_never_flagged() {
        let mut readings = std::vec![residual(10.0, 0); 5];
        readings.push(residual(30.0, 0));
        readings.extend([residual(10.0, 0); 5]);
        let verdicts = run(&readings);
        assert!(verdicts[5].suspicious && !verdicts.iter().any(|v| v.flagged));
        assert_eq!(verdicts[6].streak, 0);
    }

    #[test]
    fn an_event_does_not_raise_the_level_it_is_measured_by() {
        let mut readings = std::vec![residual(10.0, 0); 5];
        readings.extend([residual(20.0, 0); 30]);
        assert!((run(&readings).last().unwrap().level_um - 10.0).abs() < 1e-4);
    }

    #[test]
    fn the_level_begins_as_the_mean_and_becomes_exponential() {
        let mut monitor = ResidualMonitor::new();
        let config = ResidualConfig { level_readings: 2.0, ..ResidualConfig::default() };
        for (e, level) in [(4.0, 4.0), (6.0, 5.0), (7.0, 6.0), (6.0, 6.0), (4.0, 5.0)] {
            monitor.update(&config, residual(e, 0)).unwrap();
            assert!((monitor.level_um() - level).abs() < 1e-4, "{e}");
        }
    }

    #[test]
    fn a_large_rise_of_a_negligible_residual_is_not_suspicious() {
        let mut readings = std::vec![residual(1.0, 0); 5];
        readings.push(residual(9.0, 0));
        assert!(!run(&readings)[5].suspicious);
    }

    #[test]
    fn a_third_of_the_features_is_suspicious_from_the_first_reading() {
        assert!(run(&[residual(34.0, 0)])[0].suspicious);
        assert!(!run(&[residual(32.0, 0)])[0].suspicious);
    }

    #[test]
    fn not_a_number_is_refused_and_changes_nothing() {
        let mut monitor = ResidualMonitor::new();
        monitor.update(&ResidualConfig::default(), residual(5.0, 0)).unwrap();
        let before = monitor;
        let broken = Residual { e_um: f32::NAN, ..residual(5.0, 0) };
        assert_eq!(monitor.update(&ResidualConfig::default(), broken), Err(ResidualError::NotFinite));
        assert_eq!(monitor, before);
        assert_eq!(Residual::new(&[vector(f32::NAN)], &[vector(1.0)]), Err(ResidualError::NotFinite));
    }

    #[test]
    fn nothing_measured_gives_a_finite_ratio() {
        assert_eq!(Residual::new(&[vector(1.0)], &[vector(0.0)]).unwrap().ratio, f32::MAX);
        assert_eq!(Residual::new(&[vector(0.0)], &[vector(0.0)]).unwrap().ratio, 0.0);
    }
}
