//! Answers of the commands as JSON: one `Serialize` type a command. Terminal text and pages are made from the same values, and
//! `python/generate_answers.py` writes the Python dataclasses from these files.
//!
//! Units are in the names: `_um` µm zero to peak, `_g_mm` g·mm, `_deg` degrees with the rotation, `_rpm` revolutions a minute,
//! `_d` days, `_n_m` N/m, `_n` N. Ratios and probabilities are of one.

pub mod balance;
pub mod check;
pub mod compare;
pub mod decode;
pub mod diagnose;
pub mod dimensions;
pub mod estimate;
pub mod extract;
pub mod findings;
pub mod forecast;
pub mod identify;
pub mod imported;
pub mod monitor_result;
pub mod names;
pub mod plan;
pub mod replay;
pub mod shared;
pub mod simulate;
pub mod startup;
pub mod track;
pub mod track_conditions;
pub mod track_curves;
pub mod tracker;
pub mod watch;

use serde::{Serialize, Serializer};
use serde_json::Value;

/// The JSON object of an answer. Its keys are in alphabetical order.
///
/// # Errors
/// If a map has keys that are no text.
pub fn object(answer: &impl Serialize) -> serde_json::Result<Value> {
    serde_json::to_value(answer)
}

/// Serializes a part with its keys in alphabetical order, where the keys around it are in the order of their type.
fn alphabetical<S: Serializer>(part: &impl Serialize, serializer: S) -> Result<S::Ok, S::Error> {
    object(part).map_err(serde::ser::Error::custom)?.serialize(serializer)
}
