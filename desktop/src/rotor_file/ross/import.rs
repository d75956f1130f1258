//! What every element is read by.

use serde_json::Value;

use super::element::RossElement;
use crate::error::Error;

/// What is being carried over.
pub struct Import<'a> {
    pub file: &'a str,
    /// What was, one line each.
    pub carried: Vec<String>,
    /// What could not be, one sentence each.
    pub left: Vec<String>,
}

impl Import<'_> {
    pub fn fail<T>(
        &self,
        element: &RossElement,
        name: &str,
        expected: impl Into<String>,
    ) -> Result<T, Error> {
        Err(Error::rotor(self.file, format!("[{}] {name}", element.key), expected))
    }

    pub fn number(&self, element: &RossElement, name: &str) -> Result<f64, Error> {
        match element.maybe(name) {
            Some(value) => Ok(value),
            None => self.fail(element, name, "is missing or not a number"),
        }
    }

    pub fn node(&self, element: &RossElement, name: &str) -> Result<usize, Error> {
        match element.values.get(name).and_then(Value::as_u64) {
            Some(node) => Ok(node as usize),
            None => self.fail(element, name, "is missing or not the number of a node"),
        }
    }
}
