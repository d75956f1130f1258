//! One reading, and the units of its numbers.

use crate::units::rad_s;
use nalgebra::Complex;

/// One row: all probes at one speed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    /// Row of the file that it was read from, comments and the header counted.
    pub row: Option<usize>,
    /// Name of the run, if the file has them.
    pub run: Option<String>,
    /// Name of the session that the run was measured in, if the file states it.
    pub session: Option<String>,
    /// Days since the record began, if the file has them.
    pub time_d: Option<f64>,
    pub speed_rpm: f64,
    /// Phasor `cos − i sin` of each probe, m; `None` where the reading was lost.
    pub probes: Vec<Option<Complex<f64>>>,
    /// Gap voltage of each probe, V; empty if the file has none.
    pub gaps_v: Vec<Option<f64>>,
    /// Conditions of operation, in the order and units of the columns; empty if the file has none.
    pub conditions: Vec<Option<f64>>,
}

impl Reading {
    pub fn speed_rad_s(&self) -> f64 {
        rad_s(self.speed_rpm)
    }

    /// All probes, or `None` if one was lost.
    pub fn complete(&self) -> Option<Vec<Complex<f64>>> {
        self.probes.iter().copied().collect()
    }
}

/// The phasor `cos − i sin`, m, of components in µm.
pub fn phasor_m(cos_um: f64, sin_um: f64) -> Complex<f64> {
    Complex::new(cos_um, -sin_um) * 1e-6
}

/// Values in the order of readings and probes, as a row for each reading; zero where a probe was lost.
pub(crate) fn by_reading(readings: &[Reading], seen: &[Complex<f64>]) -> Vec<Vec<Complex<f64>>> {
    let mut seen = seen.iter().copied();
    let mut row =
        |r: &Reading| r.probes.iter().map(|y| y.and_then(|_| seen.next()).unwrap_or_default()).collect();
    readings.iter().map(&mut row).collect()
}
