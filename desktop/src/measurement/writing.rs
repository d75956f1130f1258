//! Readings written as `measured.csv`.

use std::collections::HashMap;
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
    fn rounded<const DIGITS: usize>(line: &mut Vec<u8>, x: f64) {
        line.extend(format!("{x:.DIGITS$}").as_bytes());
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

/// Bytes that are written at once, roughly.
const BUFFER_BYTES: usize = 1 << 16;

/// Digits of a number that are written.
const DIGITS: usize = 12;
/// The smallest whole number with one digit more.
const BEYOND: u64 = 10_u64.pow(DIGITS as u32);
/// A mantissa of 53 bits times a power of five of no more than this fits into 128 bits.
const LARGEST_POWER: usize = 32;
const POWERS_OF_FIVE: [u128; LARGEST_POWER + 1] = {
    let mut all = [1; LARGEST_POWER + 1];
    let mut power = 1;
    while power <= LARGEST_POWER {
        all[power] = 5 * all[power - 1];
        power += 1;
    }
    all
};

/// The twelve digits that are nearest to a positive number, and the power of ten of the first.
fn digits_of(x: f64) -> (u64, i32) {
    nearest_digits(x).unwrap_or_else(|| {
        let written = format!("{x:.0$e}", DIGITS - 1);
        let (mantissa, exponent) = written.split_once('e').unwrap_or_default();
        (mantissa.replace('.', "").parse().unwrap_or(0), exponent.parse().unwrap_or(0))
    })
}

/// The same by whole numbers alone, which is exact; nothing of numbers that are very small or very large.
fn nearest_digits(x: f64) -> Option<(u64, i32)> {
    let exponent = (x.to_bits() >> 52) as i32;
    let mantissa = u128::from(x.to_bits() & ((1 << 52) - 1) | 1 << 52);
    // log10(2) is 0.30103: the power of ten, or the one below
    let least = ((exponent - 1023) * 30_103).div_euclid(100_000);
    for decade in [least, least + 1] {
        let power = DIGITS as i32 - 1 - decade;
        let five = usize::try_from(power).ok().and_then(|power| POWERS_OF_FIVE.get(power));
        let scaled = mantissa * five.filter(|_| exponent > 0)?;
        // the number times a power of ten is this times a power of two
        let below = 1075 - exponent - power;
        let whole = (scaled >> below) as u64;
        if whole < BEYOND {
            let (rest, half) = (scaled & ((1 << below) - 1), 1 << (below - 1));
            let rounded = whole + u64::from(rest > half || (rest == half && whole % 2 == 1));
            return Some(if rounded == BEYOND { (BEYOND / 10, decade + 1) } else { (rounded, decade) });
        }
    }
    None
}

/// Adds a number with twelve digits, as the number nearest to these would be written shortest.
fn twelve_digits(line: &mut Vec<u8>, x: f64) {
    if x == 0.0 || !x.is_finite() {
        return shortest(line, x);
    }
    let (mut number, decade) = digits_of(x.abs());
    let mut digits = [b'0'; DIGITS];
    for pair in digits.as_chunks_mut::<2>().0.iter_mut().rev() {
        let two = (number % 100) as u8;
        *pair = [b'0' + two / 10, b'0' + two % 10];
        number /= 100;
    }
    let count = digits.iter().rposition(|digit| *digit != b'0').map_or(1, |last| last + 1);
    let digits = &digits[..count];
    if x.is_sign_negative() {
        line.push(b'-');
    }
    let zeros = |line: &mut Vec<u8>, count: i32| line.resize(line.len() + count.max(0) as usize, b'0');
    match decade + 1 {
        before @ ..=0 => {
            line.extend(b"0.");
            zeros(line, -before);
            line.extend(digits);
        }
        whole if (whole as usize) < count => {
            let (whole, decimals) = digits.split_at(whole as usize);
            line.extend(whole);
            line.push(b'.');
            line.extend(decimals);
        }
        whole => {
            line.extend(digits);
            zeros(line, whole - count as i32);
        }
    }
}

/// Adds a number with as many digits as tell it from all others.
fn shortest(line: &mut Vec<u8>, x: f64) {
    let mut buffer = zmij::Buffer::new();
    let written = buffer.format(x);
    if written.bytes().all(|b| matches!(b, b'0'..=b'9' | b'.' | b'-')) {
        line.extend(written.strip_suffix(".0").unwrap_or(written).as_bytes());
    } else {
        line.extend(x.to_string().as_bytes());
    }
}

/// A name as a cell of CSV.
fn name_cell(name: Option<&str>) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // a row with nothing but an empty cell would be quoted
    writer.write_record([&*spreadsheet::cell(name.unwrap_or_default()), ""])?;
    let written = writer.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8_lossy(&written).trim_end_matches(['\n', '\r']).trim_end_matches(',').into())
}

/// How a number is added to a line.
type NumberFormat = fn(&mut Vec<u8>, f64);

/// Lines of `measured.csv`, which all have the same columns.
pub struct ReadingLines {
    columns: ReadingColumns,
    um: NumberFormat,
    volts: NumberFormat,
    /// Cells of names: runs follow one another.
    names: HashMap<Option<String>, String>,
}

/// Which columns there are.
#[derive(Debug, Clone, Copy)]
pub struct ReadingColumns {
    pub run: bool,
    pub session: bool,
    pub time: bool,
    pub gaps: bool,
    /// Of conditions of operation.
    pub conditions: usize,
}

impl ReadingColumns {
    fn of(readings: &[Reading], conditions: usize) -> Self {
        Self {
            run: readings.iter().any(|r| r.run.is_some()),
            session: readings.iter().any(|r| r.session.is_some()),
            time: readings.iter().any(|r| r.time_d.is_some()),
            gaps: readings.iter().any(|r| !r.gaps_v.is_empty()),
            conditions,
        }
    }
}

impl ReadingLines {
    /// With twelve digits of every number.
    pub fn exact(columns: ReadingColumns) -> Self {
        Self::new(columns, twelve_digits, twelve_digits)
    }

    fn new(columns: ReadingColumns, um: NumberFormat, volts: NumberFormat) -> Self {
        Self { columns, um, volts, names: HashMap::new() }
    }

    /// The line above them.
    ///
    /// # Errors
    /// If the writer fails.
    pub fn header(
        &self,
        out: &mut impl Write,
        probes: &[impl AsRef<str>],
        conditions: &[Condition],
    ) -> Result<(), csv::Error> {
        let ReadingColumns { run, session, time, gaps, .. } = self.columns;
        let mut header: Vec<String> = Vec::new();
        header.extend(run.then(|| "run".into()));
        header.extend(session.then(|| "session".into()));
        header.extend(time.then(|| "time_d".into()));
        header.push("speed_rpm".into());
        let names: Vec<_> = probes.iter().map(|name| spreadsheet::cell(name.as_ref())).collect();
        for name in &names {
            header.extend([format!("{name}_cos_um"), format!("{name}_sin_um")]);
        }
        if gaps {
            header.extend(names.iter().map(|name| format!("{name}_gap_v")));
        }
        header.extend(conditions.iter().map(|c| spreadsheet::cell(&c.column()).into_owned()));
        let mut writer = csv::Writer::from_writer(out);
        writer.write_record(&header)?;
        Ok(writer.flush()?)
    }

    /// Adds the line of a reading.
    ///
    /// # Errors
    /// If a name cannot be written.
    pub fn add(&mut self, line: &mut Vec<u8>, r: &Reading) -> Result<(), csv::Error> {
        let ReadingColumns { run, session, time, gaps, conditions } = self.columns;
        for name in [run.then_some(&r.run), session.then_some(&r.session)].into_iter().flatten() {
            if !self.names.contains_key(name) {
                self.names.insert(name.clone(), name_cell(name.as_deref())?);
            }
            line.extend(self.names[name].as_bytes());
            line.push(b',');
        }
        if time {
            r.time_d.into_iter().for_each(|day| shortest(line, day));
            line.push(b',');
        }
        if !r.speed_rpm.is_nan() {
            shortest(line, r.speed_rpm);
        }
        let mut put = |value: Option<f64>, write: NumberFormat| {
            line.push(b',');
            value.into_iter().for_each(|x| write(line, x));
        };
        for y in &r.probes {
            put(y.map(|y| y.re * 1e6), self.um);
            put(y.map(|y| -y.im * 1e6), self.um);
        }
        for p in (0..r.probes.len()).filter(|_| gaps) {
            put(r.gaps_v.get(p).copied().flatten(), self.volts);
        }
        (0..conditions).for_each(|i| put(r.conditions.get(i).copied().flatten(), self.volts));
        line.push(b'\n');
        Ok(())
    }
}

fn write_numbers(
    out: &mut impl Write,
    probes: &[impl AsRef<str>],
    conditions: &[Condition],
    readings: &[Reading],
    um: NumberFormat,
    volts: NumberFormat,
) -> Result<(), csv::Error> {
    let mut lines = ReadingLines::new(ReadingColumns::of(readings, conditions.len()), um, volts);
    lines.header(out, probes, conditions)?;
    let mut line = Vec::new();
    for reading in readings {
        lines.add(&mut line, reading)?;
        if line.len() > BUFFER_BYTES {
            out.write_all(&line)?;
            line.clear();
        }
    }
    Ok(out.write_all(&line)?)
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
                let mut line = Vec::new();
                twelve_digits(&mut line, value);
                let text = String::from_utf8(line).unwrap();
                let expected: f64 = format!("{value:.11e}").parse().unwrap();
                assert_eq!(text, expected.to_string());
            }
            x *= 1.0312;
        }
        let mut line = Vec::new();
        twelve_digits(&mut line, f64::NAN);
        assert_eq!(line, b"NaN");
    }

    #[test]
    fn digits_of_any_number_equal_those_of_the_standard_library() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 11
        };
        for n in 0..200_000_i32 {
            let x = random() as f64 * 10_f64.powi(n % 60 - 45);
            // numbers half way between two of twelve digits, and on their limits
            for x in [
                x,
                (random() % 1_000_000_000_000) as f64 + 0.5,
                10_f64.powi(n % 40 - 20),
                f64::from(n) / 64.0,
            ] {
                let written = format!("{x:.11e}");
                let (mantissa, exponent) = written.split_once('e').unwrap();
                let expected = (mantissa.replace('.', "").parse().unwrap(), exponent.parse().unwrap());
                assert!(x == 0.0 || digits_of(x) == expected, "{x:e}");
            }
        }
    }

    #[test]
    fn shortest_numbers_are_written_as_usual() {
        for x in [0.0, -0.0, 1.0, 5000.25, 1e-7, 1e21, 0.1 + 0.2, 123_456_789.0, f64::INFINITY] {
            let mut line = Vec::new();
            shortest(&mut line, x);
            assert_eq!(line, x.to_string().as_bytes());
        }
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
