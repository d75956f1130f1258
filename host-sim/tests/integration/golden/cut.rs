//! Answers as they are recorded: numbers with tolerances, long arrays cut.
//!
//! Of a long array stay five elements, and of each number in its elements the sum and the sum of
//! squares, of each word the sequence.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::interval::{Stated, width};
use super::table::{self, Printed};
use super::token::without_numbers;
use super::tolerance::Class;
use super::value::Node;

/// Longest array that stays whole.
const LONGEST: usize = 24;
/// Elements of a longer array that stay.
const SAMPLES: usize = 5;
/// Longest sequence of words that stays readable; a digest replaces longer ones.
const LONGEST_SEQUENCE: usize = 700;

/// A written table as it is recorded; numbers may move by one unit of their last printed digit.
pub fn cut_table(text: &str, class: Class) -> Node {
    let (table, printed) = table::read(text);
    let mut cutter = Cutter::new(&table, class, &[]);
    cutter.printed = printed;
    cutter.node(&table, Place::default())
}

/// Reads tolerances of an answer from the answer itself.
pub struct Cutter<'a> {
    class: Class,
    rounding: &'a [String],
    /// Largest magnitude by path, with all indices of arrays alike.
    largest: BTreeMap<String, f64>,
    /// How numbers of a table are printed, by path.
    printed: BTreeMap<String, Printed>,
}

/// Where a value stands.
#[derive(Clone, Copy, Default)]
struct Place<'a> {
    path: &'a str,
    stated: Stated<'a>,
    /// Width of the number's interval, from keys beside it.
    width: Option<f64>,
    is_rounding: bool,
}

/// The answer as it is recorded.
pub fn cut(answer: &Value, class: Class, rounding: &[String]) -> Node {
    Cutter::new(answer, class, rounding).node(answer, Place::default())
}

fn measure(value: &Value, path: &str, largest: &mut BTreeMap<String, f64>) {
    match value {
        Value::Object(object) => object.iter().for_each(|(k, v)| measure(v, &format!("{path}.{k}"), largest)),
        Value::Array(list) => list.iter().for_each(|v| measure(v, &format!("{path}[]"), largest)),
        Value::Number(number) => {
            let most = largest.entry(path.to_string()).or_default();
            *most = most.max(number.as_f64().map_or(0.0, f64::abs));
        }
        _ => {}
    }
}

impl<'a> Cutter<'a> {
    fn new(answer: &Value, class: Class, rounding: &'a [String]) -> Self {
        let mut largest = BTreeMap::new();
        measure(answer, "", &mut largest);
        Self { class, rounding, largest, printed: BTreeMap::new() }
    }

    fn node(&self, value: &Value, place: Place) -> Node {
        match value {
            Value::Null => Node::Null,
            Value::Bool(b) => Node::Bool(*b),
            Value::String(text) => Node::Text(text.clone()),
            Value::Number(number) => match number.as_i64() {
                Some(integer) if self.class.has_exact_integers() => Node::Integer(integer),
                _ => self.number(number.as_f64().unwrap_or(f64::NAN), place),
            },
            Value::Array(list) => {
                let path = format!("{}[]", place.path);
                let nodes = list.iter().enumerate().map(|(index, v)| {
                    let stated = place.stated.at_index(index);
                    self.node(v, Place { path: &path, stated, ..place })
                });
                let nodes: Vec<Node> = nodes.collect();
                if nodes.len() > LONGEST { summary(&nodes, self.class) } else { Node::List(nodes) }
            }
            Value::Object(object) => Node::Object(
                object.iter().map(|(k, v)| (k.clone(), self.member(object, k, v, place))).collect(),
            ),
        }
    }

    fn member(&self, object: &Map<String, Value>, key: &str, value: &Value, place: Place) -> Node {
        let place = Place {
            path: &format!("{}.{key}", place.path),
            stated: place.stated.at_key(object, key),
            width: width(object, key),
            is_rounding: place.is_rounding || self.rounding.iter().any(|name| name == key),
        };
        self.node(value, place)
    }

    fn number(&self, value: f64, place: Place) -> Node {
        if place.is_rounding {
            return Node::Rounding(value);
        }
        let largest = self.largest.get(place.path).copied().unwrap_or_default();
        let is_candidate = place.path.contains("candidates[]");
        let allowed = match is_candidate && place.stated.is_undetermined() && self.class != Class::Direct {
            true => f64::INFINITY,
            false => self.class.allowed(value, largest, place.width.or(place.stated.width()), is_candidate),
        };
        let printed = self.printed.get(place.path).copied().unwrap_or_default();
        let last_digit = printed.absolute.max(printed.relative * value.abs());
        Node::Number { value, allowed: allowed.max(last_digit * (1.0 + 1e-6)) }
    }
}

/// What stays of a long array.
fn summary(nodes: &[Node], class: Class) -> Node {
    let last = nodes.len() - 1;
    let samples = (0..SAMPLES).map(|k| k * last / (SAMPLES - 1));
    let samples = samples.map(|index| (format!("{index:04}"), nodes[index].clone())).collect();
    let mut columns = Columns { class, ..Columns::default() };
    nodes.iter().for_each(|node| columns.collect(node, ""));
    let sums = columns.sums.into_iter().map(|(path, sum)| (path, sum.node())).collect();
    let words =
        columns.words.iter().map(|(path, words)| (path.clone(), Node::Text(sequence(words)))).collect();
    let parts = [
        ("cut_array_of", Node::Integer(nodes.len() as i64)),
        ("elements", Node::Object(samples)),
        ("sums", Node::Object(sums)),
        ("words", Node::Object(words)),
    ];
    Node::Object(parts.into_iter().map(|(key, node)| (key.to_string(), node)).collect())
}

#[derive(Default)]
struct Sum {
    count: usize,
    sum: f64,
    squares: f64,
    sum_allowed: f64,
    squares_allowed: f64,
}

impl Sum {
    fn add(&mut self, value: f64, allowed: f64) {
        self.count += 1;
        if allowed.is_finite() {
            self.sum += value;
            self.squares += value * value;
            self.sum_allowed += allowed;
            self.squares_allowed += 2.0 * value.abs() * allowed + allowed * allowed;
        }
    }

    fn node(self) -> Node {
        let number = |value, allowed| Node::Number { value, allowed };
        Node::List(vec![
            Node::Integer(self.count as i64),
            number(self.sum, self.sum_allowed.max(f64::MIN_POSITIVE)),
            number(self.squares, self.squares_allowed.max(f64::MIN_POSITIVE)),
        ])
    }
}

struct Columns {
    class: Class,
    sums: BTreeMap<String, Sum>,
    words: BTreeMap<String, Vec<String>>,
}

impl Default for Columns {
    fn default() -> Self {
        Self { class: Class::Direct, sums: BTreeMap::new(), words: BTreeMap::new() }
    }
}

impl Columns {
    fn collect(&mut self, node: &Node, path: &str) {
        let mut word = |word: String| self.words.entry(path.to_string()).or_default().push(word);
        match node {
            Node::Null => word("null".into()),
            Node::Bool(b) => word(b.to_string()),
            Node::Text(text) if text.contains(' ') && self.class != Class::Direct => {
                word(without_numbers(text))
            }
            Node::Text(text) => word(text.clone()),
            Node::Integer(n) => self.sums.entry(path.to_string()).or_default().add(*n as f64, 0.0),
            Node::Number { value, allowed } => {
                self.sums.entry(path.to_string()).or_default().add(*value, *allowed);
            }
            Node::Rounding(_) => {}
            Node::List(list) => list.iter().for_each(|node| self.collect(node, &format!("{path}[]"))),
            Node::Object(object) => {
                object.iter().for_each(|(key, node)| self.collect(node, &format!("{path}.{key}")));
            }
        }
    }
}

/// `learning ×9, tracking ×116`, or a digest.
fn sequence(words: &[String]) -> String {
    let mut runs: Vec<(&str, usize)> = Vec::new();
    for word in words {
        match runs.last_mut() {
            Some((last, count)) if last == word => *count += 1,
            _ => runs.push((word, 1)),
        }
    }
    let parts: Vec<String> = runs.iter().map(|(word, count)| format!("{word} ×{count}")).collect();
    let all = parts.join(", ");
    match all.len() <= LONGEST_SEQUENCE {
        true => all,
        false => format!("{} runs of words, digest {:016x}", runs.len(), digest(&all)),
    }
}

/// FNV-1a.
pub fn digest(text: &str) -> u64 {
    text.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
