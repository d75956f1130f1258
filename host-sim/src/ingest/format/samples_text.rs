//! CSV: a header that names the channels, then a row a sample.

use anyhow::{Context, Result, bail};
use csv::ByteRecord;

use super::super::samples::{Channel, Samples, Waveform};

/// Seconds of each row, if there is such a column.
const TIME: &str = "time_s";
const SEPARATORS: [char; 3] = [',', ';', '\t'];
/// A step of time may be this much longer or shorter than the mean, relative; a lost row is a step twice as long.
const LARGEST_JITTER: f64 = 0.5;

pub fn read(file: &str, bytes: &[u8]) -> Result<Waveform> {
    let wrong = || format!("{file}: cannot be read as CSV");
    let header = bytes.split(|b| *b == b'\n').find(|line| !line.starts_with(b"#")).unwrap_or_default();
    let count = |separator: &char| header.iter().filter(|b| **b == *separator as u8).count();
    // the first of equals
    let separator = SEPARATORS.into_iter().rev().max_by_key(count).unwrap_or(',');
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).delimiter(separator as u8).from_reader(bytes);
    let names: Vec<String> = {
        let headers = reader.headers().with_context(wrong)?;
        headers.iter().map(|name| name.trim_start_matches('\u{feff}').trim().to_string()).collect()
    };
    if let Some(number) = names.iter().find(|name| name.parse::<f64>().is_ok()) {
        bail!("{file}: the first row holds the number {number}, expected a header that names the channels");
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut row = ByteRecord::new();
    while reader.read_byte_record(&mut row).with_context(wrong)? {
        for ((cell, column), name) in row.iter().zip(&mut columns).zip(&names) {
            match number(cell, separator) {
                Some(value) => column.push(value),
                None => bail!(
                    "{file}: row {}, column {name}: \"{}\" is not a number, expected a sample in every row",
                    row.position().map_or(0, csv::Position::line),
                    String::from_utf8_lossy(cell)
                ),
            }
        }
    }
    let mut rate_hz = None;
    let mut channels = Vec::new();
    for (i, (name, values)) in names.into_iter().zip(columns).enumerate() {
        match name == TIME {
            true => rate_hz = Some(rate(file, &values)?),
            false => channels.push(Channel { number: i + 1, name, samples: Samples::Values(values) }),
        }
    }
    Ok(Waveform { file: file.into(), rate_hz, is_of_counts: false, channels })
}

/// A finite number; where no comma stands between the cells it may stand before the decimals.
fn number(cell: &[u8], separator: char) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?.trim();
    let plain = || text.parse().ok();
    let value: Option<f64> =
        if separator == ',' { plain() } else { plain().or_else(|| text.replace(',', ".").parse().ok()) };
    value.filter(|value| value.is_finite())
}

/// Samples a second of evenly spaced times.
fn rate(file: &str, times_s: &[f64]) -> Result<f64> {
    let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else { return Ok(f64::NAN) };
    let mean_s = (last - first) / (times_s.len() - 1) as f64;
    let is_even = |step: f64| ((step / mean_s) - 1.0).abs() <= LARGEST_JITTER;
    match times_s.windows(2).position(|pair| !is_even(pair[1] - pair[0])) {
        Some(i) => bail!(
            "{file}: sample {}, column {TIME}: goes from {} to {}, expected steps of {mean_s:.6e} s",
            i + 2,
            times_s[i],
            times_s[i + 1]
        ),
        None => Ok(1.0 / mean_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_decimals_and_the_rate_are_told_from_the_file() {
        let text = "# made by a logger, v2\ntime_s;15X;kph\n0;-9,5;0\n0,5e-3;-9,25;1\n0,001;-9;0\n";
        let waveform = read("a.csv", text.as_bytes()).unwrap();
        assert!((waveform.rate_hz.unwrap() - 2000.0).abs() < 1e-9);
        let Samples::Values(first) = &waveform.channels[0].samples else { panic!() };
        assert_eq!((waveform.channels[0].number, &first[..]), (2, &[-9.5, -9.25, -9.0][..]));
    }

    #[test]
    fn a_lost_row_a_cell_of_text_and_a_missing_header_are_named() {
        for (text, says) in [
            ("time_s,a\n0,1\n1,1\n2,1\n4,1\n5,1\n", "sample 4, column time_s: goes from 2 to 4"),
            ("a,b\n1,2\n1,x\n", "row 3, column b: \"x\" is not a number"),
            ("1,2\n1,2\n", "holds the number 1, expected a header"),
        ] {
            let error = read("a.csv", text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
