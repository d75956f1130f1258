//! The numerics of a node, which may be compiled apart from it.

use crate::model::{MAX_PLANES, Model};
use crate::reading::Reading;
use crate::response::{Response, ResponseError, SupportAmplitudes, response};
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};

/// Numerics of a [`Monitor`](crate::monitor::Monitor) or a `Node`: provided whole, and compiled where the monitor is.
///
/// Generic code is compiled in the crate that names its sizes, at that crate's level of optimisation. Firmware that is built
/// to be small implements this trait in a crate of its own, which it has built for speed, for a type and sizes named there,
/// with functions that call the provided ones of [`InPlace`]; its node is then a `Node<SHAPES, PROBES, PLANES, ThatType>`.
pub trait Numerics<const SHAPES: usize, const PROBES: usize, const PLANES: usize> {
    /// [`response`].
    ///
    /// Errors: those of [`response`].
    fn response(
        model: &Model<SHAPES, PROBES, PLANES>,
        speed_rad_s: f32,
        support_amplitudes_um: &SupportAmplitudes,
    ) -> Result<Response<PROBES, PLANES>, ResponseError> {
        response(model, speed_rad_s, support_amplitudes_um)
    }

    /// [`Tracker::update`].
    ///
    /// Errors: those of [`Tracker::update`].
    fn update(
        tracker: &mut Tracker<PLANES>,
        config: &TrackConfig,
        model: &Model<SHAPES, PROBES, PLANES>,
        reading: &Reading,
        bound_g_mm: &[f32; MAX_PLANES],
    ) -> Result<Estimate, TrackError> {
        tracker.update(config, model, reading, bound_g_mm)
    }
}

/// Numerics compiled where the node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InPlace;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Numerics<SHAPES, PROBES, PLANES>
    for InPlace
{
}
