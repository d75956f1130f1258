//! `[[shaft]]`: one piece of the shaft.

use serde::{Deserialize, Serialize};

use super::taper;

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
    /// Share of the section that carries shear, κ; Cowper's of a round section unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_coefficient: Option<f64>,
    /// Tension along the shaft, N; negative for a thrust that compresses it.
    #[serde(default, skip_serializing_if = "super::drawing::is_default")]
    pub axial_force_n: f64,
}

/// One piece of the shaft as a file has it: cylindrical, or a cone from its left diameters to its right ones.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentEntry {
    length_m: f64,
    outer_diameter_m: f64,
    outer_diameter_right_m: Option<f64>,
    #[serde(default)]
    inner_diameter_m: f64,
    inner_diameter_right_m: Option<f64>,
    #[serde(default = "steel_modulus_pa")]
    youngs_modulus_pa: f64,
    #[serde(default = "steel_density_kg_m3")]
    density_kg_m3: f64,
    #[serde(default = "steel_poisson_ratio")]
    poisson_ratio: f64,
    shear_coefficient: Option<f64>,
    #[serde(default)]
    axial_force_n: f64,
}

impl SegmentEntry {
    fn segments(self) -> impl Iterator<Item = Segment> {
        let outer = [self.outer_diameter_m, self.outer_diameter_right_m.unwrap_or(self.outer_diameter_m)];
        let inner = [self.inner_diameter_m, self.inner_diameter_right_m.unwrap_or(self.inner_diameter_m)];
        let count = taper::steps(&[outer, inner]);
        (0..count).map(move |i| Segment {
            length_m: self.length_m / count as f64,
            outer_diameter_m: taper::middle(outer, i, count),
            inner_diameter_m: taper::middle(inner, i, count),
            youngs_modulus_pa: self.youngs_modulus_pa,
            density_kg_m3: self.density_kg_m3,
            poisson_ratio: self.poisson_ratio,
            shear_coefficient: self.shear_coefficient,
            axial_force_n: self.axial_force_n,
        })
    }
}

/// Reads segments, a cone as the cylinders that stand for it.
pub(super) fn read<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Vec<Segment>, D::Error> {
    let entries = Vec::<SegmentEntry>::deserialize(from)?;
    Ok(entries.into_iter().flat_map(SegmentEntry::segments).collect())
}

/// What a shaft is made of where its file does not say: carbon steel at room temperature.
fn steel_modulus_pa() -> f64 {
    2.06e11
}

pub(super) fn steel_density_kg_m3() -> f64 {
    7850.0
}

fn steel_poisson_ratio() -> f64 {
    0.3
}
