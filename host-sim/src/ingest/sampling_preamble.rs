//! What oscilloscopes, data loggers and monitoring systems state above the rows of their samples: a name and its value a line.

use super::preamble::lines;
use super::sheet::{Cell, SheetRow};
use super::unit::Unit;
use super::words::{Part, Word, parts};

/// Names of the time between two samples, s.
const INTERVALS: [&str; 6] =
    ["sample interval", "sampling interval", "delta_x", "increment", "xincrement", "x increment"];
/// Names of samples a second.
const RATES: [&str; 6] =
    ["sample rate", "sampling rate", "sampling frequency", "sample frequency", "rate_hz", "fs"];
/// Names of the number of turns.
const TURNS: [&str; 4] = ["number of revs", "number of revolutions", "revs", "revolutions"];
/// Names of the units of the vibration and of what it goes along, and of the point.
const UNITS: [&str; 4] = ["y-axis unit", "vertical units", "y unit", "amplitude unit"];
const ALONG: [&str; 3] = ["x-axis unit", "horizontal units", "x unit"];
const POINTS: [&str; 3] = ["point name", "point", "channel name"];
/// Factors before the unit of a rate.
const PREFIXES: [(&str, f64); 4] = [("k", 1e3), ("M", 1e6), ("m", 1e-3), ("G", 1e9)];

/// What is stated; nothing where it is not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SamplingPreamble {
    pub rate_hz: Option<f64>,
    /// Whole turns that the samples cover, sampled with the shaft's angle from the mark on.
    pub turns: Option<usize>,
    pub samples_a_turn: Option<usize>,
    pub speed_rpm: Option<f64>,
    pub unit: Option<Unit>,
    /// The unit of the first column, as text.
    pub along: Option<String>,
    pub point: Option<String>,
}

impl SamplingPreamble {
    /// Reads the rows above the header of the samples.
    pub fn of(rows: &[SheetRow]) -> Self {
        let mut found = Self::default();
        for line in lines(rows) {
            found.take(&line.key.to_lowercase(), &line.value);
        }
        found
    }

    fn take(&mut self, name: &str, value: &str) {
        let is = |names: &[&str]| names.contains(&name);
        if is(&INTERVALS) {
            self.rate_hz = self.rate_hz.or(quantity(value).filter(|s| *s > 0.0).map(|s| 1.0 / s));
        } else if is(&RATES) {
            self.rate_hz = self.rate_hz.or(quantity(value).filter(|hz| *hz > 0.0));
        } else if is(&TURNS) {
            let turns = value.split_whitespace().next().and_then(|number| number.parse().ok());
            self.turns = self.turns.or(turns.filter(|turns| *turns > 0));
        } else if is(&UNITS) {
            let unit = parts(value, |_| false).into_iter().find_map(|part| match part {
                Part::Says(Word::Unit(unit)) => Some(unit),
                _ => None,
            });
            self.unit = self.unit.or(unit);
        } else if is(&ALONG) {
            self.along.get_or_insert_with(|| value.to_string());
        } else if is(&POINTS) {
            self.point.get_or_insert_with(|| value.to_string());
        } else if name.ends_with("speed") && value.to_lowercase().contains("rpm") {
            self.speed_rpm = self.speed_rpm.or(quantity(value));
        }
        if let Some((samples, turns)) = synchronous(value) {
            self.samples_a_turn = Some(samples);
            self.turns = self.turns.or(turns);
        }
    }
}

/// A number with a unit behind it or none; a prefix before `s`, `Hz` or `S/s` counts.
fn quantity(text: &str) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
    // the letter of an exponent is no unit
    let number: f64 = text[..end].trim_end_matches(['e', 'E']).parse().ok()?;
    let unit = text[end..].trim();
    let is_prefixed = |prefix: &str| {
        unit.strip_prefix(prefix).is_some_and(|rest| ["s", "Hz", "S/s", "Sa/s", "HZ"].contains(&rest))
    };
    let micro = ["us", "µs", "μs"].contains(&unit).then_some(1e-6);
    let nano = (unit == "ns").then_some(1e-9);
    let factor = PREFIXES.iter().find(|(prefix, _)| is_prefixed(prefix)).map(|(_, factor)| *factor);
    Some(number * micro.or(nano).or(factor).unwrap_or(1.0))
}

/// Samples a turn and turns of a text such as `Disp Wf(256X/8revs)`.
fn synchronous(text: &str) -> Option<(usize, Option<usize>)> {
    let lower = text.to_lowercase();
    let (before, after) = lower.split_once("x/")?;
    let samples = before.rsplit(|c: char| !c.is_ascii_digit()).next()?.parse().ok()?;
    let digits = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
    let is_turns = after[digits..].trim_start().starts_with("rev");
    (is_turns && samples > 0).then(|| (samples, after[..digits].parse().ok()))
}

/// Start and increment that stand behind the names of the channels and their units, as some oscilloscopes write them: they
/// become a row of their own above the header.
pub fn move_increment(rows: &mut Vec<SheetRow>) {
    let place = |row: &SheetRow, name: &str| {
        row.cells.iter().position(|cell| cell.as_text().is_some_and(|text| text.eq_ignore_ascii_case(name)))
    };
    let found = rows
        .iter()
        .take(2)
        .enumerate()
        .find_map(|(at, row)| Some((at, place(row, "start")?, place(row, "increment")?)));
    let Some((at, start, increment)) = found.filter(|(at, ..)| at + 1 < rows.len()) else { return };
    let value = rows[at + 1].cell(increment).clone();
    for row in &mut rows[at..at + 2] {
        for column in [start, increment] {
            if let Some(cell) = row.cells.get_mut(column) {
                *cell = Cell::Empty;
            }
        }
    }
    let number = rows[at].number;
    rows.insert(at, SheetRow { number, cells: vec![Cell::text("increment"), value] });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_several_systems_are_understood() {
        let of = |lines: &[&str]| {
            let row = |line: &&str| SheetRow { number: 1, cells: line.split(',').map(Cell::text).collect() };
            SamplingPreamble::of(&lines.iter().map(row).collect::<Vec<_>>())
        };
        for (line, rate_hz) in [
            ("Sample Interval,4.00E-07,s", 2.5e6),
            ("Delta_X,0.001,0.001", 1000.0),
            ("Sampling rate: 25.6 kHz", 25_600.0),
            ("Sample Interval,50 us", 20_000.0),
        ] {
            let found = of(&[line]).rate_hz.unwrap();
            assert!((found / rate_hz - 1.0).abs() < 1e-9, "{line}: {found}");
        }
        let synchronous = of(&[
            "Point Name,31VT-4101X",
            "Number of Revs,8",
            "X-Axis Unit,ms",
            "Y-Axis Unit,µm ",
            "Sample Speed, 5000 rpm",
            "Variable,Disp Wf(256X/8revs)",
        ]);
        let known = SamplingPreamble {
            rate_hz: None,
            turns: Some(8),
            samples_a_turn: Some(256),
            speed_rpm: Some(5000.0),
            unit: Some(Unit::Micrometre),
            along: Some("ms".into()),
            point: Some("31VT-4101X".into()),
        };
        assert_eq!(synchronous, known);
    }
}
