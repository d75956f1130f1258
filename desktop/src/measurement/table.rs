//! The rows and columns of `measured.csv`.

use std::io::Write;
use std::path::Path;

use super::reading::{Reading, phasor_m};
use crate::error::Error;
use crate::machine::drawing::Rotor;

/// No proximity probe measures more than this; a larger number is a wrong unit.
const LARGEST_UM: f64 = 10_000.0;
/// Supply of an eddy-current probe, with room.
pub(crate) const LOWEST_GAP_V: f64 = -30.0;
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
    time_d: Option<usize>,
    speed_rpm: usize,
    probes: Vec<[usize; 2]>,
    gaps: Vec<Option<usize>>,
}

impl Columns {
    fn find(file: &str, headers: &csv::StringRecord, rotor: &Rotor) -> Result<Self, Error> {
        let place = |name: &str| headers.iter().position(|h| h.trim() == name);
        let need = |name: &str| {
            place(name).ok_or_else(|| {
                Error::measurement(
                    file,
                    "header",
                    format!("the column {name} of rotor \"{}\" is missing", rotor.name),
                )
            })
        };
        let speed_rpm = need("speed_rpm")?;
        let mut probes = Vec::new();
        for p in &rotor.probe {
            probes.push([need(&format!("{}_cos_um", p.name))?, need(&format!("{}_sin_um", p.name))?]);
        }
        let gaps = rotor.probe.iter().map(|p| place(&format!("{}_gap_v", p.name))).collect();
        let columns = Self { run: place("run"), time_d: place("time_d"), speed_rpm, probes, gaps };
        for (i, name) in headers.iter().enumerate() {
            let gaps = columns.gaps.iter().flatten();
            let known = columns.probes.iter().flatten().chain([&columns.speed_rpm]).chain(gaps);
            if !known.chain(columns.run.iter()).chain(columns.time_d.iter()).any(|k| *k == i) {
                let what = format!("the column {name} belongs to no probe of rotor \"{}\"", rotor.name);
                return Err(Error::measurement(file, "header", what));
            }
        }
        Ok(columns)
    }
}

/// Whether runs may be in the data that the rotor's file does not list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unlisted {
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
    unlisted: Unlisted,
) -> Result<Vec<Reading>, Error> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| Error::measurement(file, "header", e.to_string()))?.clone();
    if headers.is_empty() {
        return Err(Error::measurement(
            file,
            "header",
            "the file is empty, expected a header line and readings",
        ));
    }
    let columns = Columns::find(file, &headers, rotor)?;
    let mut readings: Vec<Reading> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| ragged(file, &e))?;
        let line = record.position().map_or(0, csv::Position::line);
        let reading = row(file, line, &headers, &columns, &record)?;
        if let Some(run) = &reading.run
            && unlisted == Unlisted::Refused
            && !rotor.run.is_empty()
            && slow_roll != Some(run)
            && !rotor.run.iter().any(|r| r.name == *run)
        {
            let what =
                format!("the run \"{run}\" has no [[run]] in the rotor's file, so its weights are unknown");
            return Err(Error::measurement(file, format!("row {line}"), what));
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
        return Err(Error::measurement(file, "row 2", "there is no reading, expected at least one"));
    }
    Ok(readings)
}

fn ragged(file: &str, error: &csv::Error) -> Error {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
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
) -> Result<Reading, Error> {
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
        .filter(|speed| *speed > 0.0 && *speed <= FASTEST_RPM)
        .ok_or_else(|| Error::measurement(file, at("speed_rpm"), "expected a positive speed in rpm"))?;
    let mut probes = Vec::with_capacity(columns.probes.len());
    for [cos, sin] in &columns.probes {
        let pair = (number(*cos)?, number(*sin)?);
        let phasor = match pair {
            (Some(c), Some(s)) if c.abs() > LARGEST_UM || s.abs() > LARGEST_UM => {
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
    let time_d = match columns.time_d {
        Some(column) => Some(
            number(column)?
                .ok_or_else(|| Error::measurement(file, at("time_d"), "is empty, expected a day"))?,
        ),
        None => None,
    };
    let run = columns.run.and_then(|c| record.get(c)).map(|s| s.trim().to_string());
    Ok(Reading { run, time_d, speed_rpm, probes, gaps_v })
}

/// Writes readings in the same layout as they are read.
///
/// # Errors
/// If the writer fails.
pub fn write(out: &mut impl Write, rotor: &Rotor, readings: &[Reading]) -> Result<(), csv::Error> {
    let names: Vec<&str> = rotor.probe.iter().map(|p| p.name.as_str()).collect();
    write_probes(out, &names, readings)
}

/// The same where only the probes' names are known.
///
/// # Errors
/// If the writer fails.
pub fn write_probes(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    readings: &[Reading],
) -> Result<(), csv::Error> {
    let with_run = readings.iter().any(|r| r.run.is_some());
    let with_gaps = readings.iter().any(|r| !r.gaps_v.is_empty());
    let with_time = readings.iter().any(|r| r.time_d.is_some());
    let mut writer = csv::Writer::from_writer(out);
    let mut header: Vec<String> = Vec::new();
    header.extend(with_run.then(|| "run".into()));
    header.extend(with_time.then(|| "time_d".into()));
    header.push("speed_rpm".into());
    for name in probes.iter().map(AsRef::as_ref) {
        header.extend([format!("{name}_cos_um"), format!("{name}_sin_um")]);
    }
    if with_gaps {
        header.extend(probes.iter().map(|name| format!("{}_gap_v", name.as_ref())));
    }
    writer.write_record(&header)?;
    for r in readings {
        let mut cells: Vec<String> = Vec::new();
        cells.extend(with_run.then(|| r.run.clone().unwrap_or_default()));
        cells.extend(with_time.then(|| r.time_d.map_or(String::new(), |t| t.to_string())));
        cells.push(r.speed_rpm.to_string());
        for y in &r.probes {
            match y {
                Some(y) => cells.extend([format!("{:.5}", y.re * 1e6), format!("{:.5}", -y.im * 1e6)]),
                None => cells.extend([String::new(), String::new()]),
            }
        }
        if with_gaps {
            let gap = |p: usize| r.gaps_v.get(p).copied().flatten();
            cells.extend((0..probes.len()).map(|p| gap(p).map_or(String::new(), |v| format!("{v:.4}"))));
        }
        writer.write_record(&cells)?;
    }
    writer.flush()?;
    Ok(())
}
