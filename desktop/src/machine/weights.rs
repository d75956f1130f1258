//! Stated trial weights, by the planes that they are in.

use nalgebra::Complex;

use super::drawing::{Rotor, Run};
use crate::unbalance::phasor_kg_m;
use crate::units::same_place;

/// What a run has in each plane by its stated weights, kg·m.
///
/// # Errors
/// The position of a weight that is in no plane, m.
pub fn by_plane(rotor: &Rotor, run: &Run) -> Result<Vec<Complex<f64>>, f64> {
    let mut all = vec![Complex::from(0.0); rotor.plane.len()];
    for a in &run.added_unbalance {
        let plane = rotor.plane.iter().position(|p| same_place(p.position_m, a.position_m));
        all[plane.ok_or(a.position_m)?] += phasor_kg_m(a.magnitude_g_mm, a.angle_deg);
    }
    Ok(all)
}
