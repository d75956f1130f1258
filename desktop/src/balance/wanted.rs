//! Criterion and limits of the weights, as a user states them.

use nalgebra::Complex;

use super::optimum::Criterion;
use super::places::{Filling, Holes, fillings, together};
use super::weights::Allowed;
use crate::error::Error;

type C = Complex<f64>;

/// The criterion that the weights minimise, and the limits of the planes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wanted {
    pub criterion: Criterion,
    /// Largest weight of a plane, g·mm; without a name of every plane that is not named.
    pub limits: Vec<(Option<String>, f64)>,
    /// Radii and steps of mass.
    pub allowed: Allowed,
    /// Fixed places, if weights cannot sit anywhere.
    pub holes: Option<Holes>,
    /// Places that hold something already, by number: of a plane, or of every plane.
    pub taken: Vec<(Option<String>, usize)>,
}

impl Wanted {
    /// # Errors
    /// If a plane is named that is not known, or a place that is not there.
    pub fn check(&self, known: &[String]) -> Result<(), Error> {
        let named =
            self.limits.iter().map(|(plane, _)| plane).chain(self.taken.iter().map(|(plane, _)| plane));
        if let Some(unknown) = named.flatten().find(|name| !known.contains(name)) {
            return Err(no_plane(unknown, known));
        }
        let count = self.holes.as_ref().map_or(0, |holes| holes.count);
        match self.taken.iter().find(|(_, hole)| !(1..=count).contains(hole)) {
            Some((_, hole)) => Err(Error::UnknownHole { hole: *hole, count }),
            None => Ok(()),
        }
    }

    /// The largest weight of a plane, g·mm.
    pub fn limit_g_mm(&self, plane: &str) -> f64 {
        let of = |name: Option<&str>| {
            self.limits.iter().find(|(p, _)| p.as_deref() == name).map(|(_, g_mm)| *g_mm)
        };
        of(Some(plane)).or_else(|| of(None)).unwrap_or(f64::INFINITY)
    }

    /// Fillings of the named planes near the best weights, chosen so that `cost` of their sums in g·mm is least.
    pub fn placed(
        &self,
        planes: &[impl AsRef<str>],
        best_g_mm: &[C],
        cost: impl Fn(&[C]) -> f64,
    ) -> Vec<Filling> {
        let ways: Vec<Vec<Filling>> = planes
            .iter()
            .zip(best_g_mm)
            .map(|(plane, best)| {
                let plane = plane.as_ref();
                let here = |(of, _): &&(Option<String>, usize)| of.as_deref().is_none_or(|of| of == plane);
                let taken: Vec<usize> = self.taken.iter().filter(here).map(|(_, hole)| *hole).collect();
                fillings(*best, &self.allowed, self.holes.as_ref(), &taken, self.limit_g_mm(plane))
            })
            .collect();
        together(&ways, cost)
    }
}

/// That there is no plane of this name.
pub fn no_plane(unknown: &str, known: &[String]) -> Error {
    Error::UnknownPlane { plane: unknown.into(), known: known.into() }
}
