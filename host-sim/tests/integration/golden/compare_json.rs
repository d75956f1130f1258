//! Compares a recorded JSON value with the present one.

use std::collections::BTreeSet;

use serde_json::Value;

use super::compare_text::compare_sentence;
use super::difference::Difference;
use super::tolerance::{Class, ROUNDING_GROWTH};
use super::value::Node;

/// All differences, with JSON paths.
pub fn compare(recorded: &Value, now: &Node, class: Class) -> Vec<Difference> {
    let mut all = Vec::new();
    Comparer { class, all: &mut all }.compare(recorded, now, "$");
    all
}

struct Comparer<'a> {
    class: Class,
    all: &'a mut Vec<Difference>,
}

impl Comparer<'_> {
    fn compare(&mut self, recorded: &Value, now: &Node, path: &str) {
        match (recorded, now) {
            (Value::Object(recorded), Node::Object(now)) => {
                let keys: BTreeSet<&String> = recorded.keys().chain(now.keys()).collect();
                for key in keys {
                    let path = format!("{path}.{key}");
                    match (recorded.get(key), now.get(key)) {
                        (Some(recorded), Some(now)) => self.compare(recorded, now, &path),
                        (Some(recorded), None) => self.exact(&path, short(recorded), "missing"),
                        (None, Some(now)) => self.exact(&path, "missing", short(&now.to_value())),
                        (None, None) => {}
                    }
                }
            }
            (Value::Array(recorded), Node::List(now)) => {
                if recorded.len() != now.len() {
                    let elements = |n: usize| format!("{n} elements");
                    self.exact(path, elements(recorded.len()), elements(now.len()));
                }
                for (index, (recorded, now)) in recorded.iter().zip(now).enumerate() {
                    self.compare(recorded, now, &format!("{path}[{index}]"));
                }
            }
            (Value::Number(number), Node::Number { value, allowed }) => {
                let recorded = number.as_f64().unwrap_or(f64::NAN);
                // the recorded number has twelve digits
                let rounding = 1e-11 * recorded.abs();
                // not a number differs from everything
                if (recorded - value).abs() > allowed + rounding || value.is_nan() {
                    self.all.push(Difference::number(path, recorded, value, *allowed));
                }
            }
            (Value::Number(number), Node::Rounding(value)) => {
                let most = ROUNDING_GROWTH * number.as_f64().unwrap_or_default().abs();
                if value.abs() > most && value.abs() > f64::EPSILON {
                    self.all.push(Difference::number(path, number, value, most));
                }
            }
            (Value::String(recorded), Node::Text(now)) => {
                self.all.extend(compare_sentence(recorded, now, self.class, path));
            }
            (recorded, now) => {
                let now = now.to_value();
                if *recorded != now {
                    self.exact(path, short(recorded), short(&now));
                }
            }
        }
    }

    fn exact(&mut self, path: &str, recorded: impl ToString, now: impl ToString) {
        self.all.push(Difference::exact(path, recorded.to_string(), now.to_string()));
    }
}

/// A value on one line of a diff.
fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(200) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::cut::cut;
    use super::*;

    fn differences(class: Class, recorded: &Value, now: &Value) -> Vec<Difference> {
        let rounding = ["excess".to_string()];
        compare(&cut(recorded, class, &rounding).to_value(), &cut(now, class, &rounding), class)
    }

    fn places(class: Class, recorded: &Value, now: &Value) -> Vec<String> {
        differences(class, recorded, now).into_iter().map(|d| d.place).collect()
    }

    #[test]
    fn direct_number_within_tolerance_passes() {
        let recorded = json!({"k": [1.0, 1e-16], "n": 3});
        assert!(
            differences(Class::Direct, &recorded, &json!({"k": [1.0 + 9e-10, -3e-16], "n": 3})).is_empty()
        );
        let found = differences(Class::Direct, &recorded, &json!({"k": [1.0 + 1e-7, 1e-16], "n": 4}));
        assert_eq!(found.iter().map(|d| d.place.as_str()).collect::<Vec<_>>(), ["$.k[0]", "$.n"]);
        assert!(found[0].to_string().contains("allowed   ±1.000e-9"), "{}", found[0]);
    }

    #[test]
    fn fitted_number_is_held_to_its_interval() {
        let plane = |size: f64| json!({"planes": [{"unbalance_g_mm": size, "interval_95": [90.0, 110.0]}]});
        assert!(places(Class::Fitted, &plane(100.0), &plane(100.15)).is_empty());
        assert_eq!(places(Class::Fitted, &plane(100.0), &plane(100.3)), ["$.planes[0].unbalance_g_mm"]);
        assert!(places(Class::Sampled, &plane(100.0), &plane(101.9)).is_empty());
        assert_eq!(places(Class::Direct, &plane(100.0), &plane(100.15)), ["$.planes[0].unbalance_g_mm"]);
    }

    #[test]
    fn wider_interval_does_not_excuse_itself() {
        let plane = |high: f64| json!({"unbalance_g_mm": 100.0, "interval_95": [90.0, high]});
        assert_eq!(places(Class::Fitted, &plane(110.0), &plane(150.0)), ["$.interval_95[1]"]);
    }

    #[test]
    fn changed_word_rank_or_key_is_found() {
        let recorded = json!({"verdict": "missing", "ranks": ["seal", "bow"], "none": null});
        let now = json!({"verdict": "adequate", "ranks": ["bow", "seal"], "flag": true});
        let expected = ["$.flag", "$.none", "$.ranks[0]", "$.ranks[1]", "$.verdict"];
        assert_eq!(places(Class::Sampled, &recorded, &now), expected);
    }

    #[test]
    fn sentence_may_differ_by_one_last_digit() {
        let sentence = |percent: f64| json!(format!("gyroscopic is missing, {percent:.1} % sure."));
        assert!(places(Class::Fitted, &sentence(93.3), &sentence(93.4)).is_empty());
        assert_eq!(places(Class::Fitted, &sentence(93.3), &sentence(94.3)), ["$"]);
        assert_eq!(places(Class::Fitted, &json!("seal is missing"), &json!("bow is missing")), ["$"]);
    }

    #[test]
    fn long_array_is_cut_and_a_change_inside_is_found() {
        let rows = |changed: f64, state: &str| {
            let row = |k: usize| match k {
                77 => json!({"x": changed, "state": state}),
                _ => json!({"x": k as f64 + 0.5, "state": "tracking"}),
            };
            Value::Array((0..200).map(row).collect())
        };
        let recorded = rows(77.5, "tracking");
        assert!(places(Class::Direct, &recorded, &rows(77.5, "tracking")).is_empty());
        assert_eq!(
            places(Class::Direct, &recorded, &rows(77.6, "tracking")),
            ["$.sums..x[1]", "$.sums..x[2]"]
        );
        assert_eq!(places(Class::Direct, &recorded, &rows(77.5, "flagged")), ["$.words..state"]);
    }

    #[test]
    fn rounding_error_may_shrink_but_not_grow() {
        let value = |x: f64| json!({"excess": x});
        assert!(places(Class::Direct, &value(1e-7), &value(2e-9)).is_empty());
        assert_eq!(places(Class::Direct, &value(1e-7), &value(2e-6)), ["$.excess"]);
    }

    #[test]
    fn undetermined_parameter_of_candidate_is_free() {
        let candidate = |k: f64, bic: f64| json!({"candidates": [{"parameters": {"k": k}, "uncertainty": {"k": null}, "delta_bic": bic}]});
        assert!(places(Class::Fitted, &candidate(1.0, 5.0), &candidate(7.0, 5.001)).is_empty());
        assert_eq!(
            places(Class::Fitted, &candidate(1.0, 5.0), &candidate(1.0, 5.1)),
            ["$.candidates[0].delta_bic"]
        );
    }
}
