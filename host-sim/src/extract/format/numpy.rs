//! NumPy: `.npy` with an array, `.npz` with several that are named.

use std::io::{Cursor, Read};

use anyhow::{Context, Result, bail};
use npyz::{DType, NpyFile, Order, TypeChar};
use zip::ZipArchive;

use super::super::waveform::{Channel, Samples, Waveform};
use super::numbered;

/// One array: samples of a channel, or channels beside one another.
pub fn read_array(file: &str, bytes: &[u8]) -> Result<Waveform> {
    waveform(file, None, numbered(columns(file, bytes)?))
}

/// Arrays with names; a column of one that has several is `name.1`, `name.2` and so on. A single number `rate_hz` is the
/// rate.
pub fn read_archive(file: &str, bytes: &[u8]) -> Result<Waveform> {
    let wrong = || format!("{file}: cannot be read as a NumPy archive");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).with_context(wrong)?;
    let (mut channels, mut rate_hz) = (Vec::new(), None);
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).with_context(wrong)?;
        let Some(name) = entry.name().with_context(wrong)?.strip_suffix(".npy").map(str::to_string) else {
            continue;
        };
        let mut array = Vec::new();
        entry.read_to_end(&mut array).with_context(wrong)?;
        let columns = columns(&format!("{file}: array {name}"), &array)?;
        if let ("rate_hz", [Samples::Values(values)]) = (name.as_str(), &columns[..])
            && let [rate] = values[..]
        {
            rate_hz = Some(rate);
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
        bail!("{file}: some channels hold counts (i2) and others do not, expected one kind");
    }
    Ok(Waveform { file: file.into(), rate_hz, is_of_counts: counts > 0, channels })
}

/// The channels of an array: its longer side is time.
fn columns(place: &str, bytes: &[u8]) -> Result<Vec<Samples>> {
    let wrong = || format!("{place}: cannot be read as a NumPy array");
    let array = NpyFile::new(bytes).with_context(wrong)?;
    let shape: Vec<usize> = array.shape().iter().map(|side| *side as usize).collect();
    let is_by_rows = array.order() == Order::C;
    let [rows, width] = match shape[..] {
        [] => [1, 1],
        [samples] => [samples, 1],
        [rows, width] => [rows, width],
        _ => bail!("{place}: has {} dimensions, expected one or two", shape.len()),
    };
    let DType::Plain(kind) = array.dtype() else {
        bail!("{place}: holds records, expected numbers");
    };
    // NumPy's letter and bytes a number, such as f8
    let all = match (kind.type_char(), kind.size_field()) {
        (TypeChar::Int, 2) => Samples::Counts(array.into_vec().with_context(wrong)?),
        (TypeChar::Int, 4) => values(array.into_vec::<i32>().with_context(wrong)?),
        (TypeChar::Float, 4) => values(array.into_vec::<f32>().with_context(wrong)?),
        (TypeChar::Float, 8) => Samples::Values(array.into_vec().with_context(wrong)?),
        _ => bail!("{place}: holds {kind}, expected i2, i4, f4 or f8"),
    };
    let [samples, channels] = [rows.max(width), rows.min(width)];
    // whether numbers of one channel follow one another in the file
    let is_channel_by_channel = is_by_rows == (rows < width);
    let pick = |c: usize| -> Samples {
        let strides = if is_channel_by_channel { [samples, 1] } else { [1, channels] };
        match &all {
            Samples::Counts(all) => Samples::Counts(picked(all, c * strides[0], strides[1], samples)),
            Samples::Values(all) => Samples::Values(picked(all, c * strides[0], strides[1], samples)),
        }
    };
    Ok((0..channels).map(pick).collect())
}

fn values<T: Into<f64>>(all: Vec<T>) -> Samples {
    Samples::Values(all.into_iter().map(Into::into).collect())
}

fn picked<T: Copy>(all: &[T], from: usize, step: usize, number: usize) -> Vec<T> {
    all.iter().skip(from).step_by(step).take(number).copied().collect()
}

#[cfg(test)]
mod tests {
    use npyz::WriterBuilder as _;

    use super::*;

    fn written(shape: &[u64], order: Order, values: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let options = npyz::WriteOptions::new().default_dtype().shape(shape).order(order);
        let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
        writer.extend(values.iter().copied()).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn channels_are_the_shorter_side_of_an_array_in_either_order() {
        let by_channel: &[f64] = &[1.0, 2.0, 3.0, -1.0, -2.0, -3.0];
        let by_sample: &[f64] = &[1.0, -1.0, 2.0, -2.0, 3.0, -3.0];
        for (shape, order, values) in [
            ([2, 3], Order::C, by_channel),
            ([3, 2], Order::C, by_sample),
            ([2, 3], Order::Fortran, by_sample),
            ([3, 2], Order::Fortran, by_channel),
        ] {
            let columns = columns("a.npy", &written(&shape, order, values)).unwrap();
            let [Samples::Values(a), Samples::Values(b)] = &columns[..] else { panic!("{columns:?}") };
            assert_eq!((&a[..], &b[..]), (&by_channel[..3], &by_channel[3..]));
        }
    }
}
