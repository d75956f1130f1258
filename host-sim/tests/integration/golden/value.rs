//! A JSON value whose numbers know how far they may move.

use std::collections::BTreeMap;

use serde_json::{Map, Number, Value};

/// A JSON value to record or to compare.
#[derive(Debug, Clone, PartialEq)]
pub enum Node {
    Null,
    Bool(bool),
    Text(String),
    /// Compared exactly, unless a sampler counted it.
    Integer(i64),
    Number {
        value: f64,
        allowed: f64,
    },
    /// A number that is a rounding error itself.
    Rounding(f64),
    List(Vec<Node>),
    Object(BTreeMap<String, Node>),
}

/// Digits of a recorded number.
const DIGITS: usize = 12;

impl Node {
    /// The value as it is recorded.
    pub fn to_value(&self) -> Value {
        match self {
            Self::Null => Value::Null,
            Self::Bool(b) => Value::Bool(*b),
            Self::Text(text) => Value::String(text.clone()),
            Self::Integer(n) => Value::from(*n),
            Self::Number { value, .. } | Self::Rounding(value) => number(*value),
            Self::List(list) => list.iter().map(Self::to_value).collect(),
            Self::Object(object) => Value::Object(
                object.iter().map(|(key, node)| (key.clone(), node.to_value())).collect::<Map<_, _>>(),
            ),
        }
    }
}

/// Twelve significant digits.
fn number(value: f64) -> Value {
    let rounded = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    Number::from_f64(rounded).map_or(Value::Null, Value::Number)
}
