//! Balance quality grade G of ISO 21940-11: the permissible residual unbalance per mass of the rotor
//! times the speed, `G = e_per Ω`, in mm/s.
//!
//! A rotor is judged at its bearings. Each plane's unbalance is shared between them by the lever rule, and
//! a bearing may have the part of the permissible unbalance that its distance from the centre of mass
//! gives it, between 30 % and 70 %. The grade is that of the worse bearing; a rotor with all of its
//! unbalance in its centre of mass has `G = U Ω / m`.

use nalgebra::Complex;

use crate::machine::drawing::Rotor;
use crate::shaft::statics::mass_and_centre;
use crate::units::rad_s;

type C = Complex<f64>;

/// Grade of a machine whose file states none, mm/s: that of pumps, fans and general machinery.
pub const USUAL_GRADE_MM_S: f64 = 6.3;
/// Smallest and largest part of the permissible unbalance at one bearing.
const SHARES: [f64; 2] = [0.3, 0.7];

/// Neighbouring grades of the standard are this far apart.
const GRADE_STEP: f64 = 2.5;
/// A machine that was balanced to its grade and neglected since is two or three grades worse.
const WORST_GRADES: i32 = 3;

/// Grade before and after, mm/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grade {
    /// Of the unbalance that the weights are to cancel.
    pub before_mm_s: f64,
    /// Of what is left by the best estimate.
    pub after_mm_s: f64,
    /// Of what may be left: two standard deviations of the estimate added at the worse bearing.
    pub after_at_most_mm_s: f64,
}

/// Unbalance that the grade of a machine's `[rated]` permits it at its fastest speed, g·mm; `None` without a grade.
pub fn permissible_g_mm(rotor: &Rotor) -> Option<f64> {
    let rated = rotor.rated?;
    let grade_mm_s = rated.balance_grade_mm_s?;
    Some(Rigid::of(rotor).permissible_kg_m(grade_mm_s, rated.speed_rpm[1]) * 1e6)
}

/// Largest unbalance that this makes plausible, g·mm: three grades of a factor of 2.5 above the permissible one, 15.6
/// times it.
pub fn largest_plausible_g_mm(rotor: &Rotor) -> Option<f64> {
    permissible_g_mm(rotor).map(|permissible| permissible * GRADE_STEP.powi(WORST_GRADES))
}

/// A rotor as its bearings feel it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// Shaft and disks, kg.
    pub mass_kg: f64,
    /// Positions of the outermost bearings, m.
    bearings_m: [f64; 2],
    /// Part of the permissible unbalance at each bearing.
    shares: [f64; 2],
}

impl Rigid {
    /// Mass and centre of mass of a rotor with its disks.
    pub fn of(rotor: &Rotor) -> Self {
        let (mass_kg, centre_m) = mass_and_centre(rotor);
        let bearings_m = rotor.span_m();
        let span = bearings_m[1] - bearings_m[0];
        let second = ((centre_m - bearings_m[0]) / span).clamp(SHARES[0], SHARES[1]);
        Self { mass_kg, bearings_m, shares: [1.0 - second, second] }
    }

    /// Grade of unbalances (position in m, kg·m) at a speed, mm/s.
    pub fn grade_mm_s(&self, unbalances: &[(f64, C)], service_rpm: f64) -> f64 {
        let [a, b] = self.bearings_m;
        let lever = |z: &f64| (z - a) / (b - a);
        let at = [
            unbalances.iter().map(|(z, u)| u * (1.0 - lever(z))).sum::<C>().norm(),
            unbalances.iter().map(|(z, u)| u * lever(z)).sum::<C>().norm(),
        ];
        let per_mass = |k: usize| at[k] / (self.shares[k] * self.mass_kg);
        per_mass(0).max(per_mass(1)) * rad_s(service_rpm) * 1e3
    }

    /// Unbalance that a grade permits the whole rotor at a speed, kg·m: `U = G m / Ω`.
    pub fn permissible_kg_m(&self, grade_mm_s: f64, service_rpm: f64) -> f64 {
        1e-3 * grade_mm_s * self.mass_kg / rad_s(service_rpm)
    }

    /// Grade that an uncertainty of this size (position in m, standard deviation of each component in kg·m)
    /// can hide, two standard deviations at the worse bearing, mm/s.
    pub fn hidden_mm_s(&self, deviations: &[(f64, f64)], service_rpm: f64) -> f64 {
        let [a, b] = self.bearings_m;
        let at = |k: usize| {
            let lever = |z: &f64| if k == 0 { (b - z) / (b - a) } else { (z - a) / (b - a) };
            let square: f64 = deviations.iter().map(|(z, sd)| (lever(z) * sd).powi(2)).sum();
            2.0 * square.sqrt() / (self.shares[k] * self.mass_kg)
        };
        at(0).max(at(1)) * rad_s(service_rpm) * 1e3
    }
}
