//! Workbooks: xlsx, xls and ods.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek};

use anyhow::{Context, Result, anyhow};
use calamine::{Data, Range, Reader, Sheets, Xlsx, XlsxError, open_workbook_auto_from_rs};

use super::super::calendar;
use super::super::sheet::{Cell, Sheet, SheetRow};
use super::Content;

/// What a zip archive and a compound file begin with.
const BEGINNINGS: [&[u8]; 2] = [b"PK\x03\x04", b"\xd0\xcf\x11\xe0"];

/// Columns of a sheet, XFD the last.
const MOST_COLUMNS: u32 = 16_384;

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
        let wrong = || format!("{file}: sheet \"{name}\": cannot be read");
        let rows = match &mut book {
            // cell by cell: a range has a place for every cell between the first and the last
            Sheets::Xlsx(book) => rows_of_xlsx(book, &name).with_context(wrong)?,
            book => rows_of_range(&book.worksheet_range(&name).with_context(wrong)?),
        };
        let rows: Vec<SheetRow> = rows.into_iter().filter(|row| !row.is_blank()).collect();
        if !rows.is_empty() {
            sheets.push(Sheet { file: file.into(), name: Some(name), separator: None, rows });
        }
    }
    Ok(Content::Sheets(sheets))
}

fn rows_of_xlsx<R: Read + Seek>(book: &mut Xlsx<R>, name: &str) -> Result<Vec<SheetRow>, XlsxError> {
    let mut reader = match book.worksheet_cells_reader(name) {
        // a chart
        Err(XlsxError::NotAWorksheet(_)) => return Ok(Vec::new()),
        reader => reader?,
    };
    let mut rows: BTreeMap<u32, Vec<Cell>> = BTreeMap::new();
    while let Some(found) = reader.next_cell()? {
        let (row, column) = found.get_position();
        let value = cell(&found.get_value().clone().into());
        if value.is_empty() || column >= MOST_COLUMNS {
            continue;
        }
        let cells = rows.entry(row).or_default();
        if cells.len() <= column as usize {
            cells.resize(column as usize + 1, Cell::Empty);
        }
        cells[column as usize] = value;
    }
    Ok(rows.into_iter().map(|(row, cells)| SheetRow { number: row as usize + 1, cells }).collect())
}

fn rows_of_range(range: &Range<Data>) -> Vec<SheetRow> {
    let (first_row, first_column) = range.start().unwrap_or_default();
    let rows = range.rows().enumerate().map(|(down, cells)| {
        // columns count from A, wherever the table begins
        let before = std::iter::repeat_n(Cell::Empty, first_column as usize);
        SheetRow {
            number: first_row as usize + down + 1,
            cells: before.chain(cells.iter().map(cell)).collect(),
        }
    });
    rows.collect()
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

#[cfg(test)]
mod tests {
    use rust_xlsxwriter::Workbook;

    use super::*;

    #[test]
    fn cells_keep_their_place_however_far_apart_they_are() {
        let mut book = Workbook::new();
        let sheet = book.add_worksheet();
        sheet.write(2, 1, "Speed").unwrap();
        sheet.write(3, 1, 1500.5).unwrap();
        sheet.write(1_048_575, 16_383, 1.0).unwrap();
        book.add_worksheet();
        let bytes = book.save_to_buffer().unwrap();
        let Content::Sheets(sheets) = read("a.xlsx", &bytes).unwrap() else { panic!() };
        assert_eq!(sheets.len(), 1, "an empty sheet is none");
        let rows = &sheets[0].rows;
        let numbers: Vec<usize> = rows.iter().map(|row| row.number).collect();
        assert_eq!(numbers, [3, 4, 1_048_576]);
        assert_eq!(rows[0].cells, [Cell::Empty, Cell::Text("Speed".into())]);
        assert_eq!((rows[1].cell(1), rows[2].cell(16_383)), (&Cell::Number(1500.5), &Cell::Number(1.0)));
    }
}
