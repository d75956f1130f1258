//! A model fitted to measurements, as `diagnose`, `compare` and `improve` draw it.

use rotor_edge_desktop::compare::Comparison;
use rotor_edge_desktop::diagnose::{BestFit, best_fit};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use crate::render::{ComparedModel, Prediction};

/// A model fitted to the data.
pub struct Fitted {
    /// With what it leaves of them.
    pub model: ComparedModel,
    pub best: BestFit,
}

impl Fitted {
    /// Fits the model of a file.
    ///
    /// # Errors
    /// If it cannot be fitted.
    pub fn new(
        label: impl Into<String>,
        rotor: &Rotor,
        readings: &[Reading],
    ) -> Result<Self, rotor_edge_desktop::Error> {
        let best = best_fit(rotor, readings)?;
        let comparison =
            Comparison::new(rotor, readings, &best.predicted_m, &best.noise, best.free_parameters);
        let prediction = Prediction { label: label.into(), predicted_m: best.predicted_m.clone() };
        Ok(Self { model: ComparedModel { prediction, comparison }, best })
    }
}
