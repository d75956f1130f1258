//! When a probability entitles to a word: one policy for `compare`, `diagnose` and `improve`.
//!
//! Every explanation of a misfit (nothing but noise, each known effect at each place, an unknown cause) gets a
//! probability from its evidence (`super::evidence`) and its prior (`diagnose::rank`). Words follow from these alone:
//!
//! | word | needs |
//! |---|---|
//! | something is missing (`misses`, `missing`, `undecided`) | nothing but noise is less probable than [`SURE`] |
//! | `missing`, one effect named | no other explanation has [`RIVAL`] of its probability, and nothing more is needed beside it. A more general effect is no other explanation while its fit is better by no more than noise allows |
//! | a group that cannot be told apart | the explanations that have |
//! | `adequate` | nothing but noise is more probable than all else together, and what the model is for is determined |
//!
//! Between the last and the first lies "may be missing", which is `undecided`.

/// A claim needs this little probability that nothing is missing.
pub const SURE: f64 = 0.05;
/// A rival with less than this share of the best one's probability is ruled out.
pub const RIVAL: f64 = 0.05;

/// An explanation with less than this share of the best one's probability is not settled: nobody asks how much less it is.
pub const NEGLIGIBLE: f64 = 1e-6;

/// A probability in percent; beyond 0.1 and 99.9 % only its side is stated.
///
/// ```
/// use rotor_edge_desktop::significance::percent;
///
/// assert_eq!(percent(0.0), "less than 0.1 %");
/// assert_eq!(percent(0.0567), "5.7 %");
/// assert_eq!(percent(1.0), "more than 99.9 %");
/// ```
pub fn percent(probability: f64) -> String {
    match probability {
        p if p > 0.999 => "more than 99.9 %".into(),
        p if p < 0.001 => "less than 0.1 %".into(),
        p => format!("{:.1} %", 100.0 * p),
    }
}
