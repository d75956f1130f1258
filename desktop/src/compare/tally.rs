//! Sums that every part of a comparison is made of.

use super::C;

/// One probe's value in one reading.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComparedValue {
    pub measured_m: C,
    pub model_m: C,
    /// Standard deviation of each component, m.
    pub sigma_m: f64,
}

impl ComparedValue {
    pub(super) fn error_m(&self) -> C {
        self.model_m - self.measured_m
    }
}

/// Sums over some of the values.
#[derive(Default)]
pub(super) struct Tally {
    pub residual_um: f64,
    pub features_um: f64,
    error2: f64,
    size2: f64,
    pub chi2: f64,
    pub components: usize,
}

impl Tally {
    pub(super) fn of<'a>(values: impl Iterator<Item = &'a ComparedValue>) -> Self {
        let mut tally = Self::default();
        for v in values {
            let error = v.error_m();
            tally.residual_um += error.l1_norm() * 1e6;
            tally.features_um += v.measured_m.l1_norm() * 1e6;
            tally.error2 += error.norm_sqr();
            tally.size2 += v.measured_m.norm_sqr();
            tally.chi2 += error.norm_sqr() / (v.sigma_m * v.sigma_m);
            tally.components += 2;
        }
        tally
    }

    pub(super) fn relative_error(&self) -> f64 {
        ratio(self.error2, self.size2).sqrt()
    }

    pub(super) fn chi2_per_value(&self) -> f64 {
        ratio(self.chi2, self.components as f64)
    }
}

/// 0 where there is nothing to divide by: no value was measured.
pub(super) fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}
