//! What the lines above a table state: the machine, the probe, units, conventions, the sensitivity of the transducers.

use super::column_units::ColumnUnits;
use super::header::{Header, meaning};
use super::sensitivity;
use super::sheet::{Cell, SheetRow};
use super::target::Quantity;
use super::unit::Sensitivity;
use super::words::{Part, Word, parts};

/// Keys under which exports say which part of the vibration a table holds.
const VARIABLES: [&str; 4] = ["variable", "variable name", "measurement type", "vector"];
/// The last word of keys that state the unit of a column.
const UNITS: [&str; 3] = ["unit", "units", "einheit"];

/// A line above a table: a key and what it states, or a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub key: String,
    pub value: String,
    /// Whether the key is a cell of its own.
    is_apart: bool,
    pub text: String,
}

impl Line {
    fn of(row: &SheetRow) -> Self {
        let cells = row.cells.iter().filter_map(|cell| match cell {
            Cell::Text(text) => Some(text.replace(['#', '"'], " ")),
            Cell::Number(x) => Some(x.to_string()),
            Cell::Empty | Cell::Time(_) => None,
        });
        let cells: Vec<String> = cells.collect();
        let text = cells.join(" ");
        let first = cells.first().map_or("", String::as_str);
        let is_apart = cells.len() > 1 && !first.trim_end_matches(':').contains([':', '=']);
        let (key, value) = match () {
            () if is_apart => (first.trim_end_matches(':'), text[first.len()..].trim_start()),
            () => text.split_once([':', '=']).or_else(|| text.split_once(' ')).unwrap_or((&text, "")),
        };
        let value = value.trim().trim_start_matches(':').trim().to_string();
        Self { key: key.trim().to_string(), value, is_apart, text }
    }

    /// Whether its key is this word. A key that is a cell holds nothing else, so that a "Point unit" is no point.
    fn is(&self, key: Word) -> bool {
        let words = parts(&self.key, |_| false);
        let is_other = |part: &Part| *part != Part::Says(key) && *part != Part::Says(Word::Filler);
        words.contains(&Part::Says(key)) && !(self.is_apart && words.iter().any(is_other))
    }
}

/// The rows above a table as lines.
pub fn lines(rows: &[SheetRow]) -> Vec<Line> {
    rows.iter().map(Line::of).collect()
}

/// What the lines say behind a word such as `Channel:`.
pub fn stated(lines: &[Line], key: Word) -> Option<&str> {
    let states =
        |line: &&Line| !line.value.is_empty() && line.is(key) && sensitivity::cut(&line.text).1.is_none();
    lines.iter().find(states).map(|line| line.value.as_str())
}

/// Gives columns the units and the order that the lines state of them: `Speed Unit,rpm`, `Variable,1X`.
pub fn complete(columns: &mut [Header], lines: &[Line]) {
    let unit_of = |line: &Line| {
        let (of, last) = line.key.rsplit_once(' ')?;
        let is_unit = UNITS.contains(&last.to_lowercase().as_str()) && !line.value.is_empty();
        is_unit.then(|| (base(of), line.value.clone()))
    };
    let units: Vec<(String, String)> = lines.iter().filter_map(unit_of).collect();
    let order = lines.iter().find_map(order);
    for column in columns {
        if column.unit.is_empty()
            && let Some((_, unit)) = units.iter().find(|(of, _)| *of == base(&column.name))
        {
            column.unit.clone_from(unit);
        }
        let Some(order) = order else { continue };
        let said = meaning(&column.text(), |_| false);
        let is_bare = said.name.is_empty() && !said.synchronous && said.not_needed.is_none();
        if is_bare && !said.is_status && said.quantity.is_some_and(Quantity::is_vibration) {
            column.unit = format!("{} {order}", column.unit).trim_start().to_string();
        }
    }
}

/// Which part of the vibration a line says that the table holds.
fn order(line: &Line) -> Option<&'static str> {
    let is_variable = VARIABLES.contains(&line.key.to_lowercase().as_str());
    is_variable.then_some(())?;
    parts(&line.value, |_| false).iter().find_map(|part| match part {
        Part::Says(Word::Synchronous) => Some("1X"),
        Part::Says(Word::OtherVibration) => Some("overall"),
        _ => None,
    })
}

/// The letters of a column's name without words that every column may have.
pub fn base(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase);
    words.filter(|word| !["value", "values", "wert"].contains(&word.as_str())).collect()
}

/// Conventions that the lines state of all columns.
#[derive(Debug, Default)]
pub struct Preamble {
    pub stated: ColumnUnits,
    pub sensitivity: Option<Sensitivity>,
}

impl Preamble {
    pub fn of(lines: &[Line]) -> Self {
        let mut all = Self::default();
        let (mut lengths, mut detections, mut senses, mut angles) = (vec![], vec![], vec![], vec![]);
        for Line { text, .. } in lines {
            if let (_, Some(sensitivity)) = sensitivity::cut(text) {
                all.sensitivity = Some(sensitivity);
                continue;
            }
            let words = parts(text, |_| false);
            let has = |is: fn(&Word) -> bool| words.iter().any(|p| matches!(p, Part::Says(w) if is(w)));
            let of_amplitude = has(|w| matches!(w, Word::Amplitude | Word::Detection(_)));
            let of_length = has(|w| matches!(w, Word::Unit(_) | Word::Amplitude));
            let of_phase = has(|w| matches!(w, Word::Phase | Word::Angle(_)));
            for part in &words {
                match part {
                    Part::Says(Word::Unit(length)) if of_amplitude => lengths.push(*length),
                    Part::Says(Word::Detection(detection)) if of_length => detections.push(*detection),
                    Part::Says(Word::Sense(sense)) if of_phase => senses.push(*sense),
                    Part::Says(Word::Angle(angle)) if of_phase => angles.push(*angle),
                    _ => (),
                }
            }
        }
        all.stated = ColumnUnits {
            length: only(&lengths),
            detection: only(&detections),
            sense: only(&senses),
            angle: only(&angles),
            ..ColumnUnits::default()
        };
        all
    }
}

/// What is said once or several times the same.
fn only<T: Copy + PartialEq>(all: &[T]) -> Option<T> {
    all.first().copied().filter(|first| all.iter().all(|other| other == first))
}
