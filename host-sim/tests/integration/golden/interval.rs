//! The 95 % interval that an answer states for a number, beside it in the same JSON.

use serde_json::{Map, Value};

/// Widths of a 95 % interval in standard deviations.
const DEVIATIONS: f64 = 3.92;
const DEGREES: f64 = 57.295_779_513;

/// An object, and the intervals and uncertainties that the objects above it hold for it.
#[derive(Clone, Copy, Default)]
pub struct Stated<'a> {
    /// Value at the same place of an `interval_95` that mirrors the object.
    pub mirror: Option<&'a Value>,
    /// Value at the same place of an `uncertainty`, which holds standard deviations.
    pub deviation: Option<&'a Value>,
}

impl<'a> Stated<'a> {
    /// What is stated for the value at a key of an object.
    pub fn at_key(self, object: &'a Map<String, Value>, key: &str) -> Self {
        let inside = |value: Option<&'a Value>| value.and_then(|v| v.get(key));
        let own = match key {
            "parameters" => object.get("uncertainty"),
            // one deviation holds for all elements of a vector
            _ => inside(self.deviation).or(self.deviation.filter(|v| v.is_number())),
        };
        let interval = object.get("interval_95").filter(|v| v.is_object());
        let mirrored = match key {
            "interval_95" => object.get(key),
            _ => interval.and_then(|i| i.get(key)),
        };
        Self { mirror: mirrored.or(inside(self.mirror)), deviation: own }
    }

    /// What is stated for an element of a list.
    pub fn at_index(self, index: usize) -> Self {
        let inside = |value: Option<&'a Value>| match value {
            Some(Value::Array(list)) => list.get(index).or(value),
            other => other,
        };
        // a pair of bounds is the interval of both of them
        let mirror = self.mirror.filter(|v| bounds(v).is_some()).or(inside(self.mirror));
        Self { mirror, deviation: inside(self.deviation) }
    }

    /// Width from the objects above.
    pub fn width(self) -> Option<f64> {
        let deviation = self.deviation.and_then(Value::as_f64).map(|sd| DEVIATIONS * sd);
        self.mirror.and_then(bounds).or(deviation)
    }

    /// Whether the answer says that the data do not determine the value.
    pub fn is_undetermined(self) -> bool {
        self.deviation.is_some_and(Value::is_null)
    }
}

/// Width of the 95 % interval of an object's number, from the keys beside it.
pub fn width(object: &Map<String, Value>, key: &str) -> Option<f64> {
    let number = |name: &str| object.get(name).and_then(Value::as_f64);
    let value = number(key)?;
    let base = key.trim_end_matches("_low").trim_end_matches("_high");
    if let (Some(low), Some(high)) = (number(&format!("{base}_low")), number(&format!("{base}_high"))) {
        return Some(high - low);
    }
    if let (Some(low), Some(high)) = (number("low"), number("high")) {
        return Some(high - low);
    }
    if let Some(half) = number("angle_95_deg").filter(|_| key == "angle_deg") {
        return Some(2.0 * half);
    }
    let is_size = ["unbalance_g_mm", "magnitude_g_mm"].contains(&key);
    if let Some(interval) = object.get("interval_95").and_then(bounds).filter(|_| is_size) {
        return Some(interval);
    }
    if let Some(relative) = number("relative_sd") {
        match key {
            "value" | "unbalance_g_mm" => return Some(DEVIATIONS * relative * value.abs()),
            "angle_deg" => return Some(DEVIATIONS * relative * DEGREES),
            _ => {}
        }
    }
    deviation(object, key).map(|sd| DEVIATIONS * sd)
}

/// `sd` beside `value`; `x_sd_unit` or `x_sd` beside `x_unit` or `x`.
fn deviation(object: &Map<String, Value>, key: &str) -> Option<f64> {
    let of = |name: &str| name.replace("_sd", "");
    let is_own = |name: &str| {
        (name == "sd" && ["value", "sd"].contains(&key)) || (name.contains("_sd") && of(name) == of(key))
    };
    object.iter().find(|(name, _)| is_own(name)).and_then(|(_, sd)| sd.as_f64())
}

fn bounds(value: &Value) -> Option<f64> {
    match value.as_array()?.as_slice() {
        [low, high] => Some(high.as_f64()? - low.as_f64()?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn own(object: &Value, key: &str) -> Option<f64> {
        width(object.as_object().unwrap(), key)
    }

    #[test]
    fn interval_is_found_beside_the_number() {
        let plane =
            json!({"unbalance_g_mm": 5.0, "angle_deg": 3.0, "interval_95": [4.0, 7.0], "angle_95_deg": 2.0});
        assert_eq!(own(&plane, "unbalance_g_mm"), Some(3.0));
        assert_eq!(own(&plane, "angle_deg"), Some(4.0));
        let column = json!({"15_deg": 1.0, "15_deg_low": 0.0, "15_deg_high": 3.0});
        assert_eq!(own(&column, "15_deg"), Some(3.0));
        assert_eq!(own(&column, "15_deg_low"), Some(3.0));
        assert_eq!(own(&json!({"angle_deg": 1.0, "angle_sd_deg": 0.5}), "angle_deg"), Some(1.96));
        assert_eq!(own(&json!({"angle_deg": 1.0, "probe": 2.0}), "angle_deg"), None);
    }

    #[test]
    fn interval_is_found_in_a_mirrored_object() {
        let estimate =
            json!({"planes": [{"angle_deg": 1.0}], "interval_95": {"planes": [{"angle_deg": [0.0, 4.0]}]}});
        let object = estimate.as_object().unwrap();
        let plane = Stated::default().at_key(object, "planes").at_index(0);
        assert_eq!(plane.at_key(object["planes"][0].as_object().unwrap(), "angle_deg").width(), Some(4.0));
    }

    #[test]
    fn uncertainty_beside_parameters_is_a_standard_deviation() {
        let step = json!({"parameters": {"u": [1.0, 2.0], "k": 1.0}, "uncertainty": {"u": 0.5, "k": null}});
        let all = Stated::default().at_key(step.as_object().unwrap(), "parameters");
        let parameters = step["parameters"].as_object().unwrap();
        assert_eq!(all.at_key(parameters, "u").at_index(1).width(), Some(1.96));
        assert!(all.at_key(parameters, "k").is_undetermined());
    }
}
