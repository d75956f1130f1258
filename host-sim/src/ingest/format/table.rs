//! The formats that are read, a file each.

use std::path::Path;

use anyhow::{Context, Result, bail};

use super::super::sheet::Sheet;
#[cfg(feature = "parquet")]
use super::parquet;
use super::{spreadsheet, text};

/// A format: sheets of a file, or nothing if the file is of another one.
type Format = fn(file: &str, bytes: &[u8]) -> Result<Option<Vec<Sheet>>>;

/// All of them, in the order in which they are tried.
const FORMATS: &[Format] = &[
    spreadsheet::read,
    #[cfg(feature = "parquet")]
    parquet::read,
    text::read,
];

/// The sheets of a file, by what it holds, whatever it is called.
///
/// # Errors
/// One sentence with the file if it cannot be read or is of no format here.
pub fn read(path: &Path) -> Result<Vec<Sheet>> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).with_context(|| format!("{file}: cannot be read"))?;
    if bytes.is_empty() {
        bail!("{file}: is empty, expected a table of measurements");
    }
    if cfg!(not(feature = "parquet")) && bytes.starts_with(b"PAR1") {
        bail!(
            "{file}: is Parquet, which this program was built without, expected CSV, or a program built with --features parquet"
        );
    }
    for format in FORMATS {
        if let Some(sheets) = format(&file, &bytes)? {
            return Ok(sheets);
        }
    }
    bail!("{file}: is neither text nor a workbook, expected CSV, TSV, xlsx, xls or ods")
}
