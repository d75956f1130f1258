//! Tables in text: comma, semicolon, tab or bar between the cells.

use anyhow::Result;

use super::super::encoding::decoded;
use super::super::sheet::{Cell, Row, Sheet};
use super::super::table;

const SEPARATORS: [char; 4] = [';', '\t', ',', '|'];
/// Lines in which the header is looked for.
const LOOKED_AT: usize = 200;

/// The one sheet of a text.
pub fn read(file: &str, bytes: &[u8]) -> Result<Option<Vec<Sheet>>> {
    let Some(text) = decoded(bytes) else { return Ok(None) };
    let end = text.match_indices('\n').nth(LOOKED_AT).map_or(text.len(), |(i, _)| i + 1);
    let columns = |separator: char| {
        let rows = rows(&text[..end], separator);
        rows.iter().map(|row| (table::score(row), row.cells.len())).max().unwrap_or_default()
    };
    // the first of equals
    let best = SEPARATORS.into_iter().rev().max_by_key(|separator| columns(*separator));
    let separator = best.unwrap_or(',');
    let rows = rows(&text, separator);
    Ok(Some(vec![Sheet { file: file.into(), name: None, separator: Some(separator), rows }]))
}

fn rows(text: &str, separator: char) -> Vec<Row> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator as u8)
        .from_reader(text.as_bytes());
    let mut rows = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).is_ok_and(|more| more) {
        // a record's position is before the blank lines that the reader skips
        let position = record.position();
        let start = position.map_or(0, |p| p.byte() as usize);
        let ends = text.as_bytes()[start..].iter().take_while(|b| matches!(b, b'\r' | b'\n'));
        let blank = ends.filter(|b| **b == b'\n').count();
        let number = position.map_or(0, |p| p.line() as usize) + blank;
        rows.push(Row { number, cells: record.iter().map(Cell::text).collect() });
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_numbers_over_blanks_and_header_sets_separator() {
        let text = "Machine: K-101, train A, unit 3\r\n\r\n\r\nSpeed;16X 1X Amp;16X 1X Phase\r\n\r\n100,5;2,5;30\r\n";
        let sheets = read("a.csv", text.as_bytes()).unwrap().unwrap();
        assert_eq!(sheets[0].separator, Some(';'));
        let numbers: Vec<usize> = sheets[0].rows.iter().map(|r| r.number).collect();
        assert_eq!(numbers, [1, 4, 6]);
        assert_eq!(sheets[0].rows[2].cells[1], Cell::Text("2,5".into()));
    }
}
