//! A bearing, and `[[bearing]]` as a file has it: a name, a place, and the keys of exactly one law.

use serde::{Deserialize, Serialize};

use crate::bearing::Law;
use crate::bearing::constant::{Coefficients, Constant, SpeedTrend};
use crate::bearing::film::Film;
use crate::bearing::film_law::FilmLaw;
#[cfg(doc)]
use crate::bearing::law::PRIOR_LOG_SD;
use crate::bearing::magnetic::Magnetic;
use crate::bearing::squeeze_film::SqueezeFilm;
use crate::bearing::support::Pedestal;
use crate::bearing::table::{CoefficientTable, TableRow};

/// A bearing: its place, and the law by which it holds the shaft.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BearingEntry", into = "BearingEntry")]
pub struct Bearing {
    pub name: String,
    /// Place on the shaft, m from the left end.
    pub position_m: f64,
    /// Height of its centre above the straight line through the machine, m.
    pub elevation_m: f64,
    /// How it holds the shaft.
    pub law: Law,
    /// The law as it was stated before `law` was fitted, where it was: the centre of its prior. Written by the tool.
    pub stated: Option<Law>,
    /// How far the coefficients that it states are trusted: a relative standard deviation; [`PRIOR_LOG_SD`] unless stated.
    pub coefficients_relative: Option<f64>,
    /// What gives under it, if the drawing states it.
    pub pedestal: Option<Pedestal>,
}

impl Bearing {
    /// On rigid ground, by a law.
    pub fn by(name: impl Into<String>, position_m: f64, law: Law) -> Self {
        let coefficients_relative = None;
        Self {
            name: name.into(),
            position_m,
            elevation_m: 0.0,
            law,
            stated: None,
            coefficients_relative,
            pedestal: None,
        }
    }

    /// On rigid ground, with the same coefficients at every speed.
    pub fn constant(
        name: impl Into<String>,
        position_m: f64,
        stiffness_n_m: Coefficients,
        damping_n_s_m: Coefficients,
    ) -> Self {
        let law = Law::Constant(Constant { stiffness_n_m, damping_n_s_m, learned: None });
        Self::by(name, position_m, law)
    }

    /// Whether its numbers are stated with a tolerance. Constants alone are a first estimate unless their accuracy is stated.
    pub fn states_tolerance(&self) -> bool {
        !matches!(self.law, Law::Constant(_)) || self.coefficients_relative.is_some()
    }

    /// Its coefficients, if they are stated as constants.
    pub fn constants(&self) -> Option<&Constant> {
        match &self.law {
            Law::Constant(law) => Some(law),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn constants_mut(&mut self) -> Option<&mut Constant> {
        match &mut self.law {
            Law::Constant(law) => Some(law),
            _ => None,
        }
    }
}

/// Every key that a bearing can have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BearingEntry {
    name: String,
    position_m: f64,
    #[serde(default, skip_serializing_if = "is_level")]
    elevation_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    coefficients_relative: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiffness_n_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    damping_n_s_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learned: Option<SpeedTrend>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    table: Option<Vec<TableRow>>,
    /// The name of a table's file, where the text came without a folder to look for it in.
    #[serde(default, skip_serializing)]
    table_file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    film: Option<Film>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    squeeze_film: Option<SqueezeFilm>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    magnetic: Option<Magnetic>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pedestal: Option<Pedestal>,
    /// Stiffness against tilt, which no model has: it is read to be refused by name.
    #[serde(default, skip_serializing)]
    angular_stiffness_n_m_rad: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stated: Option<LawEntry>,
}

/// The keys of a law alone. They stand in [`BearingEntry`] again, as serde lets unknown keys pass where one is flattened into it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LawEntry {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiffness_n_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    damping_n_s_m: Option<Coefficients>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learned: Option<SpeedTrend>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    table: Option<Vec<TableRow>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    film: Option<Film>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    squeeze_film: Option<SqueezeFilm>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    magnetic: Option<Magnetic>,
}

fn is_level(elevation_m: &f64) -> bool {
    *elevation_m == 0.0
}

/// The keys that make a law, for messages.
const LAWS: &str = "stiffness_n_m with damping_n_s_m, table, table_file, film, squeeze_film or magnetic";

impl LawEntry {
    /// The law that its keys make; `key` is where they are, for messages.
    fn law(self, key: &str) -> Result<Law, String> {
        let mut laws = Vec::new();
        if self.stiffness_n_m.is_some() || self.damping_n_s_m.is_some() || self.learned.is_some() {
            let missing = |what: &str| format!("{key} {what} is missing");
            laws.push(Law::Constant(Constant {
                stiffness_n_m: self.stiffness_n_m.ok_or_else(|| missing("stiffness_n_m"))?,
                damping_n_s_m: self.damping_n_s_m.ok_or_else(|| missing("damping_n_s_m"))?,
                learned: self.learned,
            }));
        }
        if let Some(rows) = self.table {
            laws.push(Law::Table(
                CoefficientTable::new(rows).map_err(|what| format!("{key} table: {what}"))?,
            ));
        }
        if let Some(film) = self.film {
            laws.push(Law::Film(FilmLaw::new(film).map_err(|e| format!("{key} {e}"))?));
        }
        laws.extend(self.squeeze_film.map(Law::SqueezeFilm));
        laws.extend(self.magnetic.map(Law::Magnetic));
        if laws.len() > 1 {
            return Err(format!("{key} has {} laws, give one of {LAWS}", laws.len()));
        }
        laws.pop().ok_or_else(|| format!("{key} has no law, expected {LAWS}"))
    }
}

impl From<Law> for LawEntry {
    fn from(law: Law) -> Self {
        let none = Self::default();
        match law {
            Law::Constant(Constant { stiffness_n_m, damping_n_s_m, learned }) => Self {
                stiffness_n_m: Some(stiffness_n_m),
                damping_n_s_m: Some(damping_n_s_m),
                learned,
                ..none
            },
            Law::Table(table) => Self { table: Some(table.rows().to_vec()), ..none },
            Law::Film(law) => Self { film: Some(law.film().clone()), ..none },
            Law::SqueezeFilm(damper) => Self { squeeze_film: Some(damper), ..none },
            Law::Magnetic(magnets) => Self { magnetic: Some(magnets), ..none },
        }
    }
}

impl TryFrom<BearingEntry> for Bearing {
    type Error = String;

    fn try_from(entry: BearingEntry) -> Result<Self, String> {
        let key = format!("[[bearing]] \"{}\"", entry.name);
        if let Some(name) = entry.table_file {
            let what = match entry.table {
                Some(_) => "has a table as well, expected one of the two".to_string(),
                None => format!("\"{name}\" lies beside the rotor's file, which must be read from disk"),
            };
            return Err(format!("{key} table_file: {what}"));
        }
        if entry.angular_stiffness_n_m_rad.is_some() {
            return Err(format!(
                "{key} angular_stiffness_n_m_rad: a bearing has no stiffness against tilt here; draw two bearings of half \
                 its stiffness k a distance d apart, which resist tilt with k d²/4"
            ));
        }
        let own = LawEntry {
            stiffness_n_m: entry.stiffness_n_m,
            damping_n_s_m: entry.damping_n_s_m,
            learned: entry.learned,
            table: entry.table,
            film: entry.film,
            squeeze_film: entry.squeeze_film,
            magnetic: entry.magnetic,
        };
        let law = own.law(&key)?;
        let stated = entry.stated.map(|stated| stated.law(&format!("{key} stated"))).transpose()?;
        Ok(Self {
            name: entry.name,
            position_m: entry.position_m,
            elevation_m: entry.elevation_m,
            coefficients_relative: entry.coefficients_relative,
            law,
            stated,
            pedestal: entry.pedestal,
        })
    }
}

impl From<Bearing> for BearingEntry {
    fn from(bearing: Bearing) -> Self {
        let law = LawEntry::from(bearing.law);
        Self {
            name: bearing.name,
            position_m: bearing.position_m,
            elevation_m: bearing.elevation_m,
            coefficients_relative: bearing.coefficients_relative,
            stiffness_n_m: law.stiffness_n_m,
            damping_n_s_m: law.damping_n_s_m,
            learned: law.learned,
            table: law.table,
            table_file: None,
            film: law.film,
            squeeze_film: law.squeeze_film,
            magnetic: law.magnetic,
            pedestal: bearing.pedestal,
            angular_stiffness_n_m_rad: None,
            stated: bearing.stated.map(LawEntry::from),
        }
    }
}
