//! How large effects are on machines. A fit may go further, as far as physics allows; what is hidden for practice may not.

use crate::effects::Scales;

/// Smallest clearance between rotor and stator, m.
const LEAST_CLEARANCE_M: f64 = 2e-5;
/// Largest loss factor of shaft material and shrink fits at the fastest speed.
const LARGEST_LOSS: f64 = 0.1;
/// Largest change of a bearing's stiffness by the amplitude, relative, at twice the root mean square of it.
const LARGEST_HARDENING: f64 = 0.5;

/// Smallest and largest value of a parameter, SI; those of phasors are of their size.
pub fn bounds(effect: &str, parameter: &str, scales: &Scales) -> [f64; 2] {
    let any = f64::INFINITY;
    let within = |largest: f64| [-largest, largest];
    let stiffness = scales.stiffness_n_m;
    match (effect, parameter) {
        ("rub", "clearance") => [LEAST_CLEARANCE_M, any],
        ("rub", "k") => [0.0, stiffness],
        ("internal_damping", "eta") => [0.0, LARGEST_LOSS / scales.fastest_rad_s],
        ("nonlinear_stiffness", "kappa") => {
            let amplitude_m = 2.0 * scales.amplitude_m;
            within(LARGEST_HARDENING / (0.75 * amplitude_m * amplitude_m))
        }
        ("speed_factor", "factor") => [0.8, 1.25],
        ("probe_calibration", "gain") => [0.3, 3.0],
        ("speed_dependent_stiffness", "slope") => within(0.5),
        ("seal" | "cross_coupled_stiffness", "k" | "q") => within(stiffness),
        ("seal", "c") => [0.0, stiffness / scales.fastest_rad_s],
        ("magnetic_pull", "k") => within(0.3 * stiffness),
        ("pedestal" | "pedestal_by_direction", "k" | "kx" | "ky") => [0.2 * stiffness, any],
        ("disk_skew", "rad") => within(0.02),
        _ => within(any),
    }
}
