//! Unbalance as people write it, and its split into static and dynamic parts.
//!
//! ```text
//!   plane 1          plane 2
//!     U₁   =  S/2 + D    │   static   S = U₁ + U₂   half of it in each plane
//!     U₂   =  S/2 − D    │   dynamic  D = (U₁ − U₂)/2  in plane 1, its opposite in plane 2
//! ```
//!
//! The static part moves the shaft to one side, the dynamic part is the couple that is left over.
//! (U_g and U_d of Bera et al., Sensors 2024, 24, 8123.)

use nalgebra::Complex;

/// g·mm in a kg·m.
pub const G_MM: f64 = 1e6;

/// The phasor `U e^{iα}`, kg·m.
pub fn phasor_kg_m(magnitude_g_mm: f64, angle_deg: f64) -> Complex<f64> {
    Complex::from_polar(magnitude_g_mm / G_MM, angle_deg.to_radians())
}

/// Magnitude (g·mm) and angle (degrees, −180 to 180) of a phasor in kg·m.
pub fn g_mm_deg(unbalance_kg_m: Complex<f64>) -> [f64; 2] {
    [unbalance_kg_m.norm() * G_MM, unbalance_kg_m.arg().to_degrees()]
}

/// Static and dynamic unbalance of two planes; with one plane all of it is static.
pub fn static_and_dynamic(planes_kg_m: &[Complex<f64>]) -> [Complex<f64>; 2] {
    match planes_kg_m {
        [first, second] => [first + second, (first - second) * 0.5],
        _ => [planes_kg_m.iter().sum(), Complex::from(0.0)],
    }
}
