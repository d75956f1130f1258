//! Workbooks: xlsx, xls and ods.

use std::collections::BTreeMap;
use std::io::Cursor;

use anyhow::{Context, Result, anyhow, bail};
use calamine::{Data, Range, Reader, Sheets, XlsxError, open_workbook_auto_from_rs};

use super::super::calendar;
use super::super::sheet::{Cell, SheetRow};
use super::super::sheets::Sheet;
use super::{Content, unpacked};

/// What a zip archive and a compound file begin with.
const BEGINNINGS: [&[u8]; 2] = [b"PK\x03\x04", b"\xd0\xcf\x11\xe0"];

/// Columns of a sheet, XFD the last.
const MOST_COLUMNS: u32 = 16_384;
/// Cells of a sheet with the empty ones before them in their rows: more of them need more memory than a table of readings.
const MOST_CELLS: usize = 16_000_000;

/// Whether a file is an archive or a compound file.
pub fn is(bytes: &[u8]) -> bool {
    BEGINNINGS.iter().any(|beginning| bytes.starts_with(beginning))
}

/// Every sheet that holds something.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    unpacked::check(file, bytes)?;
    let mut book = open_workbook_auto_from_rs(Cursor::new(bytes))
        .map_err(|_| anyhow!("{file}: cannot be read as a workbook, expected xlsx, xls or ods"))?;
    let mut sheets = Vec::new();
    for name in book.sheet_names() {
        let wrong = || format!("{file}: sheet \"{name}\": cannot be read");
        let read = match &mut book {
            // cell by cell: a range has a place for every cell between the first and the last
            Sheets::Xlsx(book) => match book.worksheet_cells_reader(&name) {
                // a chart
                Err(XlsxError::NotAWorksheet(_)) => continue,
                reader => {
                    let mut reader = reader.with_context(wrong)?;
                    rows_of_cells(|| {
                        Ok(reader.next_cell()?.map(|c| (c.get_position(), c.get_value().clone().into())))
                    })
                }
            },
            Sheets::Xlsb(book) => {
                let mut reader = book.worksheet_cells_reader(&name).with_context(wrong)?;
                rows_of_cells(|| {
                    Ok(reader.next_cell()?.map(|c| (c.get_position(), c.get_value().clone().into())))
                })
            }
            book => Ok(rows_of_range(&book.worksheet_range(&name).with_context(wrong)?)),
        };
        let rows = read.with_context(wrong)?;
        let rows: Vec<SheetRow<'static>> = rows.into_iter().filter(|row| !row.is_blank()).collect();
        if !rows.is_empty() {
            sheets.push(Sheet { file: file.into(), name: Some(name), separator: None, rows, text: None });
        }
    }
    Ok(Content::Sheets(sheets))
}

/// The rows of the cells that `next` gives, with their places.
fn rows_of_cells(
    mut next: impl FnMut() -> Result<Option<((u32, u32), Data)>>,
) -> Result<Vec<SheetRow<'static>>> {
    let mut rows: BTreeMap<u32, Vec<Cell<'static>>> = BTreeMap::new();
    let mut places = 0;
    while let Some(((row, column), data)) = next()? {
        let value = cell(&data);
        if value.is_empty() || column >= MOST_COLUMNS {
            continue;
        }
        let cells = rows.entry(row).or_default();
        if cells.len() <= column as usize {
            places += column as usize + 1 - cells.len();
            if places > MOST_CELLS {
                bail!(
                    "row {}, column {}: the cells up to here take more than {MOST_CELLS} places, expected a table without cells far off, or CSV",
                    row + 1,
                    column + 1
                );
            }
            cells.resize(column as usize + 1, Cell::Empty);
        }
        cells[column as usize] = value;
    }
    Ok(rows.into_iter().map(|(row, cells)| SheetRow { number: row as usize + 1, cells }).collect())
}

fn rows_of_range(range: &Range<Data>) -> Vec<SheetRow<'static>> {
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

fn cell(data: &Data) -> Cell<'static> {
    match data {
        Data::Empty => Cell::Empty,
        Data::Int(n) => Cell::Number(*n as f64),
        Data::Float(x) => Cell::Number(*x),
        Data::String(text) | Data::DateTimeIso(text) | Data::DurationIso(text) => Cell::copied(text),
        Data::Bool(is) => Cell::Text(is.to_string().into()),
        Data::DateTime(time) => {
            let (year, month, day, hour, minute, second, milli) = time.to_ymd_hms_milli();
            let exact =
                calendar::civil([year.into(), month.into(), day.into()], [hour, minute, second], milli);
            exact.filter(|_| time.is_datetime()).map_or(Cell::Number(time.as_f64()), Cell::Time)
        }
        Data::Error(error) => Cell::Text(error.to_string().into()),
    }
}

#[cfg(test)]
mod tests {
    use rust_xlsxwriter::Workbook;

    use super::*;

    #[test]
    fn rows_with_cells_far_off_are_refused_before_allocation() {
        let mut far = (0..2_000).map(|row| ((row, MOST_COLUMNS - 1), Data::Float(1.0)));
        let error = rows_of_cells(|| Ok(far.next())).unwrap_err().to_string();
        assert!(error.starts_with("row 977, column 16384: the cells up to here"), "{error}");
        let mut near = (0..2_000).map(|row| ((row, 3), Data::Float(1.0)));
        assert_eq!(rows_of_cells(|| Ok(near.next())).unwrap().len(), 2_000);
    }

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
