//! Readings written as `measured.csv`.

use std::io::Write;

use super::condition::Condition;
use super::reading::Reading;
use crate::machine::drawing::Rotor;
use crate::spreadsheet;

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
    write_numbers(out, probes, &[], readings, |um| format!("{um:.5}"), |v| format!("{v:.4}"))
}

/// The same with twelve digits of every number.
///
/// # Errors
/// If the writer fails.
pub fn write_exactly(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    readings: &[Reading],
) -> Result<(), csv::Error> {
    write_with_conditions(out, probes, &[], readings)
}

/// The same with conditions of operation, of which the readings hold values in this order.
///
/// # Errors
/// If the writer fails.
pub fn write_with_conditions(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    conditions: &[Condition],
    readings: &[Reading],
) -> Result<(), csv::Error> {
    // through its decimal digits a number loses the binary ones behind them
    let twelve = |x: f64| format!("{x:.11e}").parse().unwrap_or(x).to_string();
    write_numbers(out, probes, conditions, readings, twelve, twelve)
}

fn write_numbers(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    conditions: &[Condition],
    readings: &[Reading],
    um: impl Fn(f64) -> String,
    volts: impl Fn(f64) -> String,
) -> Result<(), csv::Error> {
    let with_run = readings.iter().any(|r| r.run.is_some());
    let with_session = readings.iter().any(|r| r.session.is_some());
    let with_gaps = readings.iter().any(|r| !r.gaps_v.is_empty());
    let with_time = readings.iter().any(|r| r.time_d.is_some());
    let mut writer = csv::Writer::from_writer(out);
    let mut header: Vec<String> = Vec::new();
    header.extend(with_run.then(|| "run".into()));
    header.extend(with_session.then(|| "session".into()));
    header.extend(with_time.then(|| "time_d".into()));
    header.push("speed_rpm".into());
    let names: Vec<_> = probes.iter().map(|name| spreadsheet::cell(name.as_ref())).collect();
    for name in &names {
        header.extend([format!("{name}_cos_um"), format!("{name}_sin_um")]);
    }
    if with_gaps {
        header.extend(names.iter().map(|name| format!("{name}_gap_v")));
    }
    header.extend(conditions.iter().map(|c| spreadsheet::cell(&c.column()).into_owned()));
    writer.write_record(&header)?;
    for r in readings {
        let mut cells: Vec<String> = Vec::new();
        let name =
            |name: &Option<String>| spreadsheet::cell(name.as_deref().unwrap_or_default()).into_owned();
        cells.extend(with_run.then(|| name(&r.run)));
        cells.extend(with_session.then(|| name(&r.session)));
        cells.extend(with_time.then(|| r.time_d.map_or(String::new(), |t| t.to_string())));
        cells.push(r.speed_rpm.to_string());
        for y in &r.probes {
            match y {
                Some(y) => cells.extend([um(y.re * 1e6), um(-y.im * 1e6)]),
                None => cells.extend([String::new(), String::new()]),
            }
        }
        if with_gaps {
            let gap = |p: usize| r.gaps_v.get(p).copied().flatten();
            cells.extend((0..probes.len()).map(|p| gap(p).map_or(String::new(), &volts)));
        }
        let value = |i: usize| r.conditions.get(i).copied().flatten();
        cells.extend((0..conditions.len()).map(|i| value(i).map_or(String::new(), &volts)));
        writer.write_record(&cells)?;
    }
    writer.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::parse;
    use crate::testing::sample_rotor;

    #[test]
    fn sessions_are_read_back_as_written_and_empty_cells_are_none() {
        let rotor = sample_rotor();
        let probes = vec![Some(nalgebra::Complex::new(1e-5, -2e-5)); rotor.probe.len()];
        let reading = |session: Option<&str>| Reading {
            run: Some("a".into()),
            session: session.map(String::from),
            speed_rpm: 3000.0,
            probes: probes.clone(),
            ..Reading::default()
        };
        let readings = [reading(Some("day 1, morning")), reading(None)];
        let mut text = Vec::new();
        write(&mut text, &rotor, &readings).unwrap();
        let read = parse("text", std::str::from_utf8(&text).unwrap(), &rotor).unwrap();
        let sessions: Vec<_> = read.iter().map(|r| r.session.as_deref()).collect();
        assert_eq!(sessions, [Some("day 1, morning"), None]);
    }
}
