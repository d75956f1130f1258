//! `[[shaft]]`: one piece of the shaft.

use serde::{Deserialize, Serialize};

/// One cylindrical piece of the shaft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    pub length_m: f64,
    pub outer_diameter_m: f64,
    /// Bore, m; zero for a solid shaft.
    #[serde(default)]
    pub inner_diameter_m: f64,
    #[serde(default = "steel_modulus_pa")]
    pub youngs_modulus_pa: f64,
    #[serde(default = "steel_density_kg_m3")]
    pub density_kg_m3: f64,
    #[serde(default = "steel_poisson_ratio")]
    pub poisson_ratio: f64,
}

/// What a shaft is made of where its file does not say: carbon steel at room temperature.
fn steel_modulus_pa() -> f64 {
    2.06e11
}

fn steel_density_kg_m3() -> f64 {
    7850.0
}

fn steel_poisson_ratio() -> f64 {
    0.3
}
