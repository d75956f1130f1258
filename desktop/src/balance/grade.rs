//! Balance quality grade G of ISO 21940-11: the permissible residual unbalance per mass of the rotor
//! times the speed, `G = e_per Ω`, in mm/s.
//!
//! A rotor is judged at its bearings. Each plane's unbalance is shared between them by the lever rule, and
//! a bearing may have the part of the permissible unbalance that its distance from the centre of mass
//! gives it, between 30 % and 70 %. The grade is that of the worse bearing; a rotor with all of its
//! unbalance in its centre of mass has `G = U Ω / m`.

use nalgebra::{Complex, DVector};

use crate::machine::drawing::Rotor;
use crate::measurement::rad_s;
use crate::shaft::structure::{ELEMENTS_PER_SEGMENT, Structure};

type C = Complex<f64>;

/// Smallest and largest part of the permissible unbalance at one bearing.
const SHARES: [f64; 2] = [0.3, 0.7];

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
        let structure = Structure::finite_elements(rotor, &rotor.physics, ELEMENTS_PER_SEGMENT);
        let none = || DVector::zeros(structure.size());
        let shifted = structure.stations.iter().fold(none(), |sum, s| sum + &s.displacement);
        let tilted =
            structure.stations.iter().fold(none(), |sum, s| sum + &s.displacement * s.position_m + &s.slope);
        let carried = &structure.mass * &shifted;
        let mass_kg = shifted.dot(&carried);
        let centre_m = tilted.dot(&carried) / mass_kg;
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
