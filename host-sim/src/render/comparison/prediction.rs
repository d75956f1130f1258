//! What a model says of measurements.

use nalgebra::Complex;

/// One model's answer to a measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// What legends call it: "model", or "with seal at disk 3".
    pub label: String,
    /// Phasor of every probe of every reading, m.
    pub predicted_m: Vec<Vec<Complex<f64>>>,
}
