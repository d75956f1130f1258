//! NumPy: `.npy` with an array, `.npz` with several that are named.

use std::io::Cursor;
use std::ops::Range;

use anyhow::{Context, Result, bail};
use npyz::{DType, NpyFile, Order, TypeChar};
use zip::ZipArchive;

use super::super::samples::Samples;
use super::Content;
use super::arrays::{Array, UnpackedLimit, of_named, of_one};

/// Where an entry of a zip archive has the length of its name.
const ENTRY_NAME_LENGTH: Range<usize> = 26..28;
const ENTRY_NAME: usize = 30;

/// Magic number and version, before the length of the header.
const BEFORE_LENGTH: usize = 8;
/// Brackets within brackets in a header of numbers are two at most.
const DEEPEST: usize = 8;

/// Whether a file is an array.
pub fn is_array(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

/// Whether a file is an archive whose first entry is an array.
pub fn is_archive(bytes: &[u8]) -> bool {
    let name = || {
        let length = u16::from_le_bytes(bytes.get(ENTRY_NAME_LENGTH)?.try_into().ok()?);
        bytes.get(ENTRY_NAME..ENTRY_NAME + usize::from(length))
    };
    bytes.starts_with(b"PK\x03\x04") && name().is_some_and(|name| name.ends_with(b".npy"))
}

/// One array: samples of a channel, or channels beside one another.
pub fn read_array(file: &str, bytes: &[u8]) -> Result<Content> {
    match array(file, bytes)? {
        Some(array) => Ok(Content::Waveform(of_one(file, array))),
        None => bail!("{file}: holds texts, expected numbers"),
    }
}

/// Several named arrays, one `.npy` file each.
pub fn read_archive(file: &str, bytes: &[u8]) -> Result<Content> {
    let wrong = || format!("{file}: cannot be read as a NumPy archive, expected a whole .npz");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).with_context(wrong)?;
    let mut arrays = Vec::new();
    let mut limit = UnpackedLimit::of(bytes.len());
    for i in 0..archive.len() {
        let entry = archive.by_index(i).with_context(wrong)?;
        let Some(name) = entry.name().with_context(wrong)?.strip_suffix(".npy").map(str::to_string) else {
            continue;
        };
        let place = format!("{file}: array {name}");
        let bytes = limit.read(&place, entry)?;
        // texts, such as the names of channels, are no samples
        if let Some(numbers) = array(&place, &bytes)? {
            arrays.push((name, numbers));
        }
    }
    Ok(Content::Waveform(of_named(file, arrays)?))
}

/// An array of numbers; nothing where it holds texts.
fn array(place: &str, bytes: &[u8]) -> Result<Option<Array>> {
    let wrong = || format!("{place}: cannot be read as a NumPy array");
    // the crate multiplies the sides without a look at what overflows, and takes a length as it is stated
    match stated_numbers(bytes) {
        None => bail!("{}: its header states no shape, expected one as NumPy writes it", wrong()),
        Some(numbers) if numbers > bytes.len() as u128 => {
            bail!("{}: its shape says more numbers than there are bytes", wrong())
        }
        Some(_) => {}
    }
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
        (TypeChar::Bool, _) => {
            values(array.into_vec::<bool>().with_context(wrong)?.into_iter().map(u8::from).collect())
        }
        (TypeChar::Int, 1) => values(array.into_vec::<i8>().with_context(wrong)?),
        (TypeChar::Uint, 1) => values(array.into_vec::<u8>().with_context(wrong)?),
        (TypeChar::Uint, 2) => values(array.into_vec::<u16>().with_context(wrong)?),
        (TypeChar::Uint, 4) => values(array.into_vec::<u32>().with_context(wrong)?),
        (TypeChar::UnicodeStr | TypeChar::ByteStr, _) => return Ok(None),
        (TypeChar::Int, 4) => values(array.into_vec::<i32>().with_context(wrong)?),
        (TypeChar::Int, 8) => {
            // a sample rate, or samples on a machine of 64 bits
            Samples::Values(
                array.into_vec::<i64>().with_context(wrong)?.into_iter().map(|n| n as f64).collect(),
            )
        }
        (TypeChar::Float, 4) => values(array.into_vec::<f32>().with_context(wrong)?),
        (TypeChar::Float, 8) => Samples::Values(array.into_vec().with_context(wrong)?),
        _ => bail!("{place}: holds {kind}, expected b1, u1 to u4, i1 to i8, f4 or f8"),
    };
    Ok(Some(Array { all, rows, width, is_by_rows }))
}

/// Numbers in an array by the shape in its header; nothing where the header cannot be read.
fn stated_numbers(bytes: &[u8]) -> Option<u128> {
    // one byte of the version says how many hold the length
    let length_bytes = if bytes.get(6)? == &1 { 2 } else { 4 };
    let from = BEFORE_LENGTH + length_bytes;
    let length = bytes.get(BEFORE_LENGTH..from)?.iter().rev().fold(0, |n: usize, b| n << 8 | usize::from(*b));
    let text = String::from_utf8_lossy(bytes.get(from..from.checked_add(length)?)?);
    let mut depth = 0_usize;
    for character in text.chars() {
        match character {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST {
            return None;
        }
    }
    let behind = ["'shape'", "\"shape\""].iter().find_map(|key| Some(text.split_once(key)?.1))?;
    let (sides, _) = behind.split_once('(')?.1.split_once(')')?;
    let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
    sides
        .map(|side| side.trim_end_matches('L').parse::<u128>().ok())
        .try_fold(1_u128, |product, side| Some(product.saturating_mul(side?)))
}

fn values<T: Into<f64>>(all: Vec<T>) -> Samples {
    Samples::Values(all.into_iter().map(Into::into).collect())
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
    fn a_shape_beyond_the_file_is_refused() {
        let mut bytes = written(&[11], Order::C, &[0.0; 11]);
        let at = bytes.windows(4).position(|w| w == b"(11,").unwrap();
        let beyond = format!("({},)", u64::MAX);
        let behind = bytes[at + 5..].iter().position(|b| *b == b'}').unwrap();
        let tail: Vec<u8> = bytes[at + 5..at + 6 + behind].to_vec();
        // the padding of the header takes the digits
        bytes[at..at + beyond.len()].copy_from_slice(beyond.as_bytes());
        bytes[at + beyond.len()..at + beyond.len() + tail.len()].copy_from_slice(&tail);
        let error = array("a.npy", &bytes).err().unwrap().to_string();
        assert!(error.contains("more numbers than there are bytes"), "{error}");
    }

    #[test]
    fn headers_that_lie_are_refused_before_memory_is_taken() {
        let sound = written(&[11], Order::C, &[0.0; 11]);
        let mut long = sound.clone();
        long[6] = 2;
        long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        let mut without = sound.clone();
        let at = without.windows(7).position(|w| w == b"'shape'").unwrap();
        without[at + 1] = b'S';
        let mut deep = sound;
        let end = deep.iter().position(|b| *b == b'}').unwrap();
        deep[end - 12..end].fill(b'(');
        for bytes in [long, without, deep] {
            let error = array("a.npy", &bytes).err().unwrap().to_string();
            assert!(error.contains("a.npy: cannot be read as a NumPy array"), "{error}");
        }
    }

    #[test]
    fn archive_that_unpacks_to_far_more_is_refused() {
        let bytes = written(&[12_000_000], Order::C, &vec![0.0; 12_000_000]);
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        archive.start_file("PX.npy", zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut archive, &bytes).unwrap();
        let packed = archive.finish().unwrap().into_inner();
        assert!(packed.len() < 1_000_000);
        let error = read_archive("a.npz", &packed).err().unwrap().to_string();
        assert!(error.contains("a.npz: array PX: unpacks to more than 64 MB"), "{error}");
    }

    #[test]
    fn marks_of_true_and_false_are_samples_and_texts_are_left() {
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let mut add = |name: &str, kind: &str, bytes: &[u8]| {
            archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
            let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (4,), }}\n");
            let length = u16::try_from(header.len()).unwrap().to_le_bytes();
            let all = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), bytes].concat();
            std::io::Write::write_all(&mut archive, &all).unwrap();
        };
        add("kph", "|b1", &[0, 1, 0, 1]);
        add("level", "|u1", &[7, 200, 7, 200]);
        add("label", "<U1", &[0; 16]);
        let packed = archive.finish().unwrap().into_inner();
        let Content::Waveform(read) = read_archive("a.npz", &packed).unwrap() else { panic!("a waveform") };
        assert_eq!(read.names(), "kph, level");
        let all: Vec<Vec<f64>> = read.channels.iter().map(|c| c.samples.iter().collect()).collect();
        assert_eq!(all, [[0.0, 1.0, 0.0, 1.0], [7.0, 200.0, 7.0, 200.0]]);
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
            let columns = array("a.npy", &written(&shape, order, values)).unwrap().unwrap().columns();
            let [Samples::Values(a), Samples::Values(b)] = &columns[..] else { panic!("{columns:?}") };
            assert_eq!((&a[..], &b[..]), (&by_channel[..3], &by_channel[3..]));
        }
    }
}
