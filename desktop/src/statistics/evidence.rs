//! Evidence for unknowns of unknown size.
//!
//! An effect is allowed for with a Gaussian prior around nothing whose covariance is that of the estimate, `t − 1` times
//! (the g-prior of Zellner 1986). Compared with nothing, unknowns that lower minus twice the logarithm of the posterior density by
//! `gain` then have, by Laplace's approximation, the Bayes factor `t^(−d/2) exp(½ gain (1 − 1/t))`. How large effects are
//! nobody knows: every decade of size is as probable as the next, from one that could just be seen (`t = 1`) to one that makes all that
//! was measured (a mixture of g-priors: Liang et al., J. Am. Stat. Assoc. 2008, 103, 410). So what an unknown costs grows with how well it is
//! determined, and neither with the number of readings nor with its unit.

use statrs::function::gamma::{gamma_lr, ln_gamma};

/// Gains below this are none: the integral has a limit there.
const NO_GAIN: f64 = 1e-6;

/// How large effects can be.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// Logarithm of the largest `t`.
    ln_most: f64,
}

impl Sizes {
    /// Up to an effect that makes all that was measured: `squares`, the sum of the squared readings in noise units.
    pub fn up_to(squares: f64) -> Self {
        Self { ln_most: squares.max(std::f64::consts::E).ln() }
    }

    /// Twice the logarithm of the Bayes factor for `count` real unknowns over none.
    pub fn evidence(&self, gain: f64, count: usize) -> f64 {
        if count == 0 {
            return gain;
        }
        let half = 0.5 * count as f64;
        let seen = gain.max(NO_GAIN);
        // with v = 1/t: ∫ v^(d/2 − 1) exp(−½ gain v) dv over v from 1/t_most to 1
        let inside = gamma_lr(half, 0.5 * seen) - gamma_lr(half, 0.5 * seen * (-self.ln_most).exp());
        let ln_integral = ln_gamma(half) - half * (0.5 * seen).ln() + inside.ln();
        gain + 2.0 * (ln_integral - self.ln_most.ln())
    }

    /// The price of having chosen one common size for unknowns of which the data determine so many: twice the logarithm of the
    /// range of its logarithm over what is left of it (Laplace; its standard deviation is `1/√(2 determined)`).
    pub fn price_of_one(&self, determined: f64) -> f64 {
        let left = (std::f64::consts::PI / determined.max(1.0)).sqrt();
        2.0 * (0.5 * self.ln_most / left).max(1.0).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_equals_mean_bayes_factor_over_prior_sizes() {
        let sizes = Sizes::up_to(1e6);
        for (gain, count) in [(0.0, 1), (0.5, 2), (12.0, 1), (30.0, 4), (900.0, 2), (900.0, 8)] {
            let steps = 200_000;
            let mean = (0..steps)
                .map(|k| {
                    let ln_t = sizes.ln_most * (f64::from(k) + 0.5) / f64::from(steps);
                    (-0.5 * f64::from(count) * ln_t - 0.5 * gain * (-ln_t).exp()).exp()
                })
                .sum::<f64>()
                / f64::from(steps);
            let direct = gain + 2.0 * mean.ln();
            let found = sizes.evidence(gain, count as usize);
            assert!((found - direct).abs() < 1e-4, "{gain} {count}: {found} {direct}");
        }
    }

    #[test]
    fn evidence_equals_integral_over_log_uniform_amplitude() {
        // one real unknown at z standard deviations, its prior ∝ 1/|u| from one standard deviation to 1e3: the same
        // up to what a Gaussian of one size and a single size differ by
        let (z, most): (f64, f64) = (8.0, 1e3);
        let steps = 400_000;
        let density = |u: f64| (2.0 * u * most.ln()).recip();
        let direct: f64 = (0..steps)
            .map(|k| {
                let u = 1.0 + (2.0 * z - 1.0) * (f64::from(k) + 0.5) / f64::from(steps);
                density(u) * (0.5 * z * z - 0.5 * (u - z).powi(2)).exp()
            })
            .sum::<f64>()
            * (2.0 * z - 1.0)
            / f64::from(steps);
        let found = Sizes::up_to(most * most).evidence(z * z, 1);
        assert!((found - 2.0 * direct.ln()).abs() < 0.5, "{found} {}", 2.0 * direct.ln());
    }

    #[test]
    fn no_gain_speaks_against_an_effect_and_a_worse_fit_more_so() {
        let sizes = Sizes::up_to(1e6);
        let none = sizes.evidence(0.0, 2);
        assert!(none < 0.0 && sizes.evidence(0.0, 6) < none && sizes.evidence(-3.0, 2) < none - 2.9);
        assert_eq!(sizes.evidence(7.0, 0), 7.0);
    }

    #[test]
    fn largest_noise_of_forty_places_is_no_evidence() {
        // the largest of forty χ² with two degrees of freedom exceeds this in one of a hundred cases
        let gain = -2.0 * (1.0 - 0.99_f64.powf(1.0 / 40.0)).ln();
        assert!(Sizes::up_to(1e6).evidence(gain, 2) < 2.0 * 40_f64.ln() + 6.0);
    }
}
