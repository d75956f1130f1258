//! The model at unknowns of somebody else's choosing, and its derivative by all of them.

use nalgebra::{Complex, DMatrix, DVector};

use super::{Problem, Responses};
use crate::fit::data::{Amplitudes, FitValue};
use crate::model::amplitude::Relaxation;

type C = Complex<f64>;

/// Rounds over the amplitude at supports that depend on it, and the relative change that ends them.
const ROUNDS: usize = 60;
const SETTLED: f64 = 1e-5;

impl Problem<'_> {
    /// Every evaluated value, row by row.
    pub(in crate::fit) fn values(&self) -> impl Iterator<Item = &FitValue> {
        self.rows.iter().flat_map(|row| &row.values)
    }

    /// Complex values that are evaluated.
    pub(in crate::fit) fn count(&self) -> usize {
        self.rows.iter().map(|row| row.values.len()).sum()
    }

    /// What is observed of the evaluated values, in noise units.
    pub(in crate::fit) fn observed(&self, evaluated: DMatrix<f64>) -> DMatrix<f64> {
        match self.transient {
            Some(transient) => transient.observed(&evaluated),
            None => evaluated,
        }
    }

    /// What was measured, in noise units.
    pub(super) fn measured(&self) -> DVector<f64> {
        let parts = self.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        DVector::from_iterator(2 * self.data.count(), parts)
    }

    /// Motion of the held places in each row under forces of these sizes.
    pub(super) fn motion(responses: &Responses, sizes: &[Vec<C>]) -> Vec<DVector<C>> {
        let moved = |(r, sizes): (usize, &Vec<C>)| {
            let held = &responses.of(r).held;
            DVector::from_fn(held.nrows(), |i, _| {
                sizes.iter().enumerate().map(|(force, size)| size * held[(i, force)]).sum::<C>()
            })
        };
        sizes.iter().enumerate().map(moved).collect()
    }

    /// Squared amplitude of the shaft at its places, by the motion of those that are held.
    pub(super) fn squared(&self, motion: &[DVector<C>]) -> Amplitudes {
        let places = self.places();
        let at = |m: &DVector<C>| {
            let mut squared = vec![[0.0; 2]; self.plant.points()];
            // how a length of the shaft bends is no amplitude
            for (i, place) in places.iter().enumerate().filter(|(_, place)| **place < self.plant.points()) {
                squared[*place] = [m[2 * i].norm_sqr(), m[2 * i + 1].norm_sqr()];
            }
            squared
        };
        motion.iter().map(at).collect()
    }

    /// Whitened change of the model per search coordinate, then per real and imaginary part of each linear unknown.
    pub(in crate::fit) fn tangent(&self) -> Option<DMatrix<f64>> {
        let linear = &self.now.as_ref()?.solved.columns;
        let mut outer = self.derivative()?;
        self.whitening.apply(&mut outer);
        let (n, width) = (outer.ncols(), linear.ncols());
        let mut whole = outer.resize_horizontally(n + width, 0.0);
        whole.columns_mut(n, width).copy_from(linear);
        Some(whole)
    }

    /// The model at `x` and these linear unknowns, in noise units, with supports that depend on amplitudes at those that it causes;
    /// `None` if the machine is singular.
    pub(in crate::fit) fn settled_model(
        &mut self,
        x: &[f64],
        unknowns: &[C],
        from: &Amplitudes,
    ) -> Option<DVector<f64>> {
        let terms = self.hypothesis.terms(x);
        if terms.supports.iter().any(|(_, law)| law.depends_on_amplitude()) {
            let mut held = from.clone();
            let mut relaxation = Relaxation::adaptive();
            let sizes = self.sizes(&terms, unknowns);
            for _ in 0..ROUNDS {
                self.amplitudes = Some(held.clone());
                let caused = self.squared(&Self::motion(&self.respond(&terms)?, &sizes));
                let flat = caused.iter().flatten().flatten().copied();
                if relaxation.step(held.iter_mut().flatten().flatten(), flat) < SETTLED {
                    break;
                }
            }
        }
        self.weighted_model(x, unknowns)
    }
}
