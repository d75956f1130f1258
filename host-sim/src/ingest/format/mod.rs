//! The formats of files, a file each: bytes in, cells or samples out.

mod arrays;
#[cfg(test)]
mod example;
mod matlab;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
pub mod text;
mod unpacked;
mod wav;
mod workbook;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Error, Result, anyhow, bail};

use super::samples::Waveform;
use super::sheet::SheetRow;
use super::sheets::Sheet;
pub use text::Text;

/// Cells or samples of a file.
pub enum Content {
    Sheets(Vec<Sheet>),
    Text(Text),
    Waveform(Waveform),
}

#[derive(Clone, Copy)]
struct Format {
    /// Extensions of its files, the usual one first.
    extensions: &'static [&'static str],
    /// Whether the bytes of a file are of this format; never for text, which is told by being no other.
    is: fn(bytes: &[u8]) -> bool,
    read: fn(file: &str, bytes: Vec<u8>) -> Result<Content>,
    /// Reads a recording that stays in its file, where that is possible.
    open: Option<fn(file: &str, opened: File) -> Result<Content>>,
}

impl Format {
    const fn of(
        extensions: &'static [&'static str],
        is: fn(&[u8]) -> bool,
        read: fn(&str, Vec<u8>) -> Result<Content>,
    ) -> Self {
        Self { extensions, is, read, open: None }
    }
}

/// Bytes of a file by which recordings that stay there are known.
const HEAD_BYTES: u64 = 64;

/// Text stands first; a workbook is any other archive.
const FORMATS: [Format; 7] = [
    Format::of(&["csv", "tsv", "txt", "lvm", "asc", "dat"], |_| false, read_text),
    Format {
        open: Some(wav::open),
        ..Format::of(&["wav", "rf64"], wav::is, |file, bytes| wav::read(file, &bytes))
    },
    Format::of(&["npy"], numpy::is_array, |file, bytes| numpy::read_array(file, &bytes)),
    Format::of(&["npz"], numpy::is_archive, |file, bytes| numpy::read_archive(file, &bytes)),
    Format::of(&["mat"], matlab::is, |file, bytes| matlab::read(file, &bytes)),
    Format::of(&["xlsx", "xls", "ods"], workbook::is, |file, bytes| workbook::read(file, &bytes)),
    Format::of(&["parquet"], is_parquet, |file, bytes| read_parquet(file, &bytes)),
];

/// The sheets of a file of readings, by what it holds, whatever it is called; rows of a header score most.
///
/// # Errors
/// One sentence with the file if it cannot be read or is of no format here.
pub fn sheets(path: &Path, score: fn(&SheetRow) -> usize) -> Result<Vec<Sheet>> {
    sheets_of(&FORMATS, path, score)
}

/// The same with these formats, text first.
fn sheets_of(formats: &[Format], path: &Path, score: fn(&SheetRow) -> usize) -> Result<Vec<Sheet>> {
    let file = path.display().to_string();
    let mut head = Vec::new();
    opened(path)?.take(HEAD_BYTES).read_to_end(&mut head).with_context(|| unread(path))?;
    // a recording that stays in its file may be larger than the memory
    if formats.iter().any(|format| format.open.is_some() && (format.is)(&head)) {
        return Err(no_readings(&file));
    }
    let bytes = bytes(path)?;
    if bytes.is_empty() {
        bail!("{file}: is empty, expected a table of measurements");
    }
    let format = formats.iter().find(|format| (format.is)(&bytes)).unwrap_or(&formats[0]);
    match (format.read)(&file, bytes)? {
        Content::Sheets(sheets) => Ok(sheets),
        Content::Text(text) => Ok(vec![Sheet::of_text(text, score)?]),
        Content::Waveform(_) => Err(no_readings(&file)),
    }
}

fn no_readings(file: &str) -> Error {
    anyhow!("{file}: holds samples of channels, expected a table of readings; `rotor-edge extract` reads it")
}

/// What a recording holds, by the extension of its file.
///
/// # Errors
/// One sentence with the file if it cannot be read or has another extension.
pub fn recording(path: &Path) -> Result<Content> {
    let file = path.display().to_string();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some(format) = FORMATS.iter().find(|format| format.extensions.contains(&extension.as_str())) else {
        let known = FORMATS.map(|format| format!(".{}", format.extensions[0])).join(", ");
        bail!("{file}: the extension names no supported format of waveforms, expected one of {known}");
    };
    match format.open {
        Some(open) => open(&file, opened(path)?),
        None => (format.read)(&file, bytes(path)?),
    }
}

fn opened(path: &Path) -> Result<File> {
    File::open(path).with_context(|| unread(path))
}

fn unread(path: &Path) -> String {
    format!("{}: cannot be read", path.display())
}

fn bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| unread(path))
}

fn read_text(file: &str, bytes: Vec<u8>) -> Result<Content> {
    Ok(Content::Text(Text::of(file, bytes)?))
}

fn is_parquet(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PAR1")
}

#[cfg(feature = "parquet")]
use parquet::read as read_parquet;

#[cfg(not(feature = "parquet"))]
fn read_parquet(file: &str, _: &[u8]) -> Result<Content> {
    bail!(
        "{file}: is Parquet, which this program was built without, expected CSV, or a program built with --features parquet"
    );
}
