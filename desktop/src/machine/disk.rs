//! `[[disk]]`: a rigid disk, by its mass and inertias or by its dimensions.

use serde::{Deserialize, Serialize};

use super::segment::steel_density_kg_m3;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "DiskEntry")]
pub struct Disk {
    pub name: String,
    /// Place on the shaft, m from the left end.
    pub position_m: f64,
    pub mass_kg: f64,
    /// Moment of inertia about a diameter, kg·m².
    pub diametral_inertia_kg_m2: f64,
    /// Moment of inertia about the shaft's axis, kg·m².
    pub polar_inertia_kg_m2: f64,
}

/// Every key that a disk can have.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DiskEntry {
    name: String,
    position_m: f64,
    mass_kg: Option<f64>,
    diametral_inertia_kg_m2: Option<f64>,
    polar_inertia_kg_m2: Option<f64>,
    width_m: Option<f64>,
    outer_diameter_m: Option<f64>,
    inner_diameter_m: Option<f64>,
    density_kg_m3: Option<f64>,
}

impl TryFrom<DiskEntry> for Disk {
    type Error = String;

    fn try_from(entry: DiskEntry) -> Result<Self, String> {
        let key = format!("[[disk]] \"{}\"", entry.name);
        let sizes = [
            ("width_m", entry.width_m),
            ("outer_diameter_m", entry.outer_diameter_m),
            ("inner_diameter_m", entry.inner_diameter_m),
            ("density_kg_m3", entry.density_kg_m3),
        ];
        let masses = [
            ("mass_kg", entry.mass_kg),
            ("diametral_inertia_kg_m2", entry.diametral_inertia_kg_m2),
            ("polar_inertia_kg_m2", entry.polar_inertia_kg_m2),
        ];
        let stated =
            |all: &[(&'static str, Option<f64>)]| all.iter().find(|(_, v)| v.is_some()).map(|(n, _)| *n);
        if let (Some(size), Some(mass)) = (stated(&sizes), stated(&masses)) {
            return Err(format!(
                "{key} has both {size} and {mass}, expected its dimensions or its mass and inertias"
            ));
        }
        let needed =
            |(name, value): (&str, Option<f64>)| value.ok_or_else(|| format!("{key} {name} is missing"));
        let [mass_kg, diametral_inertia_kg_m2, polar_inertia_kg_m2] = if stated(&sizes).is_none() {
            [needed(masses[0])?, needed(masses[1])?, needed(masses[2])?]
        } else {
            let (width, outer) = (needed(sizes[0])?, needed(sizes[1])?);
            let (inner, density) = (
                entry.inner_diameter_m.unwrap_or(0.0),
                entry.density_kg_m3.unwrap_or_else(steel_density_kg_m3),
            );
            for (name, value, [low, high], unit) in [
                ("width_m", width, [1e-5, 10.0], "m"),
                ("outer_diameter_m", outer, [1e-4, 20.0], "m"),
                ("inner_diameter_m", inner, [0.0, 0.999 * outer], "m"),
                ("density_kg_m3", density, [100.0, 30_000.0], "kg/m³"),
            ] {
                if !(low..=high).contains(&value) {
                    return Err(format!("{key} {name}: {value} is outside {low} to {high} {unit}"));
                }
            }
            ring(width, outer, inner, density)
        };
        Ok(Self {
            name: entry.name,
            position_m: entry.position_m,
            mass_kg,
            diametral_inertia_kg_m2,
            polar_inertia_kg_m2,
        })
    }
}

/// Mass, diametral and polar inertia of a ring, about its centre.
fn ring(width_m: f64, outer_m: f64, inner_m: f64, density_kg_m3: f64) -> [f64; 3] {
    let mass = density_kg_m3 * std::f64::consts::PI / 4.0 * (outer_m.powi(2) - inner_m.powi(2)) * width_m;
    let squares = outer_m.powi(2) + inner_m.powi(2);
    [mass, mass * (squares / 16.0 + width_m.powi(2) / 12.0), mass * squares / 8.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ROSS 2.3.0: `DiskElement.from_geometry(n=0, material=steel, width=0.07, i_d=0.05, o_d=0.28)`.
    #[test]
    fn disk_by_dimensions_has_the_mass_and_inertias_of_ross() {
        let [mass, diametral, polar] = ring(0.07, 0.28, 0.05, 7810.0);
        for (ours, theirs) in [
            (mass, 32.589_727_653_040_33),
            (diametral, 0.178_089_282_570_676_66),
            (polar, 0.329_563_620_891_370_37),
        ] {
            assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
        }
    }

    #[test]
    fn disk_of_dimensions_and_mass_is_refused() {
        let read = |text: &str| toml::from_str::<Disk>(&format!("name = \"d\"\nposition_m = 0.1\n{text}"));
        assert!(
            (read("width_m = 0.07\nouter_diameter_m = 0.28").unwrap().mass_kg / 33.8358 - 1.0).abs() < 1e-4
        );
        for (text, said) in [
            ("width_m = 0.07\nouter_diameter_m = 0.28\nmass_kg = 3", "both width_m and mass_kg"),
            ("width_m = 0.07", "outer_diameter_m is missing"),
            ("mass_kg = 3", "diametral_inertia_kg_m2 is missing"),
            ("width_m = 0.07\nouter_diameter_m = 280", "outer_diameter_m: 280 is outside"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(said), "{said}: {error}");
        }
    }
}
