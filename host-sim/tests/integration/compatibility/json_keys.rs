//! Keys of the JSON answers. The golden tests hold the recorded answers to the program; this test holds their keys to the list.

use std::path::Path;

use serde_json::Value;

use super::names::{Names, assert_all_there};
use crate::golden::manifest;

/// Names of probes and bearings in the golden answers, where they are keys.
const DATA: [&str; 2] = ["IB", "OB"];
/// Keyed by the parameters of a candidate: of a long list of candidates only some are recorded.
const OF_CANDIDATE: [&str; 3] = ["parameters", "uncertainty", "units"];

/// Adds the keys of every object in a value; a key that is a number or a name of the data counts as `*`.
pub fn collect(value: &Value, place: &str, names: &mut Names) {
    match value {
        Value::Object(object) if object.contains_key("cut_array_of") => {
            let elements = object["elements"].as_object().unwrap();
            elements.values().for_each(|element| collect(element, &format!("{place}[]"), names));
        }
        Value::Object(object) => {
            for (key, value) in object {
                let is_data = key.starts_with(|c: char| c.is_ascii_digit())
                    || DATA.iter().any(|name| key.starts_with(name));
                let key = if is_data { "*" } else { key.as_str() };
                names.entry(place.to_string()).or_default().insert(key.to_string());
                if !(place.ends_with("candidates[]") && OF_CANDIDATE.contains(&key)) {
                    collect(value, &format!("{place}.{key}"), names);
                }
            }
        }
        Value::Array(list) => list.iter().for_each(|value| collect(value, &format!("{place}[]"), names)),
        _ => {}
    }
}

fn recorded(path: &Path) -> Option<Value> {
    let mut whole: Value = serde_json::from_str(&std::fs::read_to_string(path).ok()?).unwrap();
    Some(whole["answer"].take()).filter(|answer| answer.get("no JSON").is_none())
}

#[test]
fn json_keys_of_answers_are_all_kept() {
    let mut names = Names::new();
    for command in manifest::read() {
        let path = manifest::folder().join("answers").join(&command.name).join("answer.json");
        let Some(answer) = recorded(&path) else { continue };
        collect(&answer, command.run.split(' ').next().unwrap(), &mut names);
    }
    assert_all_there("json-keys.txt", &names);
}
