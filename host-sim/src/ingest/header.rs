//! What the name of a column says by itself.

use super::stated::Stated;
use super::target::Quantity;
use super::unit::TimeUnit;
use super::words::{Part, Word, parts};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Meaning {
    pub quantity: Option<Quantity>,
    /// What is left of the words: the probe's name, as written.
    pub name: String,
    pub stated: Stated,
    /// Whether it says that it is the part at running speed.
    pub synchronous: bool,
    /// Whether the quantity is known from a unit alone.
    pub by_unit: bool,
    /// Why the column is not needed, where the header says so.
    pub not_needed: Option<&'static str>,
    /// Two units that contradict each other.
    pub contradicts: bool,
}

/// The meaning of a header, together with what stands above and below it.
pub fn meaning(header: &str, is_probe: impl Fn(&str) -> bool) -> Meaning {
    let mut said = Meaning::default();
    let mut words = Vec::new();
    let mut names = Vec::new();
    for part in parts(header, is_probe) {
        match part {
            Part::Says(word) => {
                let unit = said.stated.take(word);
                let is_unit = match word {
                    Word::Unit(unit) => !unit.is_derivative(),
                    Word::Detection(_) | Word::Sense(_) | Word::Angle(_) | Word::SpeedUnit(_) => true,
                    _ => false,
                };
                said.contradicts |= is_unit && !unit;
                words.push(word);
            }
            Part::Name(name) => names.push(name),
        }
    }
    said.name = names.join(" ");
    let has = |word: Word| words.contains(&word);
    said.synchronous = has(Word::Synchronous);
    if has(Word::OtherVibration) {
        said.not_needed = Some("not the vibration at running speed");
    } else if words.iter().any(|word| is_derivative(*word)) {
        said.not_needed = Some("no displacement");
    }
    let said_by_word = [
        (Word::Gap, Quantity::Gap),
        (Word::Phase, Quantity::Phase),
        (Word::Cos, Quantity::Cos),
        (Word::Sin, Quantity::Sin),
        (Word::Real, Quantity::Real),
        (Word::Imaginary, Quantity::Imaginary),
        (Word::Amplitude, Quantity::Amplitude),
        (Word::Speed, Quantity::Speed),
        (Word::Time, Quantity::Time),
        (Word::Date, Quantity::Time),
        (Word::Clock, Quantity::Clock),
        (Word::Run, Quantity::Run),
        (Word::Machine, Quantity::Machine),
        (Word::Point, Quantity::Point),
    ];
    let by_word = said_by_word.into_iter().find(|(word, _)| has(*word)).map(|(_, quantity)| quantity);
    said.by_unit = by_word.is_none();
    said.quantity = by_word.or(match said.stated {
        Stated { speed: Some(_), .. } => Some(Quantity::Speed),
        Stated { angle: Some(_), .. } | Stated { sense: Some(_), .. } => Some(Quantity::Phase),
        Stated { length: Some(_), .. } | Stated { detection: Some(_), .. } => Some(Quantity::Amplitude),
        Stated { time: Some(TimeUnit::EpochSeconds | TimeUnit::EpochMilliseconds), .. } => {
            Some(Quantity::Time)
        }
        _ => None,
    });
    said
}

/// Whether a word is a velocity or an acceleration.
fn is_derivative(word: Word) -> bool {
    match word {
        Word::Velocity => true,
        Word::Unit(unit) => unit.is_derivative(),
        _ => false,
    }
}

/// Whether a text is nothing but units.
pub fn is_unit(text: &str) -> bool {
    let mut stated = Stated::default();
    let parts = parts(text, |_| false);
    let unit = |part: &Part| matches!(part, Part::Says(word) if is_derivative(*word) || stated.take(*word));
    !parts.is_empty() && { parts }.iter().all(unit)
}
