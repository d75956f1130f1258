//! The three kinds of term that make a model out of a shaft: supports add to the dynamic stiffness,
//! forcings add to the excitation, readings change what a probe shows.

use nalgebra::{Complex, DVector};

use crate::bearing::support::SupportLaw;
use crate::machine::place::SpeedLaw;

/// Something that holds the shaft at one place: a bearing, a seal, an added mass.
#[derive(Debug, Clone)]
pub struct Support {
    /// Displacement of the place per unit coordinate.
    pub shape: DVector<f64>,
    /// Force per motion of the place.
    pub law: SupportLaw,
}

/// A force that turns with the shaft: phasor `F` in x, `−iF` in y.
#[derive(Debug, Clone)]
pub struct Forcing {
    /// Generalized force per unit of `amplitude`.
    pub shape: DVector<f64>,
    /// Phasor of the force in x: N, or kg·m for a force that grows with speed squared.
    pub amplitude: Complex<f64>,
    pub law: SpeedLaw,
}

/// What a probe shows: `gain · (cos·x + sin·y) + runout`, x and y less those of the housing it is mounted on.
#[derive(Debug, Clone)]
pub struct ProbeTerm {
    /// Displacement of the probe's place per unit coordinate.
    pub shape: DVector<f64>,
    /// Angle from +x in the direction of rotation, rad.
    pub angle_rad: f64,
    /// Complex gain; 1 for a true probe.
    pub gain: Complex<f64>,
    /// Phasor that the surface adds at any speed, m.
    pub runout_m: Complex<f64>,
    /// Number of the support on whose housing the probe is mounted; on the ground without.
    pub mount: Option<usize>,
}
