//! What was deployed: the shaft on its basis, and three kinds of term.
//!
//! A [`Support`] adds to the dynamic stiffness, a [`Forcing`] to the excitation, a [`Probe`] says what a reading shows.
//! A physical effect is one or more such terms, so a better model needs no new firmware.
//!
//! `SHAPES` is the number of modes in one plane (the same modes serve x and y). A shape is the values of the modes at one place
//! of the shaft; [`Modes`] makes it and the shaft from matrices on any shape functions.

mod codec;
mod description;
mod modes;
#[cfg(test)]
pub(crate) mod tests;

use heapless::Vec;
use nalgebra::SVector;

pub use crate::model_error::ModelError;
use crate::reading::ProbeVector;
pub use description::Description;
pub use modes::{Matrices, Modes, ModesError, Shaft, Shape, Spring};

/// Version of the deployed format. It rises whenever a field is added, removed or changes its meaning.
pub const MODEL_SCHEMA: u32 = 4;

/// Planes whose unbalance is tracked, at most.
pub const MAX_PLANES: usize = 4;
/// Supports of a model, at most: 8 with the feature `large-models`, otherwise 4.
pub const MAX_SUPPORTS: usize = if LARGE { 8 } else { 4 };
/// Knots of all speed tables of a model together, at most: 16 with the feature `large-models`, otherwise 8.
pub const MAX_KNOTS: usize = if LARGE { 16 } else { 8 };
/// Forcings of a model, at most: 6 with the feature `large-models`, otherwise 2.
pub const MAX_FORCINGS: usize = if LARGE { 6 } else { 2 };
const LARGE: bool = cfg!(feature = "large-models");

/// A vector in the plane across the shaft, or a complex number (real, imaginary).
pub type Pair = [f32; 2];

/// Bearings that a suspicion can name, at most: their number travels in three bits, of which zero says "none".
pub const MAX_BEARINGS: u8 = 7;

/// A shaft plus three kinds of term, checked: made from a [`Description`] by [`Model::new`] or from its bytes by
/// [`Model::decode`]. The bytes are the only serialised form that is read, so that no model escapes the check.
#[derive(Debug, Clone, PartialEq)]
pub struct Model<const SHAPES: usize, const PROBES: usize, const PLANES: usize> {
    pub(crate) machine: [u8; 4],
    pub(crate) shaft: Shaft<SHAPES>,
    pub(crate) internal_damping_s: f32,
    pub(crate) planes: Vec<SVector<f32, SHAPES>, PLANES>,
    pub(crate) supports: Vec<Support<SHAPES>, MAX_SUPPORTS>,
    pub(crate) knots: Vec<Knot, MAX_KNOTS>,
    pub(crate) forcings: Vec<Forcing<SHAPES>, MAX_FORCINGS>,
    pub(crate) probes: Vec<Probe<SHAPES>, PROBES>,
    pub(crate) masked: u8,
    pub(crate) initial_unbalance_g_mm: Vec<Pair, PLANES>,
    pub(crate) unbalance_floor_g_mm: f32,
    pub(crate) noise: Noise,
    pub(crate) speed_range_rpm: [f32; 2],
}

/// Noise of a probe's vector: either part has the standard deviation `relative·|Y| + floor_um`. Both zero: not stated.
///
/// ```
/// use rotor_edge_core::{model::Noise, reading::ProbeVector};
/// let noise = Noise { relative: 0.02, floor_um: 0.03 };
/// let deviation_um = noise.deviation_um(ProbeVector { cos_um: 3.0, sin_um: -4.0 });
/// assert!((deviation_um - 0.13).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// Part that is proportional to the amplitude.
    pub relative: f32,
    /// Part that is always there, µm zero-to-peak.
    pub floor_um: f32,
}

impl Noise {
    /// Standard deviation of either part of a measured vector, µm; NaN for a lost probe.
    pub fn deviation_um(self, measured: ProbeVector) -> f32 {
        self.relative * measured.amplitude_um() + self.floor_um
    }

    pub fn is_stated(self) -> bool {
        self.relative > 0.0 || self.floor_um > 0.0
    }
}

/// A place where the shaft is tied to the ground.
///
/// `F = Z u` with the 2×2 dynamic stiffness (rows and columns x, y)
/// `k + iW c − W² mass`, `k = stiffness·(1 + slope·(W/W_ref − 1)) + k_table(W)`, `c = damping + c_table(W)`; the two
/// diagonal stiffnesses further times `1 + ¾·hardening·a²`.
#[derive(Debug, Clone, PartialEq)]
pub struct Support<const SHAPES: usize> {
    pub shape: Shape<SHAPES>,
    /// `[[kxx, kxy], [kyx, kyy]]`, N/m.
    pub stiffness_n_m: [Pair; 2],
    /// `[[cxx, cxy], [cyx, cyy]]`, N·s/m.
    pub damping_n_s_m: [Pair; 2],
    /// Mass that moves with the shaft there (a seal's added mass), kg.
    pub mass_kg: f32,
    /// Relative change of `stiffness_n_m` for a relative change of speed of one.
    pub stiffness_slope: f32,
    /// Speed at which `stiffness_n_m` holds, rad/s; zero: no slope.
    pub reference_speed_rad_s: f32,
    /// Coefficients over speed beside the constant ones.
    pub table: Option<KnotRange>,
    /// Cubic hardening relative to the linear stiffness, 1/µm²; kxx sees the amplitude along x, kyy that along y.
    pub hardening_per_um2: f32,
    /// A pedestal in series, if the ground gives way.
    pub pedestal: Option<Pedestal>,
}

/// Which of the model's knots make a support's speed table: at least two, in ascending order of speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KnotRange {
    /// Place of the first in [`Description::knots`].
    pub first: u8,
    pub count: u8,
}

/// Coefficients at one speed; in between they are interpolated on a straight line, outside they stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    pub speed_rad_s: f32,
    /// `[[kxx, kxy], [kyx, kyy]]`, N/m.
    pub stiffness_n_m: [Pair; 2],
    /// `[[cxx, cxy], [cyx, cyy]]`, N·s/m.
    pub damping_n_s_m: [Pair; 2],
}

/// A mass on springs and dampers between bearing and ground, along x and along y: `kp + iW cp − W² mp`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pedestal {
    /// Stiffness along x and y, N/m.
    pub stiffness_n_m: Pair,
    /// Damping along x and y, N·s/m.
    pub damping_n_s_m: Pair,
    /// Mass that moves along x and y, kg.
    pub mass_kg: Pair,
}

/// A known excitation that turns with the shaft: phasors `Fx = F`, `Fy = −iF`.
#[derive(Debug, Clone, PartialEq)]
pub struct Forcing<const SHAPES: usize> {
    /// Forward shape where it acts (slopes, for a moment).
    pub shape: SVector<f32, SHAPES>,
    /// `F` as real and imaginary part: µN for [`ForcingLaw::Constant`], g·mm (µN·s²) for [`ForcingLaw::SpeedSquared`].
    pub amplitude: Pair,
    /// How it changes with speed.
    pub law: ForcingLaw,
}

/// How a forcing changes with speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ForcingLaw {
    /// The same at every speed: shaft bow, coupling force.
    Constant,
    /// Proportional to W²: unbalance, disk skew.
    SpeedSquared,
}

/// What a probe shows: `Y = gain·(cos·x + sin·y) + runout`, x and y being the shaft's motion for a probe on the ground.
///
/// A probe on a support's housing shows the shaft less the housing, whose motion follows from that of the shaft at the
/// support: `(Zb + Zp)⁻¹ Zb`, bearing over bearing and pedestal.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe<const SHAPES: usize> {
    pub shape: Shape<SHAPES>,
    /// Cosine and sine of the probe's angle from +x, in the direction of rotation.
    pub direction: Pair,
    /// Complex gain (real, imaginary); `[1, 0]` for a probe in order.
    pub gain: Pair,
    /// Phasor of mechanical and electrical runout, µm (real, imaginary).
    pub runout_um: Pair,
    /// The bearing it stands at, counted from zero: what a suspicion of this probe is called.
    pub bearing: u8,
    /// The support on whose housing the probe is mounted; it must have a pedestal. `None`: on the ground.
    pub mount: Option<u8>,
}

/// What a model needs of the firmware, read from its bytes without decoding them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Modes in one plane; these must match exactly.
    pub shapes: u8,
    pub probes: u8,
    /// Planes whose unbalance is tracked.
    pub planes: u8,
}

impl<const SHAPES: usize> Support<SHAPES> {
    /// An isotropic spring and damper, nothing else.
    pub fn isotropic(shape: Shape<SHAPES>, stiffness_n_m: f32, damping_n_s_m: f32) -> Self {
        Self {
            shape,
            stiffness_n_m: [[stiffness_n_m, 0.0], [0.0, stiffness_n_m]],
            damping_n_s_m: [[damping_n_s_m, 0.0], [0.0, damping_n_s_m]],
            mass_kg: 0.0,
            stiffness_slope: 0.0,
            reference_speed_rad_s: 0.0,
            table: None,
            hardening_per_um2: 0.0,
            pedestal: None,
        }
    }
}

impl<const SHAPES: usize> Probe<SHAPES> {
    /// A probe in order on the ground at `direction` (cosine, sine of its angle), beside a bearing.
    pub fn plain(shape: Shape<SHAPES>, direction: Pair, bearing: u8) -> Self {
        Self { shape, direction, gain: [1.0, 0.0], runout_um: [0.0; 2], bearing, mount: None }
    }
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Model<SHAPES, PROBES, PLANES> {
    /// Some support stiffens with amplitude, so the response is no longer linear in the unbalance.
    pub fn is_nonlinear(&self) -> bool {
        self.supports.iter().any(|support| support.hardening_per_um2 != 0.0)
    }

    /// The knots of a support's table; none if the table points beyond the list.
    pub(crate) fn knots_of(&self, table: KnotRange) -> &[Knot] {
        let first = usize::from(table.first);
        self.knots.get(first..first + usize::from(table.count)).unwrap_or_default()
    }

    /// The speed lies in the range the model was made for (false for NaN).
    pub fn covers(&self, speed_rpm: f32) -> bool {
        let [lowest, highest] = self.speed_range_rpm;
        (lowest..=highest).contains(&speed_rpm)
    }
}
