//! `[[bearing]]` as a file has it: a name, a place, and the keys of exactly one law.

use serde::{Deserialize, Serialize};

use super::drawing::Bearing;
use crate::bearing::Law;
use crate::bearing::constant::{Coefficients, Constant, Learned};
use crate::bearing::support::Pedestal;
use crate::bearing::table::{Table, TableRow};

/// Every key that a bearing can have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BearingEntry {
    name: String,
    position_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiffness_n_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    damping_n_s_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learned: Option<Learned>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    table: Option<Vec<TableRow>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pedestal: Option<Pedestal>,
}

impl TryFrom<BearingEntry> for Bearing {
    type Error = String;

    fn try_from(entry: BearingEntry) -> Result<Self, String> {
        let BearingEntry { name, position_m, stiffness_n_m, damping_n_s_m, learned, table, pedestal } = entry;
        let key = format!("[[bearing]] \"{name}\"");
        let constant = stiffness_n_m.is_some() || damping_n_s_m.is_some() || learned.is_some();
        let law = match (constant, table) {
            (true, Some(_)) => {
                return Err(format!(
                    "{key} has two laws, stiffness_n_m with damping_n_s_m and table; give one"
                ));
            }
            (false, None) => {
                return Err(format!("{key} has no law, expected stiffness_n_m with damping_n_s_m, or table"));
            }
            (false, Some(rows)) => {
                Law::Table(Table::new(rows).map_err(|what| format!("{key} table: {what}"))?)
            }
            (true, None) => {
                let missing = |what: &str| format!("{key} {what} is missing");
                Law::Constant(Constant {
                    stiffness_n_m: stiffness_n_m.ok_or_else(|| missing("stiffness_n_m"))?,
                    damping_n_s_m: damping_n_s_m.ok_or_else(|| missing("damping_n_s_m"))?,
                    learned,
                })
            }
        };
        Ok(Self { name, position_m, law, pedestal })
    }
}

impl From<Bearing> for BearingEntry {
    fn from(bearing: Bearing) -> Self {
        let Bearing { name, position_m, law, pedestal } = bearing;
        let none = Self {
            name,
            position_m,
            stiffness_n_m: None,
            damping_n_s_m: None,
            learned: None,
            table: None,
            pedestal,
        };
        match law {
            Law::Constant(Constant { stiffness_n_m, damping_n_s_m, learned }) => Self {
                stiffness_n_m: Some(stiffness_n_m),
                damping_n_s_m: Some(damping_n_s_m),
                learned,
                ..none
            },
            Law::Table(table) => Self { table: Some(table.rows().to_vec()), ..none },
        }
    }
}
