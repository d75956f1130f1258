//! How far a number may be from the recorded one.
//!
//! The fallbacks were found by perturbing Young's modulus of every test rotor by 1e-12, about what a
//! reordered sum does. Fitted results moved by less than 1e-10, listed candidates by up to 1e-3.

use serde::Deserialize;

/// How a command finds its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// One computation without a search.
    Direct,
    /// A search ends at a tolerance of its own.
    Fitted,
    /// Random numbers from a fixed seed.
    Sampled,
}

/// Relative, of a direct number.
const DIRECT: f64 = 1e-9;
/// Relative to the largest number of the same array: below it a number is rounding noise.
const ROUNDING: f64 = 1e-11;
/// Relative to the largest number of the same array, of a fitted number without an interval.
const FITTED: f64 = 1e-6;
/// The same in a list of candidates: a candidate's optimum is flat where the data do not determine it.
const CANDIDATE: f64 = 1e-3;
/// The same of a sampled number without an interval, such as an acceptance rate.
const SAMPLED: f64 = 0.05;
/// A number that is a rounding error itself may grow by this factor.
pub const ROUNDING_GROWTH: f64 = 10.0;

impl Class {
    /// Share of a number's 95 % interval that it may move.
    fn share_of_interval(self) -> f64 {
        match self {
            Self::Direct => 0.0,
            Self::Fitted => 0.01,
            Self::Sampled => 0.1,
        }
    }

    /// Allowed difference of a number in JSON; `interval` is the width of its own 95 % interval,
    /// `largest` the largest magnitude in its array.
    pub fn allowed(self, value: f64, largest: f64, interval: Option<f64>, is_candidate: bool) -> f64 {
        let least = (DIRECT * value.abs()).max(ROUNDING * largest);
        let more = match (self, interval) {
            (Self::Direct, _) => 0.0,
            (_, Some(width)) => self.share_of_interval() * width,
            (Self::Fitted, None) if is_candidate => CANDIDATE * largest,
            (Self::Fitted, None) => FITTED * largest,
            (Self::Sampled, None) => SAMPLED * largest,
        };
        least.max(more)
    }

    /// Allowed difference of a printed number, beside one unit of its last digit.
    pub fn relative_in_text(self) -> f64 {
        match self {
            Self::Direct => DIRECT,
            Self::Fitted => CANDIDATE,
            Self::Sampled => SAMPLED,
        }
    }

    /// Whether integers that count or name something have to be equal.
    pub fn has_exact_integers(self) -> bool {
        self != Self::Sampled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_of_fitted_number_allows_one_percent() {
        assert_eq!(Class::Fitted.allowed(100.0, 100.0, Some(20.0), false), 0.2);
        assert_eq!(Class::Sampled.allowed(100.0, 100.0, Some(20.0), false), 2.0);
        assert_eq!(Class::Direct.allowed(1.0, 1.0, Some(20.0), false), DIRECT);
    }

    #[test]
    fn small_number_beside_large_one_has_a_floor() {
        assert_eq!(Class::Direct.allowed(1e-17, 2.0, None, false), 2e-11);
    }
}
