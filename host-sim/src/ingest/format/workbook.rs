//! Workbooks: xlsx, xls and ods.

use std::io::Cursor;

use anyhow::{Context, Result, anyhow};
use calamine::{Data, Reader, open_workbook_auto_from_rs};

use super::super::calendar;
use super::super::sheet::{Cell, Sheet, SheetRow};
use super::Content;

/// What a zip archive and a compound file begin with.
const BEGINNINGS: [&[u8]; 2] = [b"PK\x03\x04", b"\xd0\xcf\x11\xe0"];

/// Whether a file is an archive or a compound file.
pub fn is(bytes: &[u8]) -> bool {
    BEGINNINGS.iter().any(|beginning| bytes.starts_with(beginning))
}

/// Every sheet that holds something.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    let mut book = open_workbook_auto_from_rs(Cursor::new(bytes))
        .map_err(|_| anyhow!("{file}: cannot be read as a workbook, expected xlsx, xls or ods"))?;
    let mut sheets = Vec::new();
    for name in book.sheet_names() {
        let range = book
            .worksheet_range(&name)
            .with_context(|| format!("{file}: sheet \"{name}\": cannot be read"))?;
        let Some((first_row, first_column)) = range.start() else { continue };
        let rows = range.rows().enumerate().map(|(down, cells)| {
            // columns count from A, wherever the table begins
            let before = std::iter::repeat_n(Cell::Empty, first_column as usize);
            SheetRow {
                number: first_row as usize + down + 1,
                cells: before.chain(cells.iter().map(cell)).collect(),
            }
        });
        let rows = rows.filter(|row| !row.is_blank()).collect();
        sheets.push(Sheet { file: file.into(), name: Some(name), separator: None, rows });
    }
    Ok(Content::Sheets(sheets))
}

fn cell(data: &Data) -> Cell {
    match data {
        Data::Empty => Cell::Empty,
        Data::Int(n) => Cell::Number(*n as f64),
        Data::Float(x) => Cell::Number(*x),
        Data::String(text) | Data::DateTimeIso(text) | Data::DurationIso(text) => Cell::text(text),
        Data::Bool(is) => Cell::Text(is.to_string()),
        Data::DateTime(time) => {
            let (year, month, day, hour, minute, second, milli) = time.to_ymd_hms_milli();
            let exact =
                calendar::civil([year.into(), month.into(), day.into()], [hour, minute, second], milli);
            exact.filter(|_| time.is_datetime()).map_or(Cell::Number(time.as_f64()), Cell::Time)
        }
        Data::Error(error) => Cell::Text(error.to_string()),
    }
}
