//! Parts that several answers hold.

use nalgebra::Complex;
use rotor_edge_desktop::unbalance::g_mm_deg;
use serde::Serialize;

/// An unbalance, or a weight, at a plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneUnbalance {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
}

impl PlaneUnbalance {
    pub fn of(name: &str, unbalance_kg_m: Complex<f64>) -> Self {
        let [unbalance_g_mm, angle_deg] = g_mm_deg(unbalance_kg_m);
        Self { name: name.into(), unbalance_g_mm, angle_deg }
    }
}
