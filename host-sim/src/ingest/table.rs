//! Where in a sheet the table is: what stands above it, its header, the units below that, its rows.

use super::header::{is_unit, meaning};
use super::sheet::{Cell, Sheet, SheetRow};
use super::target::Quantity;

/// Rows in which a header is looked for.
const DEEPEST: usize = 200;

/// A table of a sheet.
#[derive(Debug, Clone)]
pub struct ReadingTable<'a> {
    pub sheet: &'a Sheet,
    /// Row of the header, from 1.
    pub header_row: usize,
    pub columns: Vec<Header>,
    /// Text above the header row.
    pub above: Vec<String>,
    pub rows: &'a [SheetRow],
}

/// The head of one column.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Place in the row, from 0.
    pub index: usize,
    pub name: String,
    /// What stands in the row above, over this and the columns to its right.
    pub group: String,
    /// What stands in the rows of units below.
    pub unit: String,
}

impl Header {
    /// All that is said of the column.
    pub fn text(&self) -> String {
        [&self.group, &self.name, &self.unit].map(String::as_str).join(" ")
    }
}

/// The table of a sheet, if there is one; a header names a speed or a vibration, and something else.
pub fn find(sheet: &Sheet) -> Option<ReadingTable<'_>> {
    let candidates = sheet.rows.iter().take(DEEPEST).enumerate();
    let scored = candidates.map(|(at, row)| (at, score(row)));
    let (at, _) = scored.filter(|(_, score)| *score >= 2).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    let (columns, below) = headers(&sheet.rows, at);
    let above = sheet.rows[..at].iter().map(|row| {
        row.cells.iter().filter_map(Cell::as_text).collect::<Vec<_>>().join(" ").replace(['#', '"'], " ")
    });
    Some(ReadingTable {
        sheet,
        header_row: sheet.rows[at].number,
        columns,
        above: above.collect(),
        rows: &sheet.rows[at + 1 + below..],
    })
}

/// The heads of the columns whose names stand in row `at`, and how many rows of units are below it.
pub fn headers(rows: &[SheetRow], at: usize) -> (Vec<Header>, usize) {
    let below = rows[at + 1..].iter().take_while(|row| is_unit_row(row)).count();
    let text = |row: Option<&SheetRow>, column: usize| {
        row.and_then(|row| row.cell(column).as_text()).unwrap_or_default().replace(['\r', '\n'], " ")
    };
    let header = &rows[at];
    let names: Vec<String> = (0..header.cells.len()).map(|i| text(Some(header), i)).collect();
    let above_it = at.checked_sub(1).map(|at| &rows[at]);
    let grouped = is_repeated(&names);
    let mut group = String::new();
    let mut columns = Vec::new();
    for (index, name) in names.into_iter().enumerate() {
        let over = text(above_it, index);
        if grouped && !over.is_empty() {
            group = over;
        }
        let units: Vec<String> = (1..=below).map(|down| text(rows.get(at + down), index)).collect();
        let unit = units.join(" ").trim().to_string();
        if !name.is_empty() {
            columns.push(Header { index, name, group: group.clone(), unit });
        }
    }
    (columns, below)
}

/// The row of names directly above rows of samples, with the rows of units between them; `is_value` is what a sample or its
/// time may be.
pub fn above_samples(rows: &[SheetRow], is_value: impl Fn(&Cell) -> bool) -> Option<usize> {
    let filled = |row: &SheetRow| row.cells.iter().filter(|c| !c.is_empty()).count();
    let width = |row: &SheetRow| row.cells.iter().rposition(|c| !c.is_empty()).map_or(0, |last| last + 1);
    let values = |row: &SheetRow| row.cells.iter().filter(|c| is_value(c)).count();
    rows.iter().enumerate().position(|(at, row)| {
        let below = rows[at + 1..].iter().take_while(|row| is_unit_row(row)).count();
        let first = rows.get(at + 1 + below);
        let is_sample = |first: &SheetRow| 2 * values(first) > filled(first) && width(first) <= width(row);
        filled(row) > 0 && values(row) == 0 && first.is_some_and(is_sample)
    })
}

/// Columns of a row that say what they are, if they are of a table of vibration.
pub fn score(row: &SheetRow) -> usize {
    let texts: Vec<&str> = row.cells.iter().filter_map(Cell::as_text).collect();
    let known: Vec<Quantity> = texts.iter().filter_map(|text| meaning(text, |_| false).quantity).collect();
    let names =
        texts.iter().filter(|t| t.starts_with(|c: char| c.is_alphabetic() || "#1".contains(c))).count();
    let vibration = known.iter().any(|q| *q == Quantity::Speed || q.is_of_probe());
    // a row of data has numbers, a line of prose one cell
    let is_header = vibration
        && 2 * names > texts.len()
        && texts.len() == row.cells.iter().filter(|c| !c.is_empty()).count();
    if is_header { known.len() } else { 0 }
}

fn is_unit_row(row: &SheetRow) -> bool {
    let texts: Vec<&str> = row.cells.iter().filter_map(Cell::as_text).collect();
    let units = texts.iter().filter(|text| is_unit(text)).count();
    let numbers = row.cells.iter().any(|c| matches!(c, Cell::Number(_) | Cell::Time(_)))
        || texts.iter().any(|text| text.starts_with(|c: char| c.is_ascii_digit()) && !is_unit(text));
    units > 0 && 2 * units >= texts.len() && !numbers
}

fn is_repeated(names: &[String]) -> bool {
    let vibration = |name: &&String| meaning(name, |_| false).quantity.is_some_and(Quantity::is_vibration);
    let of_vibration: Vec<&String> = names.iter().filter(vibration).collect();
    of_vibration.iter().enumerate().any(|(i, name)| of_vibration[..i].contains(name))
}
