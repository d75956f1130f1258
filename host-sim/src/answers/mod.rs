//! Answers of the commands as JSON: one `Serialize` type a command. Terminal text and pages are made from the same values, and
//! `python/answers.py` writes the Python dataclasses from these files.
//!
//! Units are in the names: `_um` µm zero to peak, `_g_mm` g·mm, `_deg` degrees with the rotation, `_rpm` revolutions a minute,
//! `_d` days, `_n_m` N/m, `_n` N. Ratios and probabilities are of one.

pub mod check;
pub mod shared;

use serde::Serialize;
use serde_json::Value;

/// The JSON object of an answer. Its keys are in alphabetical order.
///
/// # Errors
/// If a map has keys that are no text.
pub fn object(answer: &impl Serialize) -> serde_json::Result<Value> {
    serde_json::to_value(answer)
}
