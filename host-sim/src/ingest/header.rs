//! What the name of a column says by itself.

use super::column_units::ColumnUnits;
use super::sensitivity;
use super::target::Quantity;
use super::unit::{Sensitivity, SpeedUnit, TimeUnit, Unit};
use super::words::{Part, Word, parts};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Meaning {
    pub quantity: Option<Quantity>,
    /// What is left of the words: the probe's name, as written.
    pub name: String,
    pub stated: ColumnUnits,
    /// Of the transducer.
    pub sensitivity: Option<Sensitivity>,
    /// Whether it says that it is the part at running speed.
    pub synchronous: bool,
    /// Whether the quantity is known from a unit alone.
    pub by_unit: bool,
    /// Whether it is a velocity or an acceleration.
    pub is_derivative: bool,
    /// Whether its cells say that the values of another column are valid.
    pub is_status: bool,
    /// Why the column is not needed, where the header says so.
    pub not_needed: Option<&'static str>,
    /// Two units that contradict each other.
    pub contradicts: bool,
}

/// The head of one column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Header {
    /// Place in the row, from 0.
    pub index: usize,
    pub name: String,
    /// What stands in the rows above, over this and the columns to its right.
    pub group: String,
    /// What stands in the rows of units below, or is stated above the table.
    pub unit: String,
}

impl Header {
    /// Whether a name, or a number from 1, is this column's.
    pub fn is(&self, from: &str) -> bool {
        let is_grouped = || from.strip_prefix(&self.group).is_some_and(|rest| rest.trim_start() == self.name);
        from == self.name || from == (self.index + 1).to_string() || (!self.group.is_empty() && is_grouped())
    }

    /// All that is said of the column.
    pub fn text(&self) -> String {
        [&self.group, &self.name, &self.unit].map(String::as_str).join(" ")
    }
}

/// The meaning of a header, together with what stands above and below it.
pub fn meaning(header: &str, is_probe: impl Fn(&str) -> bool) -> Meaning {
    let (header, sensitivity) = sensitivity::cut(header);
    let mut said = Meaning { sensitivity, ..Meaning::default() };
    let mut words = Vec::new();
    let mut names = Vec::new();
    for part in parts(&header, is_probe) {
        match part {
            Part::Says(word) => {
                let unit = said.stated.take(word);
                let is_unit = matches!(
                    word,
                    Word::Unit(_) | Word::Detection(_) | Word::Sense(_) | Word::Angle(_) | Word::SpeedUnit(_)
                );
                let is_unknown_rate = matches!(
                    (words.last(), word),
                    (Some(Word::Unit(_)), Word::TimeUnit(_) | Word::SpeedUnit(SpeedUnit::PerSecond))
                );
                said.contradicts |= (is_unit && !unit) || is_unknown_rate;
                words.push(word);
            }
            Part::Name(name) => names.push(name),
        }
    }
    said.name = names.join(" ");
    // a small t with a unit of time
    let is_time = said.stated.time.is_some() && said.name == "t";
    if is_time {
        said.name.clear();
    }
    let has = |word: Word| words.contains(&word);
    said.synchronous = has(Word::Synchronous);
    if has(Word::OtherVibration) {
        said.not_needed = Some("not the vibration at running speed");
    }
    said.is_derivative = has(Word::Derivative) || said.stated.length.is_some_and(Unit::is_derivative);
    said.is_status = has(Word::Status);
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
    // "speed" is the velocity of a vibration in some languages
    let of_word = |(word, _): &(Word, Quantity)| has(*word) && !(*word == Word::Speed && said.is_derivative);
    let by_word = said_by_word.into_iter().find(of_word).map(|(_, quantity)| quantity);
    said.by_unit = by_word.is_none();
    said.quantity = by_word.or(match said.stated {
        ColumnUnits { speed: Some(_), .. } => Some(Quantity::Speed),
        ColumnUnits { angle: Some(_), .. } | ColumnUnits { sense: Some(_), .. } => Some(Quantity::Phase),
        ColumnUnits { length: Some(_), .. } | ColumnUnits { detection: Some(_), .. } => {
            Some(Quantity::Amplitude)
        }
        ColumnUnits { time: Some(unit), .. } if unit.is_epoch() => Some(Quantity::Time),
        _ if has(Word::Derivative) || has(Word::YAxis) => Some(Quantity::Amplitude),
        _ if is_time || has(Word::XAxis) => Some(Quantity::Time),
        _ => None,
    });
    said
}

/// Whether a text is nothing but units.
pub fn is_unit(text: &str) -> bool {
    let mut stated = ColumnUnits::default();
    let parts = parts(text, |_| false);
    let unit =
        |part: &Part| matches!(part, Part::Says(word) if *word == Word::Derivative || stated.take(*word));
    !parts.is_empty() && { parts }.iter().all(unit)
}

/// What a channel of a keyphasor is usually called.
const KEYPHASORS: [&str; 7] = ["keyphasor", "kph", "kp", "tacho", "tach", "trigger", "mark"];
/// Times of samples that no word says: of MATLAB scripts, and of LabVIEW, in seconds.
const SAMPLE_TIMES: [&str; 2] = ["t", "x_value"];

/// What a column of samples is.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelRole {
    Time(Option<TimeUnit>),
    Speed,
    /// A probe, a keyphasor, or another channel; the name without the unit.
    Signal {
        name: String,
        unit: Option<Unit>,
    },
}

/// What a column of samples is by its header and by the rows of units below it.
pub fn channel_role(header: &str, unit_below: &str) -> ChannelRole {
    // a large T is a temperature
    let is_known = |known: &str| header == known || (known.len() > 1 && known.eq_ignore_ascii_case(header));
    if SAMPLE_TIMES.iter().any(|known| is_known(known)) {
        return ChannelRole::Time(meaning(unit_below, |_| false).stated.time);
    }
    let said = meaning(&format!("{header} {unit_below}"), |_| false);
    let is_bare = said.name.is_empty();
    match said.quantity {
        Some(Quantity::Time | Quantity::Clock) if is_bare => return ChannelRole::Time(said.stated.time),
        // one letter alone is a name, and a tacho shows marks unless its unit is one of speed
        Some(Quantity::Speed) if is_bare => {
            let is_name = header.chars().count() == 1 || is_keyphasor(header);
            if said.stated.speed.is_some() || !is_name {
                return ChannelRole::Speed;
            }
        }
        _ => (),
    }
    let (name, within) = without_unit(header);
    ChannelRole::Signal { name: name.into(), unit: within.or(vibration_unit(unit_below)) }
}

/// Whether a channel is called as a keyphasor usually is.
pub fn is_keyphasor(name: &str) -> bool {
    KEYPHASORS.contains(&name.to_lowercase().as_str())
}

/// A name without the unit of a vibration in brackets behind it, and that unit.
fn without_unit(header: &str) -> (&str, Option<Unit>) {
    let brackets = [('[', ']'), ('(', ')')];
    let cut = brackets.into_iter().find_map(|(open, close)| header.strip_suffix(close)?.rsplit_once(open));
    match cut.map(|(name, within)| (name.trim(), vibration_unit(within))) {
        Some((name, Some(unit))) if !name.is_empty() => (name, Some(unit)),
        _ => (header, None),
    }
}

/// The unit of a vibration that a text states and nothing else.
fn vibration_unit(text: &str) -> Option<Unit> {
    let unit = |part: &Part| if let Part::Says(Word::Unit(unit)) = part { Some(*unit) } else { None };
    parts(text, |_| false).iter().find_map(unit).filter(|_| is_unit(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channel_headers_state_time_speed_names_and_units() {
        let signal = |name: &str, unit| ChannelRole::Signal { name: name.into(), unit };
        for (header, below, expected) in [
            ("time_s", "", ChannelRole::Time(Some(TimeUnit::Seconds))),
            ("Time (s)", "", ChannelRole::Time(Some(TimeUnit::Seconds))),
            ("Time [ms]", "", ChannelRole::Time(Some(TimeUnit::Milliseconds))),
            ("Zeit", "ms", ChannelRole::Time(Some(TimeUnit::Milliseconds))),
            ("Time [µs]", "", ChannelRole::Time(Some(TimeUnit::Microseconds))),
            ("X_Value", "", ChannelRole::Time(None)),
            ("t", "", ChannelRole::Time(None)),
            ("t [ms]", "", ChannelRole::Time(Some(TimeUnit::Milliseconds))),
            ("Elapsed (min)", "", ChannelRole::Time(Some(TimeUnit::Minutes))),
            ("T", "", signal("T", None)),
            ("Drehzahl [1/min]", "", ChannelRole::Speed),
            ("Speed", "rpm", ChannelRole::Speed),
            ("tacho", "", signal("tacho", None)),
            ("N", "", signal("N", None)),
            ("15X [V]", "", signal("15X", Some(Unit::Volt))),
            ("DE horizontal (mm/s)", "", signal("DE horizontal", Some(Unit::MillimetrePerSecond))),
            ("15X", "mV", signal("15X", Some(Unit::Millivolt))),
            ("V", "", signal("V", None)),
            ("ac", "", signal("ac", None)),
        ] {
            assert_eq!(channel_role(header, below), expected, "{header}");
        }
    }
}
