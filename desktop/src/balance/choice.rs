//! The choice of what is put in: never more predicted vibration than without weights.
//!
//! Weights of least squares come from influence coefficients whose noise was subtracted. Where the runs contradict each other,
//! that can lead farther away than no weight at all; plain least squares cannot.

use nalgebra::{Complex, DMatrix, DVector};

use super::NormalEquations;
use super::optimum::{Criterion, best};
use super::places::Filling;
use super::wanted::Wanted;
use crate::error::Error;

type C = Complex<f64>;

/// Weights of the planes, and what is put in for them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Choice {
    /// Optimal unbalance of each plane, before it is split into pieces, g·mm.
    pub wanted_g_mm: Vec<C>,
    pub fillings: Vec<Filling>,
}

impl Choice {
    /// Sum of the pieces of each plane, g·mm.
    pub fn sums_g_mm(&self) -> Vec<C> {
        self.fillings.iter().map(Filling::sum_g_mm).collect()
    }

    /// That nothing is put in because nothing that can be put in helps.
    pub fn doubt(&self) -> Option<String> {
        let nothing = |f: &Filling| f.sum_g_mm().norm() == 0.0;
        let wanted = self.wanted_g_mm.iter().any(|w| w.norm() > 0.0);
        (wanted && self.fillings.iter().all(nothing)).then(|| {
            "No weight is recommended: every weight that can be placed leaves at least as much vibration as none.".into()
        })
    }
}

impl Wanted {
    /// The first of these candidates whose fillings are predicted to leave no more than none; with no fillings if there is none.
    /// `cost` is the predicted criterion of the sums of the planes, g·mm.
    pub(super) fn chosen(
        &self,
        planes: &[impl AsRef<str>],
        candidates: &[Vec<C>],
        cost: impl Fn(&[C]) -> f64,
    ) -> Choice {
        let without = cost(&vec![C::from(0.0); planes.len()]);
        let choices = candidates.iter().map(|wanted| Choice {
            wanted_g_mm: wanted.clone(),
            fillings: self.placed(planes, wanted, &cost),
        });
        let mut last = Vec::new();
        for choice in choices {
            if cost(&choice.sums_g_mm()) <= without {
                return choice;
            }
            last = choice.wanted_g_mm;
        }
        Choice { wanted_g_mm: last, fillings: vec![Filling::default(); planes.len()] }
    }
}

/// Weights to choose from, the preferred ones first: with the noise of the coefficients subtracted, and without.
///
/// # Errors
/// As those of [`best`].
pub(super) fn candidates(
    criterion: Criterion,
    equations: &NormalEquations,
    (per_weight, before): (&DMatrix<C>, &DVector<C>),
    limits: &[f64],
) -> Result<Vec<Vec<C>>, Error> {
    let plain = NormalEquations::of(per_weight, before);
    let all = match criterion {
        Criterion::LeastSquares => vec![equations, &plain],
        Criterion::MinMax => vec![equations],
    };
    let found = |of: &NormalEquations| best(criterion, of, (per_weight, before), limits);
    all.into_iter().map(|of| Ok(found(of)?.iter().copied().collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balance::places::Holes;

    #[test]
    fn candidate_that_is_worse_than_none_gives_way_to_the_next() {
        let cost = |w: &[C]| (C::from(10.0) + w[0]).norm_sqr();
        let (far, near) = (vec![C::from(-40.0)], vec![C::from(-9.0)]);
        let chosen = Wanted::default().chosen(&["A"], &[far.clone(), near.clone()], cost);
        assert_eq!(chosen.wanted_g_mm, near);
        assert!((chosen.sums_g_mm()[0] - near[0]).norm() < 1e-9 && chosen.doubt().is_none());
        let nothing = Wanted::default().chosen(&["A"], std::slice::from_ref(&far), cost);
        assert_eq!((nothing.wanted_g_mm.clone(), nothing.sums_g_mm()), (far, vec![C::from(0.0)]));
        assert!(nothing.doubt().unwrap().contains("No weight is recommended"));
    }

    #[test]
    fn only_free_hole_on_the_far_side_stays_empty() {
        let holes = Holes { count: 4, first_deg: 0.0, against_rotation: false, most: 1 };
        let taken = [2, 3, 4].map(|hole| (None, hole)).to_vec();
        let wanted = Wanted { holes: Some(holes), taken, ..Wanted::default() };
        let cost = |w: &[C]| (C::from(10.0) + w[0]).norm_sqr();
        assert_eq!(wanted.chosen(&["A"], &[vec![C::from(-10.0)]], cost).sums_g_mm(), [C::from(0.0)]);
    }
}
