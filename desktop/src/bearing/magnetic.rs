//! A magnetic support: the pull of a magnet, or of a motor's air gap, that grows as the shaft comes nearer.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::law::{BearingLaw, LawUnknown, PRIOR_LOG_SD, Role};
use super::support::SupportLaw;
use crate::statistics::scale::Scale;

/// A support by magnets, the same in every direction.
///
/// Without control the stiffness is negative: the force pulls further in the direction of the displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Magnetic {
    /// Force towards the centre per displacement, N/m; negative for the pull of a gap.
    pub stiffness_n_m: f64,
    /// Force against the velocity, N·s/m.
    #[serde(default)]
    pub damping_n_s_m: f64,
}

impl Magnetic {
    /// Whether the numbers are those of a support.
    ///
    /// # Errors
    /// The key out of range and a sentence with its number.
    pub fn check(&self) -> Result<(), (String, String)> {
        let stiffness = self.stiffness_n_m;
        if !(-1e11..=1e11).contains(&stiffness) {
            return Err(("stiffness_n_m".into(), format!("{stiffness} N/m, expected -1e11 to 1e11")));
        }
        let damping = self.damping_n_s_m;
        if !(0.0..=1e9).contains(&damping) {
            return Err(("damping_n_s_m".into(), format!("{damping} N·s/m, expected 0 to 1e9")));
        }
        Ok(())
    }

    /// Stiffness, N/m, and damping, N·s/m, the same at every speed.
    pub fn coefficients(&self, _speed_rad_s: f64) -> (Matrix2<f64>, Matrix2<f64>) {
        (Matrix2::identity() * self.stiffness_n_m, Matrix2::identity() * self.damping_n_s_m)
    }
}

impl BearingLaw for Magnetic {
    fn unknowns(&self) -> Vec<LawUnknown> {
        // a stiffness of nothing states that there is none
        let size = self.stiffness_n_m.abs();
        let stiffness = (size > 0.0).then(|| LawUnknown {
            symbol: "stiffness".into(),
            unit: "N/m",
            role: Role::Other,
            scale: Scale::Linear(size),
            stated: self.stiffness_n_m / size,
            prior_sd: PRIOR_LOG_SD,
        });
        stiffness.into_iter().collect()
    }

    fn support(&self, x: &[f64]) -> SupportLaw {
        let mut magnets = *self;
        magnets.assign(x);
        let (stiffness, damping) = magnets.coefficients(0.0);
        SupportLaw::linear(stiffness, damping)
    }

    fn assign(&mut self, x: &[f64]) {
        if let &[x] = x {
            self.stiffness_n_m = x * self.stiffness_n_m.abs();
        }
    }

    fn check(&self) -> Result<(), (String, String)> {
        Magnetic::check(self).map_err(|(key, what)| (format!("magnetic.{key}"), what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_pulls_and_numbers_that_are_none_are_refused() {
        let gap = Magnetic { stiffness_n_m: -2e6, damping_n_s_m: 0.0 };
        assert_eq!(gap.check(), Ok(()));
        let (k, c) = gap.coefficients(100.0);
        assert_eq!((k, c), (Matrix2::new(-2e6, 0.0, 0.0, -2e6), Matrix2::zeros()));
        for (bad, key) in [
            (Magnetic { stiffness_n_m: f64::NAN, ..gap }, "stiffness_n_m"),
            (Magnetic { damping_n_s_m: -1.0, ..gap }, "damping_n_s_m"),
        ] {
            assert_eq!(bad.check().expect_err(key).0, key);
        }
    }
}
