//! What every element is read by.

use serde_json::Value;

use super::element::{RossElement, is_nothing};
use crate::error::Error;

/// Keys that are only drawn, or name the element.
const DRAWN: [&str; 3] = ["tag", "color", "scale_factor"];
/// Elements that a sentence names one by one; of more it tells the number.
const NAMED: usize = 3;

/// What is being carried over.
pub struct Import<'a> {
    pub file: &'a str,
    /// What was, one line each.
    pub carried: Vec<String>,
    /// What could not be, and where.
    left: Vec<(String, Vec<String>)>,
}

impl<'a> Import<'a> {
    pub fn new(file: &'a str) -> Self {
        Self { file, carried: Vec::new(), left: Vec::new() }
    }

    /// Notes what is not carried over at one place; places with the same sentence share it.
    pub fn leave(&mut self, place: &str, what: &str) {
        match self.left.iter_mut().find(|(said, _)| said == what) {
            Some((_, places)) => places.push(place.into()),
            None => self.left.push((what.into(), vec![place.into()])),
        }
    }

    /// Notes every value of an element that says something, beside those under `taken`.
    pub fn leave_rest(&mut self, e: &RossElement, taken: &[&str]) {
        let is_rest = |(name, value): &(&String, &Value)| {
            !DRAWN.contains(&name.as_str()) && !taken.contains(&name.as_str()) && !is_nothing(value)
        };
        let rest: Vec<&str> = e.values.iter().filter(is_rest).map(|(name, _)| name.as_str()).collect();
        if rest.is_empty() {
            return;
        }
        let verb = if rest.len() == 1 { "has" } else { "have" };
        self.leave(&e.label(), &format!("{} {verb} no counterpart", rest.join(", ")));
    }

    /// What was not carried over, a sentence each.
    pub fn left(&self) -> Vec<String> {
        let sentence = |(what, places): &(String, Vec<String>)| match places.len() {
            n if n > NAMED => format!("{} and {} more: {what}", places[..NAMED].join(", "), n - NAMED),
            _ => format!("{}: {what}", places.join(", ")),
        };
        self.left.iter().map(sentence).collect()
    }

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
