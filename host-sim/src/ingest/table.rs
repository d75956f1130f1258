//! Where in a sheet the table is: what stands above it, its header, the units below that, its rows.

use rayon::prelude::*;
use std::collections::HashSet;
use std::ops::ControlFlow;

use anyhow::Result;

use super::conditions;
use super::format::text::{Block, Text};
use super::header::{Header, is_unit, meaning};
use super::preamble::{self, Line};
use super::sheet::{Cell, SheetRow};
use super::sheets::Sheet;
use super::target::Quantity;

/// Rows in which a header is looked for.
const DEEPEST: usize = 200;
/// Rows of a workbook that a thread reads at once.
const BLOCK_ROWS: usize = 1 << 13;
/// Rows of a header above the one with most of the names.
const MOST_UPPER: usize = 3;
/// Rows below a header of samples that must be samples; one alone may be a line of a preamble.
const FEWEST_SAMPLES: usize = 3;

/// A table of a sheet.
#[derive(Debug, Clone)]
pub struct ReadingTable<'a> {
    pub sheet: &'a Sheet,
    /// Row of the header, from 1.
    pub header_row: usize,
    pub columns: Vec<Header>,
    /// What stands above it.
    pub above: Vec<Line>,
    /// The rows of the header, units included.
    pub head: &'a [SheetRow<'static>],
    pub rows: Rows<'a>,
}

/// Rows below the header.
#[derive(Debug, Clone, Copy)]
pub enum Rows<'a> {
    Cells(&'a [SheetRow<'static>]),
    /// Of a text those behind this row; cut into cells each time, as the cells of a million rows need many times its memory.
    Text {
        text: &'a Text,
        separator: char,
        behind: usize,
    },
    /// A part of a text.
    Block {
        block: Block<'a>,
        separator: char,
        behind: usize,
    },
}

impl<'a> Rows<'a> {
    /// Calls `visit` with each row until it breaks.
    ///
    /// # Errors
    /// Those of `visit`.
    pub fn each(&self, mut visit: impl FnMut(&SheetRow) -> Result<ControlFlow<()>>) -> Result<()> {
        let mut visit_behind = |row: &SheetRow, behind: usize| match row.number > behind {
            true => visit(row),
            false => Ok(ControlFlow::Continue(())),
        };
        match *self {
            Self::Cells(rows) => {
                for row in rows {
                    if visit_behind(row, 0)?.is_break() {
                        break;
                    }
                }
                Ok(())
            }
            Self::Text { text, separator, behind } => {
                text.each(separator, &mut |row| visit_behind(row, behind))
            }
            Self::Block { block, separator, behind } => {
                block.each(separator, &mut |row| visit_behind(row, behind)).map(|_| ())
            }
        }
    }

    /// Parts of them in their order, for threads.
    pub fn blocks(&self) -> Vec<Self> {
        match *self {
            Self::Cells(rows) => rows.chunks(BLOCK_ROWS).map(Self::Cells).collect(),
            Self::Text { text, separator, behind } => {
                text.blocks().map(|block| Self::Block { block, separator, behind }).collect()
            }
            one => vec![one],
        }
    }

    /// No fewer than there are.
    pub fn most(&self) -> usize {
        match self {
            Self::Cells(rows) => rows.len(),
            Self::Text { text, .. } => text.most_rows(),
            Self::Block { .. } => 0,
        }
    }

    /// Results of `of` for each block, computed on several threads, in the order of the blocks.
    pub fn of_blocks<T: Send>(&self, of: impl Fn(&Self) -> T + Sync + Send) -> Vec<T> {
        self.blocks().par_iter().map(of).collect()
    }

    /// The first that `find` finds in a row.
    pub fn find_map<T>(&self, mut find: impl FnMut(&SheetRow) -> Option<T>) -> Option<T> {
        let mut found = None;
        let visit = |row: &SheetRow| {
            found = find(row);
            Ok(if found.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        };
        // `find` has no errors
        self.each(visit).unwrap_or_default();
        found
    }

    pub fn for_each(&self, mut visit: impl FnMut(&SheetRow)) {
        self.find_map(|row| {
            visit(row);
            None::<()>
        });
    }
}

/// The table of a sheet, if there is one; a header names a speed or a vibration, and something else.
pub fn find(sheet: &Sheet) -> Option<ReadingTable<'_>> {
    let candidates = sheet.rows.iter().take(DEEPEST).enumerate();
    let scored = candidates.map(|(at, row)| (at, score(row)));
    let (at, _) = scored.filter(|(_, score)| *score >= 2).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    let Head { mut columns, above, below } = head(&sheet.rows, at);
    let rows = match (&sheet.text, sheet.separator) {
        (Some(text), Some(separator)) => {
            Rows::Text { text, separator, behind: sheet.rows[at + below].number }
        }
        _ => Rows::Cells(&sheet.rows[at + 1 + below..]),
    };
    add_unnamed(&mut columns, sheet, rows);
    let lines = preamble::lines(&sheet.rows[..at - above]);
    preamble::complete(&mut columns, &lines);
    Some(ReadingTable {
        sheet,
        header_row: sheet.rows[at].number,
        columns,
        above: lines,
        head: &sheet.rows[at - above..=at + below],
        rows,
    })
}

/// Adds the columns that hold something and have no name.
fn add_unnamed(columns: &mut Vec<Header>, sheet: &Sheet, rows: Rows) {
    let named = columns.last().map_or(0, |column| column.index + 1);
    // a row of text that is longer than the header was cut in the wrong places
    let width = if sheet.separator.is_some() { named } else { usize::MAX };
    if columns.len() == width {
        return;
    }
    let mut is_filled = Vec::new();
    rows.for_each(|row| {
        let cells = &row.cells[..row.cells.len().min(width)];
        is_filled.resize(cells.len().max(is_filled.len()), false);
        for (filled, cell) in is_filled.iter_mut().zip(cells) {
            *filled |= !cell.is_empty();
        }
    });
    for column in columns.iter() {
        if let Some(filled) = is_filled.get_mut(column.index) {
            *filled = false;
        }
    }
    let unnamed = is_filled.iter().enumerate().filter(|(_, filled)| **filled);
    columns.extend(unnamed.map(|(index, _)| Header { index, ..Header::default() }));
    columns.sort_by_key(|column| column.index);
}

/// The heads of the columns whose names stand in row `at`, and how many rows of units are below it.
pub fn headers(rows: &[SheetRow], at: usize) -> (Vec<Header>, usize) {
    let head = head(rows, at);
    (head.columns, head.below)
}

struct Head {
    columns: Vec<Header>,
    /// Rows of it above the row with the names, and below.
    above: usize,
    below: usize,
}

fn head(rows: &[SheetRow], at: usize) -> Head {
    let below = rows[at + 1..].iter().take_while(|row| is_unit_row(row)).count();
    let text = |row: &SheetRow, column: usize| {
        row.cell(column).as_text().unwrap_or_default().replace(['\r', '\n'], " ")
    };
    let uppers = rows[..at].iter().rev().take(MOST_UPPER).take_while(|row| is_upper(row, &rows[at]));
    let uppers: Vec<&SheetRow> = uppers.collect();
    let parts = uppers.iter().copied().chain(&rows[at..=at + below]);
    let width = parts.map(width).max().unwrap_or(0);
    let name = |index: usize| Header { index, name: text(&rows[at], index), ..Header::default() };
    let mut columns: Vec<Header> = (0..width).map(name).collect();
    let mut above = 0;
    for upper in uppers {
        let over: Vec<String> = (0..width).map(|column| text(upper, column)).collect();
        let labels = |c: &Header| !c.name.is_empty() && !is_unit(&c.name);
        let completes = columns.iter().zip(&over).any(|(c, over)| !over.is_empty() && !labels(c));
        if !completes && !is_repeated(&columns) {
            break;
        }
        above += 1;
        put_over(&mut columns, over);
    }
    for column in &mut columns {
        let units: Vec<String> = (1..=below).map(|down| text(&rows[at + down], column.index)).collect();
        column.unit = format!("{} {}", column.unit, units.join(" ")).trim().to_string();
        if column.name.is_empty() {
            column.name = std::mem::take(&mut column.unit);
        }
    }
    columns.retain(|column| !column.name.is_empty());
    Head { columns, above, below }
}

/// Puts a row of the header over those below it: a cell names its column where nothing else does, and else stands over all
/// columns up to the next cell, unless it is what only one column can be.
fn put_over(columns: &mut [Header], over: Vec<String>) {
    let mut group = String::new();
    for (column, over) in columns.iter_mut().zip(over) {
        if column.name.is_empty() {
            column.name = over;
            group.clear();
            continue;
        }
        // a unit of a load below the group of a probe is none of the probe's
        let is_below = !over.is_empty() && conditions::is_unit(&column.name);
        let mut own = group.clone();
        if !over.is_empty() {
            own.clone_from(&over);
            let quantity = meaning(&over, |_| false).quantity;
            group = if quantity.is_none_or(Quantity::is_of_probe) { over } else { String::new() };
        }
        if (is_unit(&column.name) || is_below) && !own.is_empty() {
            column.unit = std::mem::replace(&mut column.name, own);
        } else {
            column.group = format!("{own} {}", column.group).trim().to_string();
        }
    }
}

/// Whether a row may be part of the header below it: texts alone, more than a key and what it states.
fn is_upper(row: &SheetRow, header: &SheetRow) -> bool {
    let is_text = row.cells.iter().all(|cell| matches!(cell, Cell::Empty | Cell::Text(_)));
    is_text && (width(row) > 2 || width(header) <= width(row).max(2))
}

/// Cells of a row up to the last that holds something.
fn width(row: &SheetRow) -> usize {
    row.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
}

/// The row of names directly above rows of samples, with the rows of units between them; `is_value` is what a sample or its
/// time may be.
pub fn above_samples(rows: &[SheetRow], is_value: impl Fn(&Cell) -> bool) -> Option<usize> {
    struct Row {
        filled: usize,
        width: usize,
        values: usize,
        is_units: bool,
    }
    let count = |row: &SheetRow| Row {
        filled: row.cells.iter().filter(|c| !c.is_empty()).count(),
        width: row.cells.iter().rposition(|c| !c.is_empty()).map_or(0, |last| last + 1),
        values: row.cells.iter().filter(|c| is_value(c)).count(),
        is_units: is_unit_row(row),
    };
    let rows: Vec<Row> = rows.iter().map(count).collect();
    let is_header = |at: usize, samples: usize| {
        let row = &rows[at];
        let below = rows[at + 1..].iter().take_while(|row| row.is_units).count();
        let mut first = rows[at + 1 + below..].iter().take(samples).peekable();
        // above units, a number is the name of a channel
        let may_name = row.filled > 0 && (row.values == 0 || (below > 0 && row.values < row.filled));
        let has_samples = first.peek().is_some();
        may_name
            && has_samples
            && first.all(|row_of| 2 * row_of.values > row_of.filled && row_of.width <= row.width)
    };
    let first = |samples: usize| (0..rows.len()).find(|at| is_header(*at, samples));
    // lines of a preamble may have a number for each channel, and are not samples to the end
    first(usize::MAX).or_else(|| first(FEWEST_SAMPLES)).or_else(|| first(1))
}

/// Columns of a row that say what they are, if they are of a table of vibration.
pub fn score(row: &SheetRow) -> usize {
    let texts: Vec<&str> = row.cells.iter().filter_map(Cell::as_text).collect();
    let names =
        texts.iter().filter(|t| t.starts_with(|c: char| c.is_alphabetic() || "#1".contains(c))).count();
    // a row of data has numbers, a line of prose one cell
    if 2 * names <= texts.len() || texts.len() != row.cells.iter().filter(|c| !c.is_empty()).count() {
        return 0;
    }
    let known: Vec<Quantity> = texts.iter().filter_map(|text| meaning(text, |_| false).quantity).collect();
    let vibration = known.iter().any(|q| *q == Quantity::Speed || q.is_of_probe());
    if vibration { known.len() } else { 0 }
}

fn is_unit_row(row: &SheetRow) -> bool {
    let texts: Vec<&str> = row.cells.iter().filter_map(Cell::as_text).collect();
    let units = texts.iter().filter(|text| is_unit(text)).count();
    let numbers = row.cells.iter().any(|c| matches!(c, Cell::Number(_) | Cell::Time(_)))
        || texts.iter().any(|text| text.starts_with(|c: char| c.is_ascii_digit()) && !is_unit(text));
    units > 0 && 2 * units >= texts.len() && !numbers
}

/// Whether two columns of vibration have one name.
fn is_repeated(columns: &[Header]) -> bool {
    let of_vibration = columns
        .iter()
        .map(Header::text)
        .filter(|text| meaning(text, |_| false).quantity.is_some_and(Quantity::is_vibration));
    let mut seen = HashSet::new();
    of_vibration.into_iter().any(|text| !seen.insert(text))
}
