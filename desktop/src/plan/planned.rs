//! Planned readings with everything that a diagnosis of them would look at.

use std::ops::Deref;

use rayon::prelude::*;

use super::imitation::{Candidate, UnknownCauses};
use super::model::PlannedReadings;
use crate::diagnose::base::BaseModel;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::hypothesis::PlacedEffect;
use crate::machine::drawing::Noise;

/// A machine in readings that it would give itself, and what could be taken for something else in them.
pub struct PlannedModel<'a> {
    readings: PlannedReadings<'a>,
    /// Every effect at every place that a diagnosis of such readings looks at.
    pub candidates: Vec<Candidate>,
    pub unknown: UnknownCauses,
}

impl<'a> PlannedModel<'a> {
    /// Of readings that are the machine's own as its file states it, with this noise.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn of(fitter: &'a Fitter<'a>, noise: Noise) -> Result<Self, Error> {
        let base = BaseModel::as_stated(fitter)?;
        let possible = base.possible();
        Self::looking_for(base, noise, &possible)
    }

    /// The same where a diagnosis looks for these effects.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn looking_for(base: BaseModel<'a>, noise: Noise, possible: &[PlacedEffect]) -> Result<Self, Error> {
        let readings = PlannedReadings::of(base, noise)?;
        let unknown = UnknownCauses::of(&readings)?;
        let candidates = possible.par_iter().filter_map(|placed| Candidate::of(&readings, *placed)).collect();
        Ok(Self { readings, candidates, unknown })
    }
}

impl<'a> Deref for PlannedModel<'a> {
    type Target = PlannedReadings<'a>;

    fn deref(&self) -> &Self::Target {
        &self.readings
    }
}
