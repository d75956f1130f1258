//! The limits of a search beside a fit that explains the data.

use super::screening::PRIOR_COST;
use crate::error::Error;
use crate::fit::Fit;
use crate::statistics::significance::NEGLIGIBLE;

/// The data as a candidate, or the files without a mistake, explain them.
#[derive(Debug, Clone, Copy)]
pub struct ExplainedData {
    /// Evidence below which another candidate is beyond doubt less probable. Where none explains the data, noise that takes the rest for its
    /// own can change all by as much.
    pub least_evidence: f64,
    /// Cost of data, bearings and drawing above which another candidate is beyond doubt less probable, whatever its noise.
    pub most: f64,
}

impl ExplainedData {
    /// By a fit that leaves no more than noise, with this evidence over the model.
    pub fn by(fit: &Fit, evidence: f64) -> Self {
        let doubtful = -2.0 * NEGLIGIBLE.ln();
        // where the noise is fitted too, evidence follows the logarithm of the cost; the margin is doubled, as another fit may have fewer
        // unknowns
        let cost = fit.chi2 + PRIOR_COST * fit.x.len() as f64;
        let most = cost * (2.0 * doubtful / fit.values as f64).exp();
        Self { least_evidence: evidence - doubtful, most }
    }
}

/// Asks whether an explanation that is no candidate, such as a mistake in the files, explains the data.
pub type OtherExplanation<'o> = &'o mut dyn FnMut() -> Result<Option<ExplainedData>, Error>;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::diagnose::base::BaseModel;
    use crate::fit::Fitter;
    use crate::fit::data::Data;
    use crate::machine::drawing::{Noise, Rotor};
    use crate::{measurement, rotor_file};

    /// A machine without a missing effect, whose drawing is off as usual.
    const MACHINE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/machines/ordinary/000-none");

    #[test]
    fn no_effect_is_settled_beside_a_mistake_that_explains_the_data() {
        let machine = Path::new(MACHINE);
        let mut rotor = rotor_file::read(&machine.join("rotor.toml")).unwrap();
        let readings = measurement::read(&machine.join("measured.csv"), &rotor).unwrap();
        let noise = Noise::of(&rotor, &readings);
        let explained_and_settled = |rotor: &Rotor| {
            let fitter = Fitter::new(rotor, Data::new(rotor, &noise, &readings));
            let weighed = BaseModel::fit(&fitter).unwrap().weighed(&readings, &noise).unwrap();
            let is_explained = weighed.mistaken.fits.first().is_some_and(|m| m.explained.is_some());
            (is_explained, weighed.tried.iter().filter(|t| t.is_settled).count())
        };
        assert!(matches!(explained_and_settled(&rotor), (false, 1..)));
        rotor.probe.iter_mut().for_each(|p| p.angle_deg = p.angle_deg.to_radians());
        assert_eq!(explained_and_settled(&rotor), (true, 0));
    }
}
