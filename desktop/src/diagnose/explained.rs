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
