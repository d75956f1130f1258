//! One element of a file of ROSS: its class, its tag, its values.

use serde_json::{Map, Value};

/// One element of the file.
pub struct RossElement<'a> {
    /// Its name in the file: class and tag.
    pub key: &'a str,
    pub class: &'a str,
    pub values: &'a Map<String, Value>,
}

impl RossElement<'_> {
    /// Its name, as people gave it.
    pub fn tag(&self) -> &str {
        self.values.get("tag").and_then(Value::as_str).unwrap_or(self.key)
    }

    /// A number that may be absent.
    pub fn maybe(&self, name: &str) -> Option<f64> {
        self.values.get(name).and_then(Value::as_f64)
    }

    /// A switch, on where the file says nothing.
    pub fn flag(&self, name: &str) -> bool {
        self.values.get(name).and_then(Value::as_bool).unwrap_or(true)
    }

    /// A coefficient over speed: a list, or one number.
    pub fn list(&self, name: &str) -> Option<Vec<f64>> {
        match self.values.get(name)? {
            Value::Array(all) => all.iter().map(Value::as_f64).collect(),
            value => value.as_f64().map(|v| vec![v]),
        }
    }

    /// Whether it holds the shaft: a bearing or a seal of any class.
    pub fn is_bearing(&self) -> bool {
        self.values.contains_key("kxx") && self.values.contains_key("n")
    }
}
