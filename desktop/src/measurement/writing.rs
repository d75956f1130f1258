//! Readings written as `measured.csv`.

use std::fmt::Write as _;
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
    fn rounded<const DIGITS: usize>(text: &mut String, x: f64) {
        let _ = write!(text, "{x:.DIGITS$}");
    }
    write_numbers(out, probes, &[], readings, rounded::<5>, rounded::<4>)
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
    write_numbers(out, probes, conditions, readings, twelve_digits, twelve_digits)
}

/// Adds a number with twelve digits, as the number nearest to these would be written shortest.
fn twelve_digits(text: &mut String, x: f64) {
    let from = text.len();
    let _ = write!(text, "{x:.11e}");
    let written = &text[from..];
    let Some((mantissa, exponent)) = written.split_once('e') else { return };
    let Ok(exponent) = exponent.parse::<i32>() else { return };
    let mut digits = [0; 12];
    let stands = mantissa.bytes().filter(u8::is_ascii_digit);
    digits.iter_mut().zip(stands).for_each(|(place, digit)| *place = digit);
    let count = digits.iter().rposition(|digit| *digit != b'0').map_or(1, |last| last + 1);
    text.truncate(from);
    if x.is_sign_negative() {
        text.push('-');
    }
    // digits before the point
    let whole = exponent + 1;
    if whole <= 0 {
        text.push_str("0.");
        (whole..0).for_each(|_| text.push('0'));
    }
    for (place, digit) in (0..).zip(&digits[..count]) {
        if place == whole && place > 0 {
            text.push('.');
        }
        text.push(char::from(*digit));
    }
    (count as i32..whole).for_each(|_| text.push('0'));
}

fn write_numbers(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    conditions: &[Condition],
    readings: &[Reading],
    um: impl Fn(&mut String, f64),
    volts: impl Fn(&mut String, f64),
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
    let shortest = |text: &mut String, x: f64| {
        let _ = write!(text, "{x}");
    };
    // one text for all cells, as there may be millions of them
    let mut text = String::new();
    for r in readings {
        for name in [with_run.then_some(&r.run), with_session.then_some(&r.session)].into_iter().flatten() {
            writer.write_field(&*spreadsheet::cell(name.as_deref().unwrap_or_default()))?;
        }
        let mut put = |value: Option<f64>, write: &dyn Fn(&mut String, f64)| {
            text.clear();
            if let Some(x) = value {
                write(&mut text, x);
            }
            writer.write_field(&text)
        };
        if with_time {
            put(r.time_d, &shortest)?;
        }
        put(Some(r.speed_rpm).filter(|rpm| !rpm.is_nan()), &shortest)?;
        for y in &r.probes {
            put(y.map(|y| y.re * 1e6), &um)?;
            put(y.map(|y| -y.im * 1e6), &um)?;
        }
        for p in (0..probes.len()).filter(|_| with_gaps) {
            put(r.gaps_v.get(p).copied().flatten(), &volts)?;
        }
        for i in 0..conditions.len() {
            put(r.conditions.get(i).copied().flatten(), &volts)?;
        }
        writer.write_record(None::<&[u8]>)?;
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
    fn twelve_digits_equal_shortest_form_of_rounded_number() {
        let mut x = 1.234_567_890_123_456_7e-9_f64;
        for i in 0..2000 {
            let value = if i % 3 == 0 { -x } else { x };
            for value in [value, (1e3 * value).round(), 0.0, -0.0, 100.0, 0.5, 999_999_999_999.6] {
                let mut text = String::new();
                twelve_digits(&mut text, value);
                let expected: f64 = format!("{value:.11e}").parse().unwrap();
                assert_eq!(text, expected.to_string());
            }
            x *= 1.0312;
        }
        let mut text = String::new();
        twelve_digits(&mut text, f64::NAN);
        assert_eq!(text, "NaN");
    }

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
