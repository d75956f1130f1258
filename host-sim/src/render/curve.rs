//! What figures draw of a model.

use nalgebra::Complex;

/// One model's response at one probe.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What the legend calls it.
    pub label: String,
    /// Speed in rpm and phasor in m, by ascending speed.
    pub points: Vec<(f64, Complex<f64>)>,
}
