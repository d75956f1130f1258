//! What a bearing's law states and what it leaves to the data.
//!
//! # Example
//! A rubber ring, stiffer by its dynamic factor and with a loss factor; data may decide its stiffness:
//!
//! ```
//! use nalgebra::Matrix2;
//! use rotor_edge_desktop::bearing::law::{BearingLaw, LawUnknown, PRIOR_LOG_SD, Role};
//! use rotor_edge_desktop::bearing::support::SupportLaw;
//! use rotor_edge_desktop::effects::Scale;
//!
//! struct RubberRing {
//!     stiffness_n_m: f64,
//!     damping_n_s_m: f64,
//! }
//!
//! impl BearingLaw for RubberRing {
//!     fn unknowns(&self) -> Vec<LawUnknown> {
//!         vec![LawUnknown {
//!             symbol: "k".into(),
//!             unit: "N/m",
//!             role: Role::Stiffness,
//!             scale: Scale::Logarithmic,
//!             stated: self.stiffness_n_m.ln(),
//!             prior_sd: PRIOR_LOG_SD,
//!         }]
//!     }
//!
//!     fn support(&self, x: &[f64]) -> SupportLaw {
//!         let stiffness = Matrix2::identity() * x[0].exp();
//!         SupportLaw::linear(stiffness, Matrix2::identity() * self.damping_n_s_m)
//!     }
//!
//!     fn assign(&mut self, x: &[f64]) {
//!         self.stiffness_n_m = x[0].exp();
//!     }
//!
//!     fn check(&self) -> Result<(), (String, String)> {
//!         match self.stiffness_n_m > 0.0 && self.damping_n_s_m >= 0.0 {
//!             true => Ok(()),
//!             false => Err(("rubber.stiffness_n_m".into(), "expected a positive number".into())),
//!         }
//!     }
//! }
//!
//! let mut ring = RubberRing { stiffness_n_m: 2e6, damping_n_s_m: 300.0 };
//! assert!((ring.coefficients(314.0).stiffness[(0, 0)] - 2e6).abs() < 1e-3);
//! // the data say twice as stiff
//! ring.assign(&[ring.unknowns()[0].stated + 2.0_f64.ln()]);
//! assert!((ring.coefficients(314.0).stiffness[(1, 1)] / 4e6 - 1.0).abs() < 1e-12);
//! assert!(ring.check().is_ok());
//! assert!(RubberRing { stiffness_n_m: -1.0, ..ring }.check().is_err());
//! ```

use super::dynamic_coefficients::DynamicCoefficients;
use super::support::SupportLaw;
use crate::statistics::scale::Scale;

/// How far a stated direct coefficient, or a factor on a stated column, is trusted: standard deviation of its
/// logarithm (of the factor itself where it may change sign).
pub const PRIOR_LOG_SD: f64 = 0.5;

/// What an unknown of a law does; searches begin from stiffer or softer bearings by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// A direct stiffness, or a factor on it.
    Stiffness,
    /// A direct damping, or a factor on it.
    Damping,
    Other,
}

/// A number of a bearing that data may decide.
#[derive(Debug, Clone, PartialEq)]
pub struct LawUnknown {
    /// As engineers write it: `k_xx`, `k_xy per ln speed`, …
    pub symbol: String,
    /// SI unit.
    pub unit: &'static str,
    pub role: Role,
    pub scale: Scale,
    /// What the file states, as a search coordinate.
    pub stated: f64,
    /// How far that is trusted: standard deviation of the search coordinate.
    pub prior_sd: f64,
}

/// One way in which a bearing holds the shaft.
pub trait BearingLaw {
    /// What data may decide, in order.
    fn unknowns(&self) -> Vec<LawUnknown>;

    /// The support with the unknowns at these search coordinates.
    fn support(&self, x: &[f64]) -> SupportLaw;

    /// Takes over the unknowns at these search coordinates.
    fn assign(&mut self, x: &[f64]);

    /// Its own check.
    ///
    /// # Errors
    /// The key inside the bearing, and one clause on what was expected.
    fn check(&self) -> Result<(), (String, String)>;

    /// Whether the data decide its cross-coupled terms.
    fn opens_cross_terms(&self) -> bool {
        false
    }

    /// Whether its coefficients follow the speed.
    fn follows_speed(&self) -> bool {
        false
    }

    /// The support as stated: not always that of the unknowns' stated coordinates, as a logarithm knows no zero.
    fn drawn(&self) -> SupportLaw {
        let stated: Vec<f64> = self.unknowns().iter().map(|u| u.stated).collect();
        self.support(&stated)
    }

    /// Coefficients as stated at running speed.
    fn coefficients(&self, speed_rad_s: f64) -> DynamicCoefficients {
        self.drawn().coefficients(speed_rad_s)
    }
}

/// The eight columns by name, row by row, and whether they are direct.
pub(super) const COLUMNS: [(&str, bool); 8] = [
    ("k_xx", true),
    ("k_xy", false),
    ("k_yx", false),
    ("k_yy", true),
    ("c_xx", true),
    ("c_xy", false),
    ("c_yx", false),
    ("c_yy", true),
];

pub(super) fn role(column: usize) -> Role {
    match (COLUMNS[column].1, column < 4) {
        (true, true) => Role::Stiffness,
        (true, false) => Role::Damping,
        (false, _) => Role::Other,
    }
}

/// SI unit of a column.
pub(super) fn unit(column: usize) -> &'static str {
    if column < 4 { "N/m" } else { "N·s/m" }
}

/// Stiffest spring of a drawing, N/m: textbooks write 1e15 for a rigid bearing.
pub const STIFFEST_N_M: f64 = 1e15;

/// One sentence's clause for a number outside its range.
pub(super) fn within(
    key: &str,
    value: f64,
    [low, high]: [f64; 2],
    unit: &str,
) -> Result<(), (String, String)> {
    if value.is_finite() && (low..=high).contains(&value) {
        return Ok(());
    }
    let plain = |x: f64| {
        if x == 0.0 || (1e-4..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
    };
    Err((
        key.into(),
        format!("{value} is outside {} to {} {unit}", plain(low), plain(high)).trim_end().into(),
    ))
}
