//! The numerics of the boards' models. This crate is built for speed, everything else of an image to be small.

#![no_std]

use rotor_edge_core::model::{MAX_PLANES, Model};
use rotor_edge_core::numerics::{InPlace, Numerics};
use rotor_edge_core::reading::Reading;
use rotor_edge_core::response::{Response, ResponseError, SupportAmplitudes};
use rotor_edge_core::track::{Estimate, TrackConfig, TrackError, Tracker};

/// Shape functions a plane, as the desktop makes models for controllers.
pub const SHAPES: usize = 6;
/// Probes, at most.
pub const PROBES: usize = 4;
/// Planes whose unbalance is tracked, at most.
pub const PLANES: usize = 2;

/// A board's model.
pub type BoardModel = Model<SHAPES, PROBES, PLANES>;

/// Numerics compiled here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fast;

// Not inlined: they would be compiled where they are called.
impl Numerics<SHAPES, PROBES, PLANES> for Fast {
    #[inline(never)]
    fn response(
        model: &BoardModel,
        speed_rad_s: f32,
        support_amplitudes_um: &SupportAmplitudes,
    ) -> Result<Response<PROBES, PLANES>, ResponseError> {
        InPlace::response(model, speed_rad_s, support_amplitudes_um)
    }

    #[inline(never)]
    fn update(
        tracker: &mut Tracker<PLANES>,
        config: &TrackConfig,
        model: &BoardModel,
        reading: &Reading,
        bound_g_mm: &[f32; MAX_PLANES],
    ) -> Result<Estimate, TrackError> {
        InPlace::update(tracker, config, model, reading, bound_g_mm)
    }
}
