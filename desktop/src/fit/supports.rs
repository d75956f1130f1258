//! What holds the shaft of a problem in each row, and what probes on housings read of it.

use nalgebra::{Complex, DMatrix, DVector, Matrix2};

use super::problem::Problem;
use crate::bearing::foundation::FoundationStiffness;
use crate::bearing::support::SupportLaw;
use crate::effects::Place;
use crate::effects::terms::Terms;
use crate::receptance::update::{Mounted, Supports};

type C = Complex<f64>;

impl Problem<'_> {
    /// Dynamic stiffness of one support in a row.
    pub(super) fn stiffness(&self, terms: &Terms, place: Place, law: &SupportLaw, row: usize) -> Matrix2<C> {
        law.dynamic_stiffness(self.speed_rad_s(terms, row), self.amplitude_m(place, row))
    }

    /// Amplitude that a support is taken at in a row, x and y.
    fn amplitude_m(&self, place: Place, row: usize) -> [f64; 2] {
        match (&self.amplitudes, place) {
            (Some(a), Place::Bearing(_) | Place::Disk(_)) => a[row][self.number(place)].map(f64::sqrt),
            _ => [0.0; 2],
        }
    }

    /// Dynamic stiffness of all held places in a row.
    pub(super) fn supports(&self, terms: &Terms, row: usize) -> Supports {
        let mut own = vec![Matrix2::zeros(); self.held.len()];
        for (place, law) in &terms.supports {
            if let Some(i) = self.held.iter().position(|h| h == place) {
                own[i] += self.stiffness(terms, *place, law, row);
            }
        }
        let (Some(footing), Some(held)) = (&terms.foundation, self.on_foundation(terms, row)) else {
            return Supports::apart(own);
        };
        let mut whole = DMatrix::zeros(2 * own.len(), 2 * own.len());
        for (i, own) in own.iter().enumerate() {
            whole.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(own);
        }
        // bearings are the first of the held places, so their numbers are the same
        for (i, a) in footing.bearings.iter().enumerate() {
            for (j, b) in footing.bearings.iter().enumerate() {
                let block = held.stiffness.fixed_view::<2, 2>(2 * i, 2 * j);
                whole.fixed_view_mut::<2, 2>(2 * a, 2 * b).copy_from(&block);
            }
        }
        Supports::joined(whole)
    }

    /// How the bearings on a foundation hold the shaft in a row.
    fn on_foundation(&self, terms: &Terms, row: usize) -> Option<FoundationStiffness> {
        let footing = terms.foundation.as_ref()?;
        let own = |b: &usize| self.stiffness(terms, terms.supports[*b].0, &terms.supports[*b].1, row);
        let own: Vec<_> = footing.bearings.iter().map(own).collect();
        Some(footing.held(self.speed_rad_s(terms, row), &own))
    }

    /// What the probes on housings read of them in a row.
    pub(super) fn mounted(&self, terms: &Terms, row: usize) -> Vec<Mounted> {
        let rotor = self.hypothesis.rotor;
        let on: Vec<(usize, usize)> =
            (0..rotor.probe.len()).filter_map(|p| Some((p, terms.mount(rotor, p)?))).collect();
        let common = if on.is_empty() { None } else { self.on_foundation(terms, row) };
        let reading = |(probe, bearing): (usize, usize)| {
            let (sin, cos) = self.plant.probe_angles_rad[probe].sin_cos();
            let mut reading = DVector::zeros(2 * self.held.len());
            let foot = terms.foundation.as_ref().and_then(|f| f.bearings.iter().position(|b| *b == bearing));
            if let (Some(foot), Some(footing), Some(held)) = (foot, &terms.foundation, &common) {
                for (j, b) in footing.bearings.iter().enumerate() {
                    for axis in 0..2 {
                        let column = 2 * j + axis;
                        reading[2 * b + axis] = held.housing[(2 * foot, column)] * cos
                            + held.housing[(2 * foot + 1, column)] * sin;
                    }
                }
            } else {
                let (place, law) = &terms.supports[bearing];
                let housing = law.housing(self.speed_rad_s(terms, row), self.amplitude_m(*place, row));
                for axis in 0..2 {
                    reading[2 * bearing + axis] = housing[(0, axis)] * cos + housing[(1, axis)] * sin;
                }
            }
            Mounted { probe, reading }
        };
        on.into_iter().map(reading).collect()
    }
}
