//! Units of weights: unbalances, or masses whose radius is not stated.

/// A gram is so many of each mass: exact by definition of the avoirdupois pound.
const G_LB: f64 = 453.592_37;
const G_OZ: f64 = G_LB / 16.0;
const MM_IN: f64 = 25.4;

/// Unit of weights, as a file states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightUnit {
    /// As columns and files have it.
    pub name: &'static str,
    /// As people write it.
    pub symbol: &'static str,
    /// g·mm of one unit; none of a mass, whose radius is not stated.
    pub g_mm: Option<f64>,
}

const fn of(name: &'static str, symbol: &'static str, g_mm: f64) -> WeightUnit {
    WeightUnit { name, symbol, g_mm: Some(g_mm) }
}

const fn mass(name: &'static str) -> WeightUnit {
    WeightUnit { name, symbol: name, g_mm: None }
}

/// All of them, the usual one first.
const UNITS: [WeightUnit; 17] = [
    of("g_mm", "g·mm", 1.0),
    of("kg_mm", "kg·mm", 1e3),
    of("mg_mm", "mg·mm", 1e-3),
    of("g_cm", "g·cm", 10.0),
    of("g_m", "g·m", 1e3),
    of("kg_cm", "kg·cm", 1e4),
    of("kg_m", "kg·m", 1e6),
    of("g_in", "g·in", MM_IN),
    of("oz_in", "oz·in", G_OZ * MM_IN),
    of("lb_in", "lb·in", G_LB * MM_IN),
    of("oz_ft", "oz·ft", 12.0 * G_OZ * MM_IN),
    of("lb_ft", "lb·ft", 12.0 * G_LB * MM_IN),
    mass("g"),
    mass("kg"),
    mass("mg"),
    mass("oz"),
    mass("lb"),
];

impl Default for WeightUnit {
    fn default() -> Self {
        UNITS[0]
    }
}

impl WeightUnit {
    /// The unit of a text: with any sign or none between its parts, if that leaves one meaning.
    pub fn of(text: &str) -> Option<Self> {
        let lower = text.trim().to_lowercase();
        let parts: Vec<&str> =
            lower.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty()).collect();
        // `gm` is a gram to some and g·m to others
        let joined = |unit: &&Self| unit.name.replace('_', "") == lower && lower != "gm" && lower != "kgm";
        UNITS
            .iter()
            .find(|unit| unit.name.split('_').eq(parts.iter().copied()))
            .or_else(|| UNITS.iter().find(joined))
            .copied()
    }

    /// Names of all units, for messages.
    pub fn names() -> String {
        UNITS.map(|unit| unit.name).join(", ")
    }

    pub fn is_mass(self) -> bool {
        self.g_mm.is_none()
    }

    /// g·mm of one unit; 1 of masses, whose numbers stay as they are.
    pub fn scale(self) -> f64 {
        self.g_mm.unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::WeightUnit;

    #[test]
    fn unit_is_known_however_its_parts_are_joined() {
        for (text, name) in [
            ("g_mm", "g_mm"),
            ("g·mm", "g_mm"),
            ("gmm", "g_mm"),
            ("oz-in", "oz_in"),
            ("Oz in", "oz_in"),
            ("kg mm", "kg_mm"),
            ("g*m", "g_m"),
            ("g", "g"),
        ] {
            assert_eq!(WeightUnit::of(text).map(|unit| unit.name), Some(name), "{text}");
        }
        assert!(["gm", "kgm", "stone", "", "mm"].iter().all(|text| WeightUnit::of(text).is_none()));
        // NIST SP 811: 1 oz·in of mass is 28.349523125 g · 25.4 mm
        assert!((WeightUnit::of("oz_in").unwrap().scale() - 720.077_887_375).abs() < 1e-9);
    }
}
