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

    /// Its place in the file, for messages.
    pub fn label(&self) -> String {
        format!("[{}]", self.key)
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

    /// The masses along x and along y; `m` where it has one for all.
    pub fn mass_along(&self, names: [&str; 2]) -> [f64; 2] {
        names.map(|name| self.maybe(name).or(self.maybe("m")).unwrap_or(0.0))
    }

    /// Whether it holds the shaft: a bearing or a seal of any class.
    pub fn is_bearing(&self) -> bool {
        self.values.contains_key("kxx") && self.values.contains_key("n")
    }

    /// Whether it is a disk, or a wheel that turns with the shaft as one.
    pub fn is_disk(&self) -> bool {
        self.class.ends_with("DiskElement") || self.class.starts_with("GearElement")
    }

    /// Whether it is a piece of the shaft.
    pub fn is_line(&self) -> bool {
        matches!(self.class, "ShaftElement" | "CouplingElement")
    }

    /// Whether the import supports the element's class.
    pub fn is_known(&self) -> bool {
        self.is_line() || self.is_disk() || self.is_bearing() || self.class == "PointMass"
    }
}

/// Whether a value says that there is nothing.
pub fn is_nothing(value: &Value) -> bool {
    match value {
        Value::Null | Value::Bool(false) => true,
        Value::Number(number) => number.as_f64() == Some(0.0),
        Value::String(text) => text.is_empty(),
        Value::Array(all) => all.iter().all(is_nothing),
        Value::Object(all) => all.values().all(is_nothing),
        Value::Bool(true) => false,
    }
}
