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
/// Rows beside which something may be stated.
const BESIDE: usize = 40;
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
            let key = line.key.to_lowercase();
            match bracketed(&key) {
                Some((name, unit)) => found.take(name, &format!("{} {unit}", line.value)),
                None => found.take(&key, &line.value),
            }
        }
        found
    }

    /// Takes over what is not stated here.
    pub fn add(&mut self, other: Self) {
        let Self { rate_hz, turns, samples_a_turn, speed_rpm, unit, along, point } = other;
        self.rate_hz = self.rate_hz.or(rate_hz);
        self.turns = self.turns.or(turns);
        self.samples_a_turn = self.samples_a_turn.or(samples_a_turn);
        self.speed_rpm = self.speed_rpm.or(speed_rpm);
        self.unit = self.unit.or(unit);
        self.along = self.along.take().or(along);
        self.point = self.point.take().or(point);
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

/// A key and the unit in brackets behind it.
fn bracketed(key: &str) -> Option<(&str, &str)> {
    let brackets = [('[', ']'), ('(', ')')];
    let cut = |(open, close)| key.strip_suffix::<char>(close)?.rsplit_once::<char>(open);
    brackets.into_iter().find_map(cut).map(|(name, unit)| (name.trim(), unit.trim()))
}

/// A number with a unit behind it or none; a prefix before `s`, `Hz` or `S/s` counts.
fn quantity(text: &str) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
    // the letter of an exponent is no unit
    let number: f64 = text[..end].trim_end_matches(['e', 'E']).parse().ok()?;
    let unit = text[end..].trim();
    let is_prefixed = |prefix: &str| {
        unit.strip_prefix(prefix).is_some_and(|rest| ["s", "Hz", "hz", "S/s", "Sa/s", "HZ"].contains(&rest))
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
    move_stated(rows);
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

/// The same where name and number share a cell of the header: `tInc = 1e-4`.
fn move_stated(rows: &mut Vec<SheetRow>) {
    let stated = |cell: &Cell| {
        let (name, value) = cell.as_text()?.split_once('=')?;
        let name = name.trim().to_lowercase();
        ["t0", "tinc"].contains(&name.as_str()).then(|| (name, value.trim().to_string()))
    };
    let Some(row) = rows.first_mut() else { return };
    let number = row.number;
    let mut increment = None;
    for cell in &mut row.cells {
        if let Some((name, value)) = stated(cell) {
            *cell = Cell::Empty;
            increment = increment.or((name == "tinc").then_some(value));
        }
    }
    if let Some(value) = increment {
        rows.insert(0, SheetRow { number, cells: vec![Cell::text("increment"), Cell::copied(&value)] });
    }
}

/// Rows of samples beside which the first ones state a name and its value, without any header: what is stated becomes rows
/// above a header.
pub fn move_beside(rows: &mut Vec<SheetRow>, is_value: impl Fn(&Cell) -> bool) {
    let Some(first) = rows.first() else { return };
    let is_named = |cell: &Cell| {
        let name = cell.as_text().map(str::to_lowercase).unwrap_or_default();
        INTERVALS.contains(&name.as_str()) || name == "record length"
    };
    let stands_beside = rows.iter().take(BESIDE).any(|row| is_named(row.cell(0)));
    let width = first.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let begins = (2..width).find(|at| rows.iter().all(|row| (*at..width).all(|c| is_value(row.cell(c)))));
    let Some(begins) = begins.filter(|_| stands_beside) else { return };
    let stated = rows.iter().map(|row| &row.cells[..row.cells.len().min(begins)]);
    let stated = stated.filter(|cells| cells.iter().any(|cell| !cell.is_empty())).take(BESIDE);
    let mut above: Vec<SheetRow> =
        stated.map(|cells| SheetRow { number: 0, cells: cells.to_vec() }).collect();
    let name = |at: usize| match at.checked_sub(begins) {
        None => Cell::Empty,
        Some(0) => Cell::text("TIME"),
        Some(channel) => Cell::Text(format!("CH{channel}").into()),
    };
    above.push(SheetRow { number: 0, cells: (0..width).map(name).collect() });
    rows.splice(0..0, above);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_several_systems_are_understood() {
        let of = |lines: &[&str]| {
            let row =
                |line: &&str| SheetRow { number: 1, cells: line.split(',').map(Cell::copied).collect() };
            SamplingPreamble::of(&lines.iter().map(row).collect::<Vec<_>>())
        };
        for (line, rate_hz) in [
            ("Sample Interval,4.00E-07,s", 2.5e6),
            ("Delta_X,0.001,0.001", 1000.0),
            ("Sampling rate: 25.6 kHz", 25_600.0),
            ("Sample Interval,50 us", 20_000.0),
            ("Sampling rate [Hz],12800", 12_800.0),
            ("Sampling rate (kHz),12.8", 12_800.0),
            (" fs = 12800", 12_800.0),
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
