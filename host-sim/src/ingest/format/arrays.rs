//! Arrays of a file as channels, whatever wrote them.

use std::io::Read;

use anyhow::{Context, Result, bail};

use super::super::samples::{SampleColumn, Samples, Waveform};

/// What the single number is called that is the rate, Hz, or the time between two samples, s.
const RATES: [&str; 10] = [
    "rate_hz",
    "fs",
    "fs_hz",
    "sr",
    "rate",
    "sample_rate",
    "samplerate",
    "sampling_rate",
    "sampling_frequency",
    "samplingrate",
];
const INTERVALS: [&str; 7] =
    ["dt", "ts", "tinterval", "delta_t", "sample_interval", "x_increment", "increment"];

/// Bytes that a compressed file may unpack to, at least and as a multiple of its own; samples of machines shrink to no
/// thirtieth.
const LEAST_LIMIT: u64 = 64 << 20;
const MOST_RATIO: u64 = 32;

/// How much may still be unpacked of a file.
pub struct UnpackedLimit {
    left: u64,
    all: u64,
}

impl UnpackedLimit {
    pub fn of(packed_bytes: usize) -> Self {
        let all = LEAST_LIMIT.max(MOST_RATIO * packed_bytes as u64);
        Self { left: all, all }
    }

    /// All bytes of an entry.
    ///
    /// # Errors
    /// If there are too many, or they cannot be unpacked.
    pub fn read(&mut self, place: &str, entry: impl Read) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = entry.take(self.left + 1).read_to_end(&mut bytes);
        let read = read.with_context(|| format!("{place}: cannot be unpacked"))? as u64;
        let Some(left) = self.left.checked_sub(read) else {
            bail!(
                "{place}: unpacks to more than {} MB, expected at most {MOST_RATIO} times the size of the file; save it \
                 without compression",
                self.all >> 20
            );
        };
        self.left = left;
        Ok(bytes)
    }
}

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
    pub fn columns(self) -> Vec<Samples> {
        if [self.rows, self.width].contains(&1) && self.all.len() > 0 {
            return vec![self.all];
        }
        let [samples, channels] = [self.rows.max(self.width), self.rows.min(self.width)];
        let is_channel_by_channel = self.is_by_rows == (self.rows < self.width);
        let [from, step] = if is_channel_by_channel { [samples, 1] } else { [1, channels] };
        let pick = |c: usize| match &self.all {
            Samples::Counts(all) => Samples::Counts(picked(all, c * from, step, samples)),
            Samples::Values(all) => Samples::Values(picked(all, c * from, step, samples)),
            Samples::Streamed(_) => self.all.clone(),
        };
        (0..channels).map(pick).collect()
    }
}

fn picked<T: Copy>(all: &[T], from: usize, step: usize, number: usize) -> Vec<T> {
    all.iter().skip(from).step_by(step).take(number).copied().collect()
}

/// One array without a name.
pub fn of_one(file: &str, array: Array) -> Waveform {
    Waveform::numbered(file, None, array.columns())
}

/// Arrays with names; a column of one that has several is `name.1`, `name.2` and so on. A single number is no channel; one
/// that is called as rates or intervals are is the rate.
pub fn of_named(file: &str, arrays: Vec<(String, Array)>) -> Result<Waveform> {
    let (mut all, mut rate_hz): (Vec<SampleColumn>, _) = (Vec::new(), None);
    for (name, array) in arrays {
        let columns = array.columns();
        if let [single] = &columns[..]
            && single.len() == 1
        {
            let (called, number) = (name.to_lowercase(), single.at(0));
            let stated = match () {
                () if RATES.contains(&called.as_str()) => Some(number),
                () if INTERVALS.contains(&called.as_str()) => Some(1.0 / number),
                () => None,
            };
            rate_hz = stated.or(rate_hz);
            continue;
        }
        let several = columns.len() > 1;
        for (column, samples) in columns.into_iter().enumerate() {
            let header = if several { format!("{name}.{}", column + 1) } else { name.clone() };
            all.push(SampleColumn { number: all.len() + 1, header, unit: String::new(), samples });
        }
    }
    let waveform = Waveform::of_columns(file, rate_hz, all);
    let channels = &waveform.channels;
    let counts = channels.iter().filter(|c| c.samples.is_counts()).count();
    if ![0, channels.len()].contains(&counts) {
        bail!("{file}: some channels hold counts (16-bit integers) and others do not, expected one kind");
    }
    Ok(waveform)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_of_times_is_the_rate_and_no_channel() {
        let array = |all: Samples| Array { rows: all.len(), width: 1, is_by_rows: true, all };
        let named = |name: &str, all: Samples| (name.to_string(), array(all));
        let arrays = || {
            vec![
                named("t", Samples::Values(vec![0.0, 0.5e-3, 1e-3])),
                named("PX", Samples::Counts(vec![1, 2, 3])),
                named("kph", Samples::Counts(vec![0, 9, 0])),
            ]
        };
        let waveform = of_named("a.npz", arrays()).unwrap();
        assert_eq!(waveform.names(), "PX, kph");
        assert!((waveform.rate_hz.unwrap() - 2000.0).abs() < 1e-9);
        assert_eq!(waveform.channels[0].number, 2, "numbers are places in the file");
        let stated = arrays().into_iter().chain([named("fs", Samples::Values(vec![25_600.0]))]).collect();
        assert_eq!(of_named("a.npz", stated).unwrap().rate_hz, Some(25_600.0));
    }
}
