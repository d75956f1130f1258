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
    /// The same for a rotor whose file an earlier fit may have written: bearings and drawing of that fit are one more start of the search.
    pub fn beginning_at(self, file: &Rotor) -> Self {
        Self { found_before: FoundBefore::of(file, &self.deviations).map(Into::into), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Tolerance;
    use crate::testing::sample_rotor;

    #[test]
    fn found_drawing_and_bearings_are_those_that_the_file_states() {
        let drawn = Rotor { tolerance: Some(Tolerance::holding(&sample_rotor())), ..sample_rotor() };
        let deviations = Deviations::of(&drawn);
        assert!(FoundBefore::of(&drawn, &deviations).is_none(), "nobody has fitted it");
        let mut file = drawn.clone();
        let bearings = Bearings::of(&drawn);
        let x = bearings.shifted(&bearings.stated(), 0.3, -0.2);
        file.bearing.iter_mut().for_each(|b| b.stated = Some(b.law.clone()));
        bearings.assign(&mut file, &x);
        let off = [0.5, -1.5, 0.0].into_iter().cycle().take(deviations.len());
        let off = DVector::from_iterator(deviations.len(), off);
        let found = file.tolerance.as_mut().map(|t| &mut t.found).unwrap();
        found.extend(
            deviations.kinds.iter().zip(off.iter()).map(|((kind, sd), t)| (kind.name(&drawn), sd * t)),
        );
        let before = FoundBefore::of(&file, &deviations).unwrap();
        assert!((before.deviation - off).amax() < 1e-12);
        assert!(before.bearings.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
