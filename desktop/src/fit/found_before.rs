//! What an earlier fit of a file found: where else a search can begin.

use nalgebra::DVector;

use super::Fitter;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Deviations;

/// A file that a fit has written.
pub struct FoundBefore {
    /// As it was written.
    pub file: Rotor,
    /// Search coordinates of its bearings.
    pub bearings: Vec<f64>,
    /// Errors of the drawing in standard deviations.
    pub deviation: DVector<f64>,
}

impl FoundBefore {
    /// `None` of a file that nobody has fitted.
    fn of(file: &Rotor, deviations: &Deviations) -> Option<Self> {
        let found = file.tolerance.as_ref().map(|t| &t.found);
        let by = |name: &str| found.and_then(|found| found.get(name)).copied().unwrap_or(0.0);
        let deviation = deviations.kinds.iter().map(|(kind, sd)| by(&kind.name(file)) / sd);
        file.is_fitted().then(|| Self {
            file: file.clone(),
            bearings: Bearings::of(file).stated(),
            deviation: DVector::from_iterator(deviations.len(), deviation),
        })
    }
}

impl Fitter<'_> {
    /// The same where the file of the rotor may have been fitted before: what it found is one more place to begin at.
    pub fn beginning_at(self, file: &Rotor) -> Self {
        Self { found_before: FoundBefore::of(file, &self.deviations).map(Into::into), ..self }
    }
}
