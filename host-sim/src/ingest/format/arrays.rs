//! Arrays of a file as channels, whatever wrote them.

use anyhow::{Result, bail};

use super::super::samples::{Channel, Samples, Waveform};
use super::samples::numbered;

/// What the single number is called that is the rate.
const RATES: [&str; 2] = ["rate_hz", "fs"];

/// The numbers of an array in the order of the file.
pub struct Array {
    pub all: Samples,
    pub rows: usize,
    pub width: usize,
    /// Whether the numbers of a row follow one another.
    pub is_by_rows: bool,
}

impl Array {
    /// The channels: its longer side is time.
    pub fn columns(&self) -> Vec<Samples> {
        let [samples, channels] = [self.rows.max(self.width), self.rows.min(self.width)];
        let is_channel_by_channel = self.is_by_rows == (self.rows < self.width);
        let [from, step] = if is_channel_by_channel { [samples, 1] } else { [1, channels] };
        let pick = |c: usize| match &self.all {
            Samples::Counts(all) => Samples::Counts(picked(all, c * from, step, samples)),
            Samples::Values(all) => Samples::Values(picked(all, c * from, step, samples)),
        };
        (0..channels).map(pick).collect()
    }
}

fn picked<T: Copy>(all: &[T], from: usize, step: usize, number: usize) -> Vec<T> {
    all.iter().skip(from).step_by(step).take(number).copied().collect()
}

/// One array without a name.
pub fn of_one(file: &str, array: &Array) -> Result<Waveform> {
    waveform(file, None, numbered(array.columns()))
}

/// Arrays with names; a column of one that has several is `name.1`, `name.2` and so on. A single number is no channel; one
/// called `rate_hz` or `fs` is the rate.
pub fn of_named(file: &str, arrays: &[(String, Array)]) -> Result<Waveform> {
    let (mut channels, mut rate_hz) = (Vec::new(), None);
    for (name, array) in arrays {
        let columns = array.columns();
        if let [single] = &columns[..]
            && single.len() == 1
        {
            let is_rate = RATES.contains(&name.to_lowercase().as_str());
            rate_hz = is_rate.then(|| single.extremes()[0]).or(rate_hz);
            continue;
        }
        let several = columns.len() > 1;
        for (column, samples) in columns.into_iter().enumerate() {
            let name = if several { format!("{name}.{}", column + 1) } else { name.clone() };
            channels.push(Channel { number: channels.len() + 1, name, samples });
        }
    }
    waveform(file, rate_hz, channels)
}

fn waveform(file: &str, rate_hz: Option<f64>, channels: Vec<Channel>) -> Result<Waveform> {
    let counts = channels.iter().filter(|c| matches!(c.samples, Samples::Counts(_))).count();
    if ![0, channels.len()].contains(&counts) {
        bail!("{file}: some channels hold counts (16-bit integers) and others do not, expected one kind");
    }
    Ok(Waveform { file: file.into(), rate_hz, is_of_counts: counts > 0, channels })
}
