//! `[[coupling]]`: what joins two spans of a train.

use serde::{Deserialize, Serialize};

/// A coupling where two segments of the shaft meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "CouplingEntry", into = "CouplingEntry")]
pub struct Coupling {
    pub name: String,
    /// Place on the shaft, m from the left end: where two segments meet.
    pub position_m: f64,
    /// How it gives; `None` for one that is rigid.
    pub flexibility: Option<Flexibility>,
    /// Mass of both halves together, kg; half of it on either side of a coupling that gives.
    pub mass_kg: f64,
    /// Moment of inertia of both halves about a diameter, kg·m², shared as the mass.
    pub diametral_inertia_kg_m2: f64,
    /// Moment of inertia of both halves about the shaft's axis, kg·m², shared as the mass.
    pub polar_inertia_kg_m2: f64,
}

/// Springs between the two shaft ends that a coupling joins, the same in every direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flexibility {
    /// Force per parallel offset of the two ends, N/m.
    pub lateral_stiffness_n_m: f64,
    /// Moment per angle between the two ends, N·m/rad.
    pub angular_stiffness_n_m_rad: f64,
}

/// Every key that a coupling can have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingEntry {
    name: String,
    position_m: f64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    rigid: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lateral_stiffness_n_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    angular_stiffness_n_m_rad: Option<f64>,
    #[serde(default)]
    mass_kg: f64,
    #[serde(default)]
    diametral_inertia_kg_m2: f64,
    #[serde(default)]
    polar_inertia_kg_m2: f64,
}

impl TryFrom<CouplingEntry> for Coupling {
    type Error = String;

    fn try_from(entry: CouplingEntry) -> Result<Self, String> {
        let key = format!("[[coupling]] \"{}\"", entry.name);
        let flexibility = match (entry.rigid, entry.lateral_stiffness_n_m, entry.angular_stiffness_n_m_rad) {
            (true, None, None) => None,
            (false, Some(lateral_stiffness_n_m), Some(angular_stiffness_n_m_rad)) => {
                Some(Flexibility { lateral_stiffness_n_m, angular_stiffness_n_m_rad })
            }
            (true, ..) => return Err(format!("{key} is rigid and has a stiffness, expected one of the two")),
            (false, None, None) => {
                return Err(format!(
                    "{key} has no stiffness, expected lateral_stiffness_n_m and angular_stiffness_n_m_rad, or rigid = true"
                ));
            }
            (false, None, Some(_)) => return Err(format!("{key} lateral_stiffness_n_m is missing")),
            (false, Some(_), None) => return Err(format!("{key} angular_stiffness_n_m_rad is missing")),
        };
        Ok(Self {
            name: entry.name,
            position_m: entry.position_m,
            flexibility,
            mass_kg: entry.mass_kg,
            diametral_inertia_kg_m2: entry.diametral_inertia_kg_m2,
            polar_inertia_kg_m2: entry.polar_inertia_kg_m2,
        })
    }
}

impl From<Coupling> for CouplingEntry {
    fn from(coupling: Coupling) -> Self {
        Self {
            name: coupling.name,
            position_m: coupling.position_m,
            rigid: coupling.flexibility.is_none(),
            lateral_stiffness_n_m: coupling.flexibility.map(|f| f.lateral_stiffness_n_m),
            angular_stiffness_n_m_rad: coupling.flexibility.map(|f| f.angular_stiffness_n_m_rad),
            mass_kg: coupling.mass_kg,
            diametral_inertia_kg_m2: coupling.diametral_inertia_kg_m2,
            polar_inertia_kg_m2: coupling.polar_inertia_kg_m2,
        }
    }
}
