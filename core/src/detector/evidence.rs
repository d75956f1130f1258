//! What a reading says for or against the model.

use super::{AveragedReading, noise_floor_um};
use crate::model::{MAX_PLANES, Model, Noise, Pair};
use crate::reading::MAX_PROBES;
use crate::residual::Residual;
use crate::scalar;
use crate::state::Reason;
use crate::thresholds::Thresholds;
use crate::track::Estimate;

/// Mean absolute value of normal numbers in standard deviations, √(2/π).
const MEAN_ABSOLUTE: f32 = 0.797_884_6;

/// Unbalance and vectors of one reading, to be held against those of trusted readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    pub averaged: AveragedReading,
    /// Noise of one reading's vectors.
    pub noise: Noise,
    /// The unbalance of each plane, found without bounds, g·mm.
    pub unbalance_g_mm: [Pair; MAX_PLANES],
    pub planes: u8,
    /// Standard deviation of either part by noise, g·mm; NaN if the model states none.
    pub deviation_g_mm: [f32; MAX_PLANES],
    /// The same for features as wrong as the residual says, if that is more, g·mm.
    pub misfit_g_mm: [f32; MAX_PLANES],
    /// A change of the unbalance up to this says nothing, g·mm.
    pub floor_g_mm: f32,
}

/// What one reading says, for [`Detector::update`](super::Detector::update).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    pub residual: Residual,
    /// The least residual that no bound on the unbalance stands in the way of, µm.
    pub free_residual_um: f32,
    /// Rows less unknowns, at least one.
    pub redundancy: u8,
    /// Residual that noise alone may leave, µm.
    pub floor_um: f32,
    /// The bearing of each probe, from zero.
    pub bearings: [u8; MAX_PROBES],
    pub observation: Observation,
    /// Why the readings are suspicious before they are averaged; [`Reason::None`] if they are not.
    pub raw: Reason,
}

impl Evidence {
    /// The evidence of an averaged reading's estimate, without a judgement of its raw readings. The noise is that of the used
    /// probes, reduced by the averaging.
    pub fn new<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
        model: &Model<SHAPES, PROBES, PLANES>,
        estimate: &Estimate,
        averaged: &AveragedReading,
    ) -> Self {
        let used = averaged.reading.probes().iter().filter(|probe| probe.is_finite());
        let square_um2 = used.fold(0.0, |sum, &probe| {
            let deviation_um = model.noise.deviation_um(probe);
            sum + 2.0 * deviation_um * deviation_um
        });
        let mut bearings = [0; MAX_PROBES];
        for (bearing, probe) in bearings.iter_mut().zip(&model.probes) {
            *bearing = probe.bearing;
        }
        let share = scalar::sqrt(averaged.variance);
        let deviation_g_mm = estimate.deviation_g_mm.map(|deviation| share * deviation);
        let mut misfit_g_mm = deviation_g_mm;
        // Of the least absolute residual as many rows are exact as there are unknowns.
        let wrong_um = estimate.free_residual_um / (MEAN_ABSOLUTE * f32::from(estimate.redundancy.max(1)));
        for (misfit, per_um) in misfit_g_mm.iter_mut().zip(estimate.deviation_g_mm_per_um) {
            *misfit = misfit.max(wrong_um * per_um);
        }
        let observation = Observation {
            averaged: *averaged,
            noise: model.noise,
            unbalance_g_mm: estimate.free_g_mm,
            planes: estimate.planes,
            deviation_g_mm,
            misfit_g_mm,
            floor_g_mm: model.unbalance_floor_g_mm,
        };
        Self {
            residual: estimate.residual,
            free_residual_um: estimate.free_residual_um,
            redundancy: estimate.redundancy,
            floor_um: noise_floor_um(averaged.variance * square_um2, estimate.residual.features),
            bearings,
            observation,
            raw: Reason::None,
        }
    }

    /// Residual up to which nothing is suspicious, µm: the floor of the noise or of the thresholds, whichever is greater.
    pub fn greater_floor_um(&self, thresholds: &Thresholds) -> f32 {
        scalar::greater(thresholds.floor_um, self.floor_um)
    }

    /// [`Reason::NoRedundancy`] or [`Reason::BelowNoise`] if the reading says nothing about the model.
    pub fn why_unjudged(&self, thresholds: &Thresholds) -> Option<Reason> {
        if self.redundancy == 0 {
            Some(Reason::NoRedundancy)
        } else if self.residual.f_um <= self.greater_floor_um(thresholds) {
            Some(Reason::BelowNoise)
        } else {
            None
        }
    }
}
