//! The residual that noise alone may leave.

use crate::scalar;

/// `ln(1/p)` for the probability p = 1e-9 that a healthy reading's residual exceeds the floor: at ten readings a second
/// one in three years, and a flag needs many in a row.
const LN_1_BY_P: f32 = 20.723_266;

/// Residual that noise exceeds with a probability of at most 1e-9, µm.
///
/// `square_um2`: the sum of the variances of the features, each normally distributed; `features`: how many they are.
///
/// At the least absolute residual, e is at most what it is for the true unbalance: the sum of the noise's magnitudes,
/// `Σ|x_i|`. That is the greatest of the 2ⁿ sums `Σ ±x_i`, each normal with variance `S = Σσ_i²`, so by the union bound and
/// Chernoff's `P(Σ|x_i| > T) ≤ 2ⁿ exp(−T²/2S)`. Solved for T: `√(2 S (n ln 2 + ln 1/p))`; eight equal features: 20.5 σ.
pub fn noise_floor_um(square_um2: f32, features: u8) -> f32 {
    scalar::sqrt(2.0 * square_um2 * (f32::from(features) * core::f32::consts::LN_2 + LN_1_BY_P))
}

/// Length of a vector of features that noise exceeds with a probability of at most 1e-9, µm.
///
/// `square_um2`: the sum of the features' variances; `largest_um2`: the greatest of them.
///
/// The length is on average at most `√S`, and as a function of the features' normal numbers no steeper than the greatest
/// deviation σ, so that Gaussian concentration gives `P(length > √S + t) ≤ exp(−t²/2σ²)`. Solved for t: `σ √(2 ln 1/p)`.
pub(super) fn noise_norm_um(square_um2: f32, largest_um2: f32) -> f32 {
    scalar::sqrt(square_um2) + scalar::sqrt(2.0 * LN_1_BY_P * largest_um2)
}

/// Zero for what is not a number: a deviation that is not known.
pub(super) fn square(number: f32) -> f32 {
    scalar::greater(0.0, number * number)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::testing::Random;

    /// `P(Σ|x_i| > T)` for n half-normal variables of σ = 1, by convolution on a grid.
    fn tail(features: usize, threshold: f64) -> f64 {
        const STEP: f64 = 0.01;
        let cells = (threshold / STEP) as usize;
        let density = |x: f64| (2.0 / core::f64::consts::PI).sqrt() * (-0.5 * x * x).exp();
        let one: Vec<f64> = (0..=cells).map(|cell| density((cell as f64 + 0.5) * STEP) * STEP).collect();
        let mut sum = one.clone();
        for _ in 1..features {
            sum = (0..=cells).map(|c| (0..=c).map(|a| sum[a] * one[c - a]).sum()).collect();
        }
        1.0 - sum.iter().sum::<f64>()
    }

    #[test]
    fn noise_bound_holds_against_exact_distribution() {
        // One feature: the exact tail is that of the normal distribution, 2 Q(T) = 1e-9 at T = 6.109.
        let one = noise_floor_um(1.0, 1);
        assert!((6.109..6.6).contains(&one), "{one}");
        // The sum of eight, by convolution, at thresholds whose tail double precision resolves.
        let bound = |t: f64| 256.0 * (-t * t / 16.0).exp();
        for t in [14.0, 15.0, 16.0] {
            let exact = tail(8, t);
            assert!(exact < bound(t) && exact > 1e-3 * bound(t), "{t}: {exact} {}", bound(t));
        }
    }

    #[test]
    fn noise_floor_grows_with_root_of_variance() {
        assert_eq!(noise_floor_um(0.0, 8), 0.0);
        let (one, four) = (noise_floor_um(8.0, 8), noise_floor_um(32.0, 8));
        assert!((four - 2.0 * one).abs() < 1e-4);
        assert!((one - 20.5).abs() < 0.05, "{one}");
    }

    #[test]
    fn noise_length_bound_holds_against_chi_square() {
        // For 2k features of σ = 1, P(length² > x) = exp(−x/2) Σ (x/2)^i/i! over i < k.
        for k in [1_u8, 2, 4, 8] {
            let bound = f64::from(noise_norm_um(2.0 * f32::from(k), 1.0));
            let half = 0.5 * bound * bound;
            let (mut term, mut sum) = (1.0, 1.0);
            for i in 1..k {
                term *= half / f64::from(i);
                sum += term;
            }
            let tail = (-half).exp() * sum;
            assert!(tail < 1e-9 && tail > 1e-16, "{k}: {tail:e}");
        }
        assert_eq!(noise_norm_um(0.0, 0.0), 0.0);
    }

    #[test]
    fn uniform_noise_of_the_same_variance_stays_below_too() {
        let mut random = Random::new(3);
        let floor = noise_floor_um(8.0 / 3.0, 8);
        for _ in 0..100_000 {
            let sum: f32 = (0..8).map(|_| random.signed().abs()).sum();
            assert!(sum < floor);
        }
    }
}
