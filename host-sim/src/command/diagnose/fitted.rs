//! A model fitted to measurements, as `diagnose`, `compare` and `improve` draw it.

use nalgebra::DVector;
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::compare::Comparison;
use rotor_edge_desktop::diagnose::{BestFit, best_fit};
use rotor_edge_desktop::machine::drawing::{Bearing, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::model::deflection::Deflection;
use rotor_edge_desktop::units::rad_s;

use crate::render::fitted::{FittedCurves, ShaftMotion};
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
        Ok(Self::of(label, rotor, readings, best_fit(rotor, readings)?))
    }

    /// With a model that was fitted.
    pub fn of(label: impl Into<String>, rotor: &Rotor, readings: &[Reading], best: BestFit) -> Self {
        let comparison =
            Comparison::new(rotor, readings, &best.predicted_m, &best.noise, best.free_parameters);
        let prediction = Prediction { label: label.into(), predicted_m: best.predicted_m.clone() };
        Self { model: ComparedModel { prediction, comparison }, best }
    }
}

/// What a page draws of fits to these readings; the first is judged, the last is the best.
pub fn curves<'a>(fits: &'a [Fitted], readings: &'a [Reading]) -> FittedCurves<'a> {
    let worst = fits[0].model.comparison.worst.as_ref();
    FittedCurves {
        rotor: &fits[0].best.rotor,
        readings,
        models: fits.iter().map(|fit| fit.model.clone()).collect(),
        motion: worst.and_then(|worst| motion(fits, worst.speed_rpm)),
    }
}

/// How the shaft moves by the first and by the last of the fits; nothing where one of them cannot say.
fn motion(fits: &[Fitted], speed_rpm: f64) -> Option<ShaftMotion> {
    let mut shafts = Vec::new();
    for fit in fits.first().into_iter().chain(fits.last().filter(|_| fits.len() > 1)) {
        let unbalance_kg_m = DVector::from_column_slice(&fit.best.unbalance_kg_m);
        let model = Model::finite_elements(&fit.best.rotor);
        let shaft = model.deflection(rad_s(speed_rpm), &unbalance_kg_m).ok()?;
        let point = |d: &Deflection| (d.position_m, 2e6 * d.largest_m());
        shafts.push((fit.model.prediction.label.clone(), shaft.iter().map(point).collect()));
    }
    let clearance = |b: &Bearing| match &b.law {
        Law::Film(law) => Some((b.position_m, 2e6 * law.film.radial_clearance_m)),
        _ => None,
    };
    let bearings = &fits.last()?.best.rotor.bearing;
    Some(ShaftMotion {
        speed_rpm,
        shafts,
        clearances: bearings.iter().filter_map(clearance).collect(),
        bearings: bearings.iter().map(|b| (b.position_m, b.name.clone())).collect(),
    })
}
