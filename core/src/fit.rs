//! The problem of phase II at one speed: the unbalance of least absolute residual within a disc for each plane.

use nalgebra::Complex;

use crate::model::Pair;
use crate::reading::Reading;
use crate::response::Response;
use crate::scalar;

type C = Complex<f32>;

/// Part of a plane's influence that no other plane may explain: below it, f32 cannot tell them apart.
const SINGULAR: f32 = 1e-6;

/// Minimise `Σ|H u − target|` subject to `|u_k| ≤ bound_k`: convex, so any minimum is the minimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundedFit<const PROBES: usize, const PLANES: usize> {
    /// H, µm per g·mm: for each probe that was measured the row of its cosine and the row of its sine part, in each row
    /// the coefficients of `U cos α` and `U sin α` of each plane.
    influence: [[[Pair; PLANES]; 2]; PROBES],
    /// Measured features less those present without unbalance, µm.
    target_um: [Pair; PROBES],
    bound_g_mm: [f32; PLANES],
    probes: usize,
    planes: usize,
}

impl<const PROBES: usize, const PLANES: usize> BoundedFit<PROBES, PLANES> {
    const EMPTY: Self = Self {
        influence: [[[[0.0; 2]; PLANES]; 2]; PROBES],
        target_um: [[0.0; 2]; PROBES],
        bound_g_mm: [0.0; PLANES],
        probes: 0,
        planes: 0,
    };

    /// From complex influence coefficients (µm per g·mm of each plane) and target phasors (µm) of probes, and the largest
    /// unbalance allowed in each plane (g·mm); what goes beyond the capacity is left out.
    pub fn new(probes: impl Iterator<Item = ([C; PLANES], C)>, bound_g_mm: &[f32]) -> Self {
        let mut fit = Self::EMPTY;
        fit.planes = bound_g_mm.len().min(PLANES);
        for (own, &bound) in fit.bound_g_mm.iter_mut().zip(bound_g_mm) {
            *own = bound;
        }
        let places = fit.influence.iter_mut().zip(&mut fit.target_um);
        for ((influence, target), (coefficients, phasor)) in places.zip(probes) {
            let [cosine, sine] = influence;
            for ((cosine, sine), c) in cosine.iter_mut().zip(sine).zip(&coefficients) {
                // Y = c·(x + iy); the features are Re Y and −Im Y.
                (*cosine, *sine) = ([c.re, -c.im], [-c.im, -c.re]);
            }
            *target = [phasor.re, -phasor.im];
            fit.probes += 1;
        }
        fit
    }

    /// Of the probes that a reading has, against a model's response.
    pub(crate) fn of_reading(
        response: &Response<PROBES, PLANES>,
        reading: &Reading,
        bound_g_mm: &[f32],
    ) -> Self {
        let both = response.probes().iter().zip(reading.probes());
        let valid = both.filter(|(_, measured)| measured.is_finite());
        Self::new(
            valid.map(|(linear, measured)| (linear.per_unbalance, measured.phasor() - linear.fixed)),
            bound_g_mm,
        )
    }

    pub fn planes(&self) -> usize {
        self.planes
    }

    /// Rows of H: two for each probe that was measured.
    pub fn rows(&self) -> &[[Pair; PLANES]] {
        self.influence.as_flattened().get(..2 * self.probes).unwrap_or_default()
    }

    /// The features to be explained, one a row, µm.
    pub fn target_um(&self) -> &[f32] {
        self.target_um.as_flattened().get(..2 * self.probes).unwrap_or_default()
    }

    /// Largest unbalance allowed in each plane, g·mm.
    pub fn bound_g_mm(&self) -> &[f32] {
        self.bound_g_mm.get(..self.planes).unwrap_or_default()
    }

    /// `H u − target` of each row, µm.
    #[inline]
    pub fn residuals_um(&self, unbalance_g_mm: &[Pair; PLANES]) -> impl Iterator<Item = f32> {
        self.rows().iter().zip(self.target_um()).map(move |(row, target)| {
            let mut sum = -target;
            // Planes that are not there have no influence: a loop of one length is unrolled.
            for ([a, b], [x, y]) in row.iter().zip(unbalance_g_mm) {
                sum += a * x + b * y;
            }
            sum
        })
    }

    /// `Σ|H u − target|`, µm.
    #[inline(never)] // once in flash
    pub fn residual_um(&self, unbalance_g_mm: &[Pair; PLANES]) -> f32 {
        self.residuals_um(unbalance_g_mm).fold(0.0, |sum, residual| sum + residual.abs())
    }

    /// Standard deviation of either part of each plane's unbalance for features of standard deviation `noise_um`:
    /// `σ²(HᵀH)⁻¹`, as of least squares; infinite where the rows do not tell the planes apart. g·mm.
    ///
    /// HᵀH is a Hermitian matrix of one row a plane in real form, so that both parts have the same variance and none in
    /// common. It is inverted in place, plane by plane, the pivots being those of `L D Lᴴ`.
    pub fn deviations_g_mm(&self, noise_um: f32) -> [f32; PLANES] {
        let gram = self.gram();
        let mut inverse = gram;
        let mut deviations = [0.0; PLANES];
        for k in (0..PLANES).filter(|&plane| self.is_free(plane)) {
            let row = inverse[k];
            let pivot = row[k].re;
            if pivot.is_nan() || pivot <= SINGULAR * gram[k][k].re {
                return [f32::INFINITY; PLANES];
            }
            inverse[k] = [C::default(); PLANES];
            for (i, other) in inverse.iter_mut().enumerate() {
                let factor = if i == k { C::new(-1.0 / pivot, 0.0) } else { other[k] / pivot };
                other[k] = C::default();
                for (cell, above) in other.iter_mut().zip(&row) {
                    *cell -= factor * above;
                }
                other[k] = -factor;
            }
        }
        for (k, deviation) in deviations.iter_mut().enumerate() {
            if self.is_free(k) {
                *deviation = noise_um * scalar::sqrt(inverse[k][k].re);
            }
        }
        deviations
    }

    /// The plane is there, and its unbalance may be other than zero.
    fn is_free(&self, plane: usize) -> bool {
        self.bound_g_mm().get(plane).is_some_and(|&bound| bound > 0.0)
    }

    /// The Hermitian matrix `Σ c̄_i c_j` of the complex influence coefficients.
    fn gram(&self) -> [[C; PLANES]; PLANES] {
        let mut gram = [[C::default(); PLANES]; PLANES];
        for [influence, _] in self.influence.iter().take(self.probes) {
            for (row, [a, b]) in gram.iter_mut().zip(influence) {
                for (cell, [c, d]) in row.iter_mut().zip(influence) {
                    *cell += C::new(a * c + b * d, b * c - a * d);
                }
            }
        }
        gram
    }

    /// The nearest unbalance within the bounds: each plane outside its disc is drawn back along its radius.
    #[inline(never)] // once in flash
    pub fn confine(&self, mut unbalance_g_mm: [Pair; PLANES]) -> [Pair; PLANES] {
        for (unbalance, &bound) in unbalance_g_mm.iter_mut().zip(&self.bound_g_mm).take(self.planes) {
            *unbalance = confine(*unbalance, bound);
        }
        unbalance_g_mm
    }
}

#[inline]
pub(crate) fn confine([x, y]: Pair, bound: f32) -> Pair {
    let square = x * x + y * y;
    if square <= bound * bound {
        return [x, y];
    }
    let factor = bound / scalar::sqrt(square);
    [x * factor, y * factor]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confining_keeps_the_angle_and_shortens_to_the_bound() {
        assert_eq!(confine([3.0, 4.0], 10.0), [3.0, 4.0]);
        let [x, y] = confine([3.0, 4.0], 1.0);
        assert!((x - 0.6).abs() < 1e-6 && (y - 0.8).abs() < 1e-6);
        assert_eq!(confine([3.0, -4.0], 0.0), [0.0, -0.0]);
    }
}
