//! The rows and columns of `measured.csv`.

use std::path::Path;

use super::condition::{Condition, without_unit};
use super::reading::{Reading, phasor_m};
use super::rules::{RowRules, Rows};
use crate::error::Error;
use crate::file_kind;
use crate::machine::drawing::{Rotor, UnusedProbe};
use crate::spreadsheet;

/// No proximity probe measures more than this, µm; a larger number is a wrong unit.
pub const LARGEST_UM: f64 = 10_000.0;
/// Beyond all calendars: Julian days are 2.5 million, days since the year 0 0.7 million. Seconds are beyond it.
const LAST_DAY: f64 = 1e7;
/// Supply of an eddy-current probe, with room, V.
pub const LOWEST_GAP_V: f64 = -30.0;
/// No rotor of this kind turns faster; a larger number is a wrong unit.
const FASTEST_RPM: f64 = 500_000.0;

/// Name of a file for messages, and what it holds.
pub fn text_of(path: &Path) -> Result<(String, String), Error> {
    let file = path.display().to_string();
    let text =
        std::fs::read_to_string(path).map_err(|e| Error::file(&file, format!("cannot be read ({e})")))?;
    Ok((file, text))
}

struct Columns {
    run: Option<usize>,
    session: Option<usize>,
    time_d: Option<usize>,
    speed_rpm: usize,
    probes: Vec<[usize; 2]>,
    gaps: Vec<Option<usize>>,
    conditions: Vec<(usize, Condition)>,
    unit: String,
}

/// What a file holds that names its probes itself.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeRecord {
    /// Unit of the phasors, as the columns have it: `um`, `mm_s`, `m_s2`, …
    pub unit: String,
    /// Names of the probes, in the order of the columns.
    pub probes: Vec<String>,
    /// Conditions of operation, in the order of the columns.
    pub conditions: Vec<Condition>,
    /// The rows; phasors in millionths of the unit, so in m where it is µm.
    pub readings: Vec<Reading>,
}

impl Columns {
    /// Whether a row holds neither a speed nor a reading of any probe.
    fn is_lost(&self, record: &csv::StringRecord) -> bool {
        let cells = self.probes.iter().flatten().chain([&self.speed_rpm]);
        { cells }.all(|column| record.get(*column).is_none_or(|cell| cell.trim().is_empty()))
    }

    fn find(file: &str, headers: &csv::StringRecord, rotor: &Rotor, times: &[&str]) -> Result<Self, Error> {
        let names: Vec<&str> = rotor.probe.iter().map(|p| p.name.as_str()).collect();
        let unused: Vec<&str> = rotor.unused.iter().map(UnusedProbe::name).collect();
        Self::of_probes(file, headers, &names, &unused, "um", &format!("rotor \"{}\"", rotor.name), times)
    }

    /// The columns of probes of these names, beside which those of `unused` ones may stand; `owner` is whose they are, for messages.
    fn of_probes(
        file: &str,
        headers: &csv::StringRecord,
        names: &[impl AsRef<str>],
        unused: &[&str],
        unit: &str,
        owner: &str,
        times: &[&str],
    ) -> Result<Self, Error> {
        let place = |name: &str| headers.iter().position(|h| h.trim() == name);
        let is_export = place("speed_rpm").is_none()
            || !headers.iter().any(|h| h.trim().ends_with(&format!("_cos_{unit}")));
        let need = |name: &str| {
            place(name).ok_or_else(|| {
                let advice = if is_export { IMPORT } else { "" };
                let what = format!("the column {name} of {owner} is missing{}{advice}", separator(headers));
                Error::measurement(file, "header", what)
            })
        };
        let speed_rpm = need("speed_rpm")?;
        let mut probes = Vec::new();
        for name in names.iter().map(AsRef::as_ref) {
            probes.push([need(&format!("{name}_cos_{unit}"))?, need(&format!("{name}_sin_{unit}"))?]);
        }
        let gaps = names.iter().map(|name| place(&format!("{}_gap_v", name.as_ref()))).collect();
        let time_d = times.iter().find_map(|name| place(name));
        let mut columns = Self {
            run: place("run"),
            session: place("session"),
            time_d,
            speed_rpm,
            probes,
            gaps,
            conditions: Vec::new(),
            unit: unit.into(),
        };
        let is_of_unused = |column: &str| {
            let of_probe = |name: &&str| column.trim().strip_prefix(*name);
            unused.iter().filter_map(of_probe).any(|of| {
                of == "_gap_v"
                    || [format!("_cos_{unit}"), format!("_sin_{unit}")].iter().any(|part| part == of)
            })
        };
        for (i, name) in headers.iter().enumerate().filter(|(_, name)| !is_of_unused(name)) {
            let gaps = columns.gaps.iter().flatten();
            let known = columns.probes.iter().flatten().chain([&columns.speed_rpm]).chain(gaps);
            let of_row = [columns.run, columns.session, columns.time_d];
            if known.chain(of_row.iter().flatten()).any(|k| *k == i) {
                continue;
            }
            let wrong = |what: String| Error::measurement(file, "header", what);
            let Some(condition) = Condition::of_column(name) else {
                let of_no_probe = || format!("the column {name} belongs to no probe of {owner}");
                return Err(wrong(without_unit(name).unwrap_or_else(of_no_probe)));
            };
            if columns.conditions.iter().any(|(_, other)| *other == condition) {
                return Err(wrong(format!("the column {name} is there twice, expected it once")));
            }
            columns.conditions.push((i, condition));
        }
        Ok(columns)
    }
}

/// What to do with a table of another system.
const IMPORT: &str = "; `rotor-edge import` converts exports of other systems";

/// Says that a header with one cell has another separator.
fn separator(headers: &csv::StringRecord) -> String {
    let only = headers.get(0).filter(|_| headers.len() == 1);
    let other =
        only.and_then(|cell| [(';', "`;`"), ('\t', "tabs")].into_iter().find(|(c, _)| cell.contains(*c)));
    other.map_or_else(String::new, |(_, name)| format!(" and cells are separated by {name}, expected commas"))
}

/// Names of the probes that a header has, and the one unit of all of them.
fn probes_of(file: &str, headers: &csv::StringRecord) -> Result<(Vec<String>, String), Error> {
    let (mut names, mut unit) = (Vec::new(), None::<String>);
    for column in headers.iter().map(str::trim) {
        let Some((name, of_column)) = column.rsplit_once("_cos_") else { continue };
        if let Some(unit) = unit.as_ref().filter(|unit| *unit != of_column) {
            let what = format!(
                "the column {column} is in {of_column} and the ones before it in {unit}, expected one unit; vibration of several \
                 units has no common size"
            );
            return Err(Error::measurement(file, "header", what));
        }
        names.push(name.to_string());
        unit = Some(of_column.to_string());
    }
    let unit = unit.ok_or_else(|| {
        let what = format!(
            "no column is named <probe>_cos_<unit>{}, expected <probe>_cos_um and <probe>_sin_um for each probe{IMPORT}",
            separator(headers)
        );
        Error::measurement(file, "header", what)
    })?;
    Ok((names, unit))
}

/// Whether runs may be in the data that the rotor's file does not list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnlistedRuns {
    /// No: what was added in them is needed, and not known.
    Refused,
    /// Yes: what was added in them is sought.
    Blind,
}

/// Every reading of a file; a run is known from the rotor's file, or is `slow_roll`, or may be `unlisted`.
pub fn rows(
    file: &str,
    text: &str,
    rotor: &Rotor,
    slow_roll: Option<&str>,
    unlisted: UnlistedRuns,
    rules: &RowRules,
) -> Result<Rows, Error> {
    let known = |run: &str| {
        unlisted == UnlistedRuns::Blind
            || rotor.run.is_empty()
            || slow_roll == Some(run)
            || rotor.run.iter().any(|r| r.name == run)
    };
    let known = |run: &str| match known(run) {
        true => Ok(()),
        false => {
            Err(format!("the run \"{run}\" has no [[run]] in the rotor's file, so its weights are unknown"))
        }
    };
    every_row(file, text, |headers| Columns::find(file, headers, rotor, rules.times), known, rules)
}

/// The same of a file that names its probes itself; `known` says why a run cannot be used.
pub fn series(
    file: &str,
    text: &str,
    known: impl Fn(&str) -> Result<(), String>,
) -> Result<ProbeRecord, Error> {
    let (mut unit, mut probes) = Default::default();
    let columns = |headers: &csv::StringRecord| {
        (probes, unit) = probes_of(file, headers)?;
        Columns::of_probes(file, headers, &probes, &[], &unit, "this file", RowRules::STRICT.times)
    };
    let Rows { readings, conditions, .. } = every_row(file, text, columns, known, &RowRules::STRICT)?;
    Ok(ProbeRecord { unit, probes, conditions, readings })
}

fn every_row(
    file: &str,
    text: &str,
    columns: impl FnOnce(&csv::StringRecord) -> Result<Columns, Error>,
    known: impl Fn(&str) -> Result<(), String>,
    rules: &RowRules,
) -> Result<Rows, Error> {
    if file_kind::is_toml(text) {
        let what = "this looks like a rotor file (TOML), expected measurements (CSV); give the rotor file first and the \
                    measurements after it";
        return Err(Error::measurement(file, "text", what));
    }
    let (comments, text) = after_comments(text);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| Error::measurement(file, "header", e.to_string()))?;
    let headers: csv::StringRecord = headers.iter().map(spreadsheet::name).collect();
    if headers.is_empty() {
        return Err(Error::measurement(
            file,
            "header",
            "the file is empty, expected a header line and readings",
        ));
    }
    let columns = columns(&headers)?;
    let (mut readings, mut at_rest): (Vec<Reading>, usize) = (Vec::new(), 0);
    for record in reader.records() {
        let record = record.map_err(|e| ragged(file, comments, &e))?;
        let line = comments + record.position().map_or(0, csv::Position::line);
        if columns.is_lost(&record) {
            continue;
        }
        let Some(reading) = row(file, line, &headers, &columns, &record, rules)? else {
            at_rest += 1;
            continue;
        };
        if let Some(run) = &reading.run {
            known(run).map_err(|what| Error::measurement(file, format!("row {line}"), what))?;
        }
        if let (Some(last), Some(now)) = (readings.last().and_then(|r| r.time_d), reading.time_d)
            && now < last
        {
            let what = format!("time_d goes back from {last} to {now}, expected ascending days");
            return Err(Error::measurement(file, format!("row {line}"), what));
        }
        readings.push(reading);
    }
    if readings.is_empty() {
        let what = match at_rest {
            0 => "there is no reading, expected at least one",
            _ => "every row is at 0 rpm, expected readings of a machine that turns",
        };
        return Err(Error::measurement(file, "row 2", what));
    }
    let conditions = columns.conditions.into_iter().map(|(_, condition)| condition).collect();
    Ok(Rows { readings, conditions, at_rest })
}

/// Number of comment lines before the header, and what comes after them. A `#` further down is part of a run's name.
fn after_comments(text: &str) -> (u64, &str) {
    let mut rest = text.trim_start_matches('\u{feff}');
    let mut comments = 0;
    while rest.starts_with('#') {
        rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
        comments += 1;
    }
    (comments, rest)
}

/// What is wrong with a table as a table, below so many lines of comments.
pub(crate) fn ragged(file: &str, comments: u64, error: &csv::Error) -> Error {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = comments + pos.as_ref().map_or(0, csv::Position::line);
            Error::measurement(file, format!("row {line}"), format!("{len} cells, expected {expected_len}"))
        }
        _ => Error::measurement(file, "text", error.to_string()),
    }
}

fn row(
    file: &str,
    line: u64,
    headers: &csv::StringRecord,
    columns: &Columns,
    record: &csv::StringRecord,
    rules: &RowRules,
) -> Result<Option<Reading>, Error> {
    let number = |column: usize| -> Result<Option<f64>, Error> {
        let cell = record.get(column).unwrap_or("").trim();
        if cell.is_empty() {
            return Ok(None);
        }
        let name = headers.get(column).unwrap_or("?");
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => {
                let what = format!("\"{cell}\" is not a number; leave the cell empty for a lost reading");
                Err(Error::measurement(file, format!("row {line}, column {name}"), what))
            }
        }
    };
    let at = |name: &str| format!("row {line}, column {name}");
    let speed_rpm = number(columns.speed_rpm)?
        .ok_or_else(|| Error::measurement(file, at("speed_rpm"), "expected a positive speed in rpm"))?;
    if speed_rpm == 0.0 && rules.passes_over_standstill {
        return Ok(None);
    }
    if speed_rpm == 0.0 {
        let what = "0 rpm: the machine stood still, which shows no unbalance; expected a positive speed in rpm, or no row";
        return Err(Error::measurement(file, at("speed_rpm"), what));
    }
    if !(speed_rpm > 0.0 && speed_rpm <= FASTEST_RPM) {
        return Err(Error::measurement(file, at("speed_rpm"), "expected a positive speed in rpm"));
    }
    let mut probes = Vec::with_capacity(columns.probes.len());
    for [cos, sin] in &columns.probes {
        let pair = (number(*cos)?, number(*sin)?);
        let phasor = match pair {
            (Some(c), Some(s)) if columns.unit == "um" && c.abs().max(s.abs()) > LARGEST_UM => {
                let name = headers.get(*cos).unwrap_or("?");
                let what = format!("{} µm is more than a probe can see, expected µm", c.abs().max(s.abs()));
                return Err(Error::measurement(file, at(name), what));
            }
            (Some(c), Some(s)) => Some(phasor_m(c, s)),
            _ => None,
        };
        probes.push(phasor);
    }
    let mut gaps_v = Vec::new();
    if columns.gaps.iter().any(Option::is_some) {
        for column in &columns.gaps {
            let gap_v = column.map_or(Ok(None), number)?;
            if let (Some(gap_v), Some(column)) = (gap_v.filter(|v| !(LOWEST_GAP_V..=0.0).contains(v)), column)
            {
                let what = format!("{gap_v} is no gap voltage, expected {LOWEST_GAP_V} to 0 V");
                return Err(Error::measurement(file, at(headers.get(*column).unwrap_or("?")), what));
            }
            gaps_v.push(gap_v);
        }
    }
    let wrong = |name: &str, what: String| Error::measurement(file, at(name), what);
    let conditions = conditions_of(columns, number, wrong)?;
    let name_of = |column: usize| headers.get(column).unwrap_or("time_d");
    let day = |column: usize| {
        let cell = record.get(column).unwrap_or("").trim();
        day_of(cell, number(column), rules, |what| Error::measurement(file, at(name_of(column)), what))
    };
    let time_d = columns.time_d.map(day).transpose()?;
    let name =
        |column, of| name_of_cell(record, column).map_err(|what| Error::measurement(file, at(of), what));
    let run = name(columns.run, "run")?;
    let session = name(columns.session, "session")?.filter(|session| !session.is_empty());
    let row = usize::try_from(line).ok();
    Ok(Some(Reading { row, run, session, time_d, speed_rpm, probes, gaps_v, conditions }))
}

/// The name in a cell of this column.
fn name_of_cell(record: &csv::StringRecord, column: Option<usize>) -> Result<Option<String>, &'static str> {
    let cell = column.and_then(|c| record.get(c)).map(|s| spreadsheet::name(s.trim()).to_string());
    match cell.iter().any(|name| name.contains(char::is_control)) {
        true => Err("a name must not hold control characters"),
        false => Ok(cell),
    }
}

/// The conditions of operation of a row, by the `number` of each column; `wrong` tells what is amiss with a column.
fn conditions_of(
    columns: &Columns,
    number: impl Fn(usize) -> Result<Option<f64>, Error>,
    wrong: impl Fn(&str, String) -> Error,
) -> Result<Vec<Option<f64>>, Error> {
    let value = |(column, condition): &(usize, Condition)| {
        let value = number(*column)?;
        match value.and_then(|value| condition.refusal(value)) {
            Some(why) => Err(wrong(&condition.column(), why)),
            None => Ok(value),
        }
    };
    columns.conditions.iter().map(value).collect()
}

/// The day of a cell, which is a date or holds this `number`; `wrong` tells what is amiss with its place.
fn day_of(
    cell: &str,
    number: Result<Option<f64>, Error>,
    rules: &RowRules,
    wrong: impl Fn(String) -> Error,
) -> Result<f64, Error> {
    let day = match (rules.days)(cell) {
        Some(day) => day.map_err(&wrong)?,
        None => number?.ok_or_else(|| wrong("is empty, expected a day".into()))?,
    };
    if day.abs() > LAST_DAY {
        return Err(wrong(format!(
            "{day} is no day, expected -{LAST_DAY} to {LAST_DAY}; seconds are to be divided by 86400"
        )));
    }
    Ok(day)
}
