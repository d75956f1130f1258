//! Unbalance as people write it, and its split into static and dynamic parts.
//!
//! ```text
//!   plane 1          plane 2
//!     U₁   =  S/2 + D    │   static   S = U₁ + U₂   half of it in each plane
//!     U₂   =  S/2 − D    │   dynamic  D = (U₁ − U₂)/2  in plane 1, its opposite in plane 2
//! ```
//!
//! The static part moves the shaft to one side, the dynamic part is the couple that is left over. Of more planes than two
//! each counts as what does the same to a rigid rotor in the first and the last of them.
//! (U_g and U_d of Bera et al., Sensors 2024, 24, 8123.)

pub mod region;
pub mod separation;

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

/// Static and dynamic unbalance of planes at these places; with one plane all of it is static.
///
/// ```
/// use nalgebra::Complex;
/// use rotor_edge_desktop::unbalance::static_and_dynamic;
///
/// let couple = [1.0, 0.0, -1.0].map(|u| Complex::from(u * 1e-4));
/// let [fixed, dynamic] = static_and_dynamic(&[0.1, 0.4, 0.7], &couple);
/// assert!(fixed.norm() < 1e-12 && (dynamic.re - 1e-4).abs() < 1e-12);
/// ```
pub fn static_and_dynamic(positions_m: &[f64], planes_kg_m: &[Complex<f64>]) -> [Complex<f64>; 2] {
    let fixed = planes_kg_m.iter().sum();
    let (Some(first), Some(last)) = (positions_m.first(), positions_m.last()) else {
        return [fixed, Complex::from(0.0)];
    };
    let length_m = last - first;
    // 1 in the first plane, −1 in the last, and in between as a lever has it
    let lever = |z: f64| if length_m == 0.0 { 0.0 } else { 1.0 - 2.0 * (z - first) / length_m };
    let couple = positions_m.iter().zip(planes_kg_m).map(|(z, u)| u * (0.5 * lever(*z)));
    [fixed, couple.sum()]
}
