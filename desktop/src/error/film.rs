//! Reasons why an oil film cannot be calculated.

/// Lengths and forces are those of the bearing's file in SI units.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// A number that states the film is out of range.
    #[error("{key}: {expected}")]
    OutOfRange {
        /// The key, as it would be written in the file.
        key: String,
        expected: String,
    },
    /// Load, clearance, viscosity or speed is zero, negative or not finite.
    #[error("oil film: {quantity} is {value} {unit}, expected a positive number")]
    NotPositive { quantity: &'static str, value: f64, unit: &'static str },
    /// The table was solved for another shape of bearing.
    #[error("oil film: the table was solved for another bearing geometry, expected a table of this one")]
    OtherShape,
    /// The search for the journal's place failed.
    #[error(
        "oil film: no equilibrium at Sommerfeld number {sommerfeld:.4} (a relative force of {force_left:.1e} is left)"
    )]
    NoEquilibrium { sommerfeld: f64, force_left: f64 },
    /// The load is too large for the film.
    #[error(
        "oil film: eccentricity beyond {limit} of the set clearance, outside the solver's range (Sommerfeld number \
         {sommerfeld:.4}, at the limit {sommerfeld_at_limit:.4})"
    )]
    TooEccentric { limit: f64, sommerfeld: f64, sommerfeld_at_limit: f64 },
    /// The load is too small for the film.
    #[error(
        "oil film: eccentricity below {limit} of the set clearance, outside the solver's range (Sommerfeld number \
         {sommerfeld:.4}, at the limit {sommerfeld_at_limit:.4})"
    )]
    TooCentred { limit: f64, sommerfeld: f64, sommerfeld_at_limit: f64 },
}
