//! What a workbook becomes when it is unpacked: looked at before memory is asked for.

use std::io::{BufRead, BufReader, Cursor};

use anyhow::{Context, Result, bail};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use zip::ZipArchive;

/// Bytes of all parts of a workbook together, and of one that is held in memory whole.
const MOST_BYTES: u64 = 1 << 30;
const MOST_HELD: u64 = 1 << 27;
/// Parts that are held whole.
const HELD: [&str; 2] = ["sharedStrings.xml", "styles.xml"];
/// Cells of an open document: each needs several times the memory of one in other workbooks.
const MOST_CELLS: usize = 4_000_000;
/// Where an open document has its cells.
const CELLS: &str = "content.xml";

/// Refuses a workbook that unpacks to more than memory is meant for.
///
/// # Errors
/// One sentence with the file and the limit.
pub fn check(file: &str, bytes: &[u8]) -> Result<()> {
    // what is no archive is no larger than its file
    let Ok(mut archive) = ZipArchive::new(Cursor::new(bytes)) else { return Ok(()) };
    let mut all = 0_u64;
    for i in 0..archive.len() {
        let Ok(part) = archive.by_index_raw(i) else { continue };
        all = all.saturating_add(part.size());
        let is_held = HELD.iter().any(|held| part.name().is_ok_and(|name| name.ends_with(held)));
        if all > MOST_BYTES || (is_held && part.size() > MOST_HELD) {
            bail!("{file}: unpacks to more than {} MB, expected CSV for so large a table", MOST_BYTES >> 20);
        }
    }
    match archive.by_name(CELLS) {
        Ok(part) => {
            let place = || format!("{file}: cannot be read as an open document");
            check_cells(file, BufReader::new(std::io::Read::take(part, MOST_BYTES))).with_context(place)
        }
        Err(_) => Ok(()),
    }
}

/// Rows and columns of a table, repeated ones counted.
#[derive(Default)]
struct Extent {
    /// Rows so far, and up to the last that holds something.
    rows: usize,
    last_row: usize,
    columns: usize,
    /// Cells of all rows before they are repeated.
    cells: usize,
    /// Of the row that is read: how often it is repeated, its columns so far, and up to the last that holds something.
    repeated: usize,
    column: usize,
    last_column: usize,
}

impl Extent {
    fn end_row(&mut self) {
        self.rows = self.rows.saturating_add(self.repeated);
        if self.last_column > 0 {
            self.last_row = self.rows;
            self.columns = self.columns.max(self.last_column);
            self.cells = self.cells.saturating_add(self.last_column);
        }
        (self.column, self.last_column) = (0, 0);
    }

    fn is_too_large(&self) -> bool {
        self.cells > MOST_CELLS || self.last_row.saturating_mul(self.columns) > MOST_CELLS
    }
}

fn check_cells(file: &str, part: impl BufRead) -> Result<()> {
    let mut reader = Reader::from_reader(part);
    let mut buffer = Vec::new();
    let mut extent = Extent::default();
    loop {
        buffer.clear();
        match reader.read_event_into(&mut buffer)? {
            Event::Start(tag) if is(&tag, "table:table") => extent = Extent::default(),
            Event::Start(tag) if is(&tag, "table:table-row") => {
                extent.repeated = times(&tag, "table:number-rows-repeated");
            }
            Event::Empty(tag) if is(&tag, "table:table-row") => {
                extent.repeated = times(&tag, "table:number-rows-repeated");
                extent.end_row();
            }
            Event::Start(tag) | Event::Empty(tag)
                if is(&tag, "table:table-cell") || is(&tag, "table:covered-table-cell") =>
            {
                let repeated = times(&tag, "table:number-columns-repeated");
                extent.column = extent.column.saturating_add(repeated);
                let is_filled = tag.attributes().flatten().any(|a| a.key.as_ref().starts_with(FILLED));
                if is_filled {
                    extent.last_column = extent.column;
                }
            }
            Event::End(tag) if tag.name().as_ref() == "table:table-row" => extent.end_row(),
            Event::Eof => return Ok(()),
            _ => (),
        }
        if extent.is_too_large() {
            bail!(
                "{file}: a table has {} rows of up to {} columns, expected at most {MOST_CELLS} cells, or CSV",
                extent.last_row,
                extent.columns.max(extent.last_column)
            );
        }
    }
}

fn is(tag: &BytesStart, name: &str) -> bool {
    tag.name().as_ref() == name
}

/// How often a row or a cell is repeated.
fn times(tag: &BytesStart, attribute: &str) -> usize {
    let found = tag.attributes().flatten().find(|a| a.key.as_ref() == attribute);
    found.and_then(|a| a.value.parse().ok()).unwrap_or(1)
}

/// How the attribute begins that a cell has if it holds something.
const FILLED: &str = "office:";

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(rows: &str) -> Result<()> {
        let xml = format!("<table:table table:name=\"a\">{rows}</table:table>");
        check_cells("a.ods", xml.as_bytes())
    }

    #[test]
    fn repeated_rows_count_up_to_the_last_filled_one() {
        let row = |times: usize, cell: &str| {
            format!("<table:table-row table:number-rows-repeated=\"{times}\">{cell}</table:table-row>")
        };
        let filled = r#"<table:table-cell office:value="1" table:number-columns-repeated="6"/>"#;
        let empty = r#"<table:table-cell table:number-columns-repeated="16384"/>"#;
        assert!(checked(&(row(1_000, filled) + &row(1_048_576, empty))).is_ok());
        let error = checked(&row(1_000_000, filled)).unwrap_err().to_string();
        assert_eq!(
            error,
            "a.ods: a table has 1000000 rows of up to 6 columns, expected at most 4000000 cells, or CSV"
        );
        assert!(checked(&(row(1_048_000, empty) + &row(1, filled))).is_err());
        assert!(checked(&row(usize::MAX, filled)).is_err());
    }
}
