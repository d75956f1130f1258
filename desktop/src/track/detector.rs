//! Residuals over time, and the detector that flags a model that no longer describes the machine.

use std::collections::VecDeque;

use nalgebra::Complex;

/// Thresholds for suspicious readings and for flags.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorThresholds {
    /// Relative rise of the residual above its baseline that is suspicious.
    pub rise: f64,
    /// Residual over feature sum that is suspicious whatever the baseline.
    pub ratio_limit: f64,
    /// Residual over feature sum below which a rise is not suspicious: the model still describes the machine.
    pub ratio_floor: f64,
    /// Suspicious readings in a row that make a flag.
    pub persistence: usize,
    /// Number of good readings in the baseline.
    pub memory: usize,
}

impl Default for DetectorThresholds {
    fn default() -> Self {
        Self { rise: 0.5, ratio_limit: 1.0 / 3.0, ratio_floor: 0.05, persistence: 3, memory: 10 }
    }
}

/// Calculated against measured features of one reading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadingResidual {
    /// `e = Σ|calculated − measured|`, µm.
    pub e_um: f64,
    /// `f = Σ|measured|`, µm.
    pub f_um: f64,
    /// `e` of the probes at each bearing, µm; bearings after the last one with probes are left out.
    pub bearing_um: Vec<f64>,
}

impl ReadingResidual {
    /// Over the probes that were not lost; `bearing_of` is the bearing number of each probe.
    pub fn new(
        calculated_m: &[Complex<f64>],
        measured_m: &[Option<Complex<f64>>],
        bearing_of: &[usize],
    ) -> Self {
        let bearings = bearing_of.iter().max().map_or(0, |last| last + 1);
        let mut residual = Self { bearing_um: vec![0.0; bearings], ..Self::default() };
        for ((c, m), bearing) in calculated_m.iter().zip(measured_m).zip(bearing_of) {
            let Some(m) = m else { continue };
            let e_um = (c - m).l1_norm() * 1e6;
            residual.e_um += e_um;
            residual.bearing_um[*bearing] += e_um;
            residual.f_um += m.l1_norm() * 1e6;
        }
        residual
    }

    /// `e/f`.
    pub fn ratio(&self) -> f64 {
        if self.e_um == 0.0 { 0.0 } else { self.e_um / self.f_um }
    }
}

/// Result of the detector for one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorResult {
    /// The residual rose too much, or is too large a share of the features.
    pub suspicious: bool,
    /// The streak of suspicious readings has reached the persistence.
    pub lasting: bool,
    /// The bearing of the greater error over the last readings.
    pub suspect: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ResidualDetector {
    thresholds: DetectorThresholds,
    /// Residual ratios of the last good readings.
    good: VecDeque<f64>,
    streak: usize,
    recent_um: VecDeque<Vec<f64>>,
}

impl ResidualDetector {
    /// A detector without history: its first readings set the baseline.
    pub fn new(thresholds: DetectorThresholds) -> Self {
        Self { thresholds, good: VecDeque::new(), streak: 0, recent_um: VecDeque::new() }
    }

    /// Whether a residual would be suspicious now.
    pub fn suspects(&self, residual: &ReadingResidual) -> bool {
        let (t, ratio) = (&self.thresholds, residual.ratio());
        let level = self.good.iter().sum::<f64>() / self.good.len().max(1) as f64;
        let rose = !self.good.is_empty() && ratio > (1.0 + t.rise) * level;
        (rose && ratio > t.ratio_floor) || ratio > t.ratio_limit
    }

    /// Evaluates a reading and stores it. Suspicious readings do not enter the baseline, so an event cannot raise it.
    pub fn evaluate(&mut self, residual: &ReadingResidual) -> DetectorResult {
        let suspicious = self.suspects(residual);
        if suspicious {
            self.streak += 1;
        } else {
            self.streak = 0;
            self.accept(residual);
        }
        let persistence = self.thresholds.persistence.max(1);
        push(&mut self.recent_um, residual.bearing_um.clone(), persistence);
        let gauge = |bearing: usize| self.recent_um.iter().map(|um| um[bearing]).sum::<f64>();
        DetectorResult {
            suspicious,
            lasting: self.streak >= persistence,
            suspect: largest((0..residual.bearing_um.len()).map(gauge)),
        }
    }

    /// Adds a reading to the baseline, suspicious or not.
    pub fn accept(&mut self, residual: &ReadingResidual) {
        push(&mut self.good, residual.ratio(), self.thresholds.memory.max(1));
    }

    /// Ends a streak after the cause of a flag was handled.
    pub fn reset(&mut self) {
        self.streak = 0;
    }
}

/// Place of the largest value, the first of equal ones; 0 if there is none.
pub fn largest(values: impl Iterator<Item = f64>) -> usize {
    let first = (0, f64::NEG_INFINITY);
    values.enumerate().fold(first, |best, one| if one.1 > best.1 { one } else { best }).0
}

fn push<T>(queue: &mut VecDeque<T>, value: T, most: usize) {
    queue.push_back(value);
    if queue.len() > most {
        queue.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residual(e_um: f64, bearing: usize) -> ReadingResidual {
        let mut bearing_um = vec![0.0; 4];
        bearing_um[bearing] = e_um;
        ReadingResidual { e_um, f_um: 100.0, bearing_um }
    }

    fn flags(readings: &[ReadingResidual]) -> Vec<(usize, usize)> {
        let mut detector = ResidualDetector::new(DetectorThresholds::default());
        let results = readings.iter().map(|r| detector.evaluate(r)).enumerate();
        results.filter(|(_, v)| v.lasting).map(|(i, v)| (i, v.suspect)).collect()
    }

    #[test]
    fn lasting_rise_is_flagged_at_third_reading_with_bearing() {
        let mut readings = vec![residual(10.0, 0); 10];
        readings.extend(vec![residual(20.0, 1); 4]);
        assert_eq!(flags(&readings), [(12, 1), (13, 1)]);
    }

    #[test]
    fn short_disturbance_and_negligible_rise_are_not_flagged() {
        let mut readings = vec![residual(10.0, 0); 10];
        readings.extend([residual(60.0, 1), residual(60.0, 1), residual(10.0, 0)]);
        assert!(flags(&readings).is_empty());
        let mut quiet = vec![residual(1.0, 0); 10];
        quiet.extend(vec![residual(4.9, 0); 10]);
        assert!(flags(&quiet).is_empty());
    }

    #[test]
    fn residual_sums_components_by_bearing_without_lost_probes() {
        let y = |re, im| Complex::new(re, im) * 1e-6;
        let calculated = [y(1.0, 2.0), y(3.0, -1.0), y(9.0, 9.0)];
        let measured = [Some(y(2.0, 2.5)), Some(y(3.0, 1.0)), None];
        let r = ReadingResidual::new(&calculated, &measured, &[0, 1, 1]);
        assert!((r.e_um - 3.5).abs() < 1e-9 && (r.f_um - 8.5).abs() < 1e-9);
        assert!((r.bearing_um[0] - 1.5).abs() < 1e-9 && (r.bearing_um[1] - 2.0).abs() < 1e-9);
    }
}
