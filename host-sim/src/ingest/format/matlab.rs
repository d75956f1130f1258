//! MATLAB's `.mat` of level 5, which versions 5 to 7.2 write, and later ones with `-v6` or `-v7`.

use anyhow::{Context, Result, bail};
use flate2::read::ZlibDecoder;
use mat5::{Error, MatFile, Matrix, Values};

use super::super::samples::Samples;
use super::Content;
use super::arrays::{Array, UnpackedLimit, of_named};

/// Text, version and byte order.
const HEADER_BYTES: usize = 128;
/// Kind and length of an element.
const TAG_BYTES: usize = 8;
/// Version 1.0, little-endian; 7.3 says 2.0 and goes on as HDF5.
const VERSION_AND_ORDER: &[u8] = b"\x00\x01IM";
/// The kind of an element that is compressed: the next one follows it without padding.
const COMPRESSED: u32 = 15;

/// Whether a file is of level 5.
pub fn is(bytes: &[u8]) -> bool {
    bytes.get(HEADER_BYTES - VERSION_AND_ORDER.len()..HEADER_BYTES) == Some(VERSION_AND_ORDER)
}

/// Every array of real numbers is a channel, or several; text, structures and cells are left.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    if !is(bytes) {
        bail!("{file}: is no MATLAB file of level 5 (7.3 is another), expected one that was saved with -v7");
    }
    let wrong =
        || format!("{file}: cannot be read as a MATLAB file, expected a whole one that was saved with -v7");
    let (header, mut rest) = bytes.split_at(HEADER_BYTES);
    let mut arrays = Vec::new();
    let mut limit = UnpackedLimit::of(bytes.len());
    while !rest.is_empty() {
        // one at a time, so that one of another kind costs itself alone
        let (element, others) = first_element(rest).with_context(wrong)?;
        rest = others;
        let unpacked;
        let element = match element.split_at(TAG_BYTES) {
            (tag, packed) if tag[..4] == COMPRESSED.to_le_bytes() => {
                unpacked = limit.read(&format!("{file}: an array"), ZlibDecoder::new(packed))?;
                &unpacked
            }
            _ => element,
        };
        check(element).with_context(wrong)?;
        match MatFile::read_bytes(&[header, element].concat()) {
            Ok(read) => {
                // without a name: what MATLAB keeps for itself
                for array in read.arrays.into_iter().filter(|array| !array.name.is_empty()) {
                    let numbers = numbers(file, &array.name, array.matrix)?;
                    arrays.push((array.name, numbers));
                }
            }
            Err(Error::UnsupportedClass(_)) => {}
            Err(error) => return Err(error).with_context(wrong),
        }
    }
    if arrays.is_empty() {
        bail!(
            "{file}: holds no array of real numbers, expected one of each channel, outside structures and cells"
        );
    }
    Ok(Content::Waveform(of_named(file, arrays)?))
}

/// Whether the parts of an array are as long as they say: the crate subtracts lengths without a look.
fn check(element: &[u8]) -> Option<()> {
    let word = |at: usize| Some(u32::from_le_bytes(element.get(at..at + 4)?.try_into().ok()?));
    let mut at = TAG_BYTES;
    while at + TAG_BYTES <= element.len() {
        // a short part has its length beside its kind, and its bytes in the tag
        let short = (word(at)? >> 16) as usize;
        at = match short {
            0 => at + TAG_BYTES + (word(at + 4)? as usize).next_multiple_of(8),
            1..=4 => at + TAG_BYTES,
            _ => return None,
        };
    }
    Some(())
}

/// The first element with its tag, and what follows it.
fn first_element(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let length = TAG_BYTES + word(4)? as usize;
    let padded = if word(0)? == COMPRESSED { length } else { length.next_multiple_of(8) };
    Some((bytes.get(..length)?, bytes.get(padded..).unwrap_or_default()))
}

fn numbers(file: &str, name: &str, matrix: Matrix) -> Result<Array> {
    let Matrix::Dense(dense) = matrix else {
        bail!("{file}: array {name} is sparse, expected one that holds every sample");
    };
    let all = match dense.values {
        Values::I16(counts) => Samples::Counts(counts),
        Values::F64(values) => Samples::Values(values),
        other => Samples::Values(other.to_f64()),
    };
    if dense.rows.checked_mul(dense.cols) != Some(all.len()) {
        bail!("{file}: array {name} has {} numbers, expected {} × {}", all.len(), dense.rows, dense.cols);
    }
    Ok(Array { all, rows: dense.rows, width: dense.cols, is_by_rows: false })
}
