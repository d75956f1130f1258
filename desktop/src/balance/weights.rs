//! Available weights: a radius and a mass in steps.

use nalgebra::Complex;

use crate::unbalance::G_MM;

type C = Complex<f64>;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Allowed {
    /// Radii at which weights can sit, mm; none if the unbalance alone is asked for.
    pub radii_mm: Vec<f64>,
    /// Weights come in multiples of this, g.
    pub step_g: Option<f64>,
}

/// A weight, or the unbalance alone where no radius is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionWeight {
    /// The unbalance that it makes, kg·m.
    pub unbalance_kg_m: C,
    /// Mass in g and radius in mm.
    pub mass_and_radius: Option<[f64; 2]>,
}

impl Allowed {
    /// The weight whose unbalance comes nearest; among equals the lightest.
    pub fn nearest(&self, wanted_kg_m: C) -> CorrectionWeight {
        let wanted_g_mm = wanted_kg_m.norm() * G_MM;
        let choice = |radius_mm: &f64| {
            let exact_g = wanted_g_mm / radius_mm;
            let mass_g = self.step_g.map_or(exact_g, |step| (exact_g / step).round() * step);
            [mass_g, *radius_mm]
        };
        let off = |[mass_g, radius_mm]: &[f64; 2]| (mass_g * radius_mm - wanted_g_mm).abs();
        // to the millionth of a g·mm all are equal
        let rank = |c: &[f64; 2]| ((off(c) * 1e6).round(), c[0]);
        let best = self.radii_mm.iter().map(choice).min_by(|a, b| {
            let ((off_a, mass_a), (off_b, mass_b)) = (rank(a), rank(b));
            off_a.total_cmp(&off_b).then(mass_a.total_cmp(&mass_b))
        });
        let size_g_mm = best.map_or(wanted_g_mm, |[mass_g, radius_mm]| mass_g * radius_mm);
        CorrectionWeight {
            unbalance_kg_m: C::from_polar(size_g_mm / G_MM, wanted_kg_m.arg()),
            mass_and_radius: best,
        }
    }
}
