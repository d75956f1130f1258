//! Tables in text, with a separator between the cells.

use std::ops::ControlFlow;

use anyhow::{Result, bail};
use csv::ByteRecord;

use super::super::encoding::decoded;
use super::super::sheet::{Cell, SheetRow};

/// Rows in which the header is looked for.
const LOOKED_AT: usize = 200;

/// Bytes of a cell; one that is longer is no name, number or remark, but a file of another kind.
const LONGEST_CELL: usize = 100_000;

/// A table in text, before it is cut into cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    pub file: String,
    text: String,
    /// Lines that begin with it are no rows.
    comment: Option<u8>,
}

impl Text {
    /// Decodes the bytes of a file.
    ///
    /// # Errors
    /// If they are no text in any of the encodings.
    pub fn of(file: &str, bytes: &[u8]) -> Result<Self> {
        match decoded(bytes) {
            Some(text) => Ok(Self { file: file.into(), text, comment: None }),
            None => bail!("{file}: is neither text nor a workbook, expected CSV, TSV, xlsx, xls or ods"),
        }
    }

    /// The same, whose lines that begin with `#` are no rows.
    pub fn without_comments(self) -> Self {
        Self { comment: Some(b'#'), ..self }
    }

    /// Lines in which the header is looked for.
    pub fn first_lines(&self) -> impl Iterator<Item = &str> {
        self.text.lines().take(LOOKED_AT)
    }

    /// # Errors
    /// If one of the first lines has more cells than `most`, or a cell that no table has; `row` is what a row should be of.
    pub fn check_widths(&self, separators: &[char], most: usize, row: &str) -> Result<()> {
        for (i, line) in self.first_lines().enumerate() {
            let place = || format!("{}: row {}", self.file, i + 1);
            for separator in separators {
                let cells = line.bytes().filter(|b| *b == *separator as u8).count() + 1;
                if cells > most {
                    bail!(
                        "{} has {cells} cells, expected at most {most}: a row for each {row}, not a column",
                        place()
                    );
                }
            }
            if let Some(cell) = line.split(separators).find(|cell| cell.len() > LONGEST_CELL) {
                bail!(
                    "{} has a cell of {} characters, expected cells separated by commas, semicolons, tabs or |",
                    place(),
                    cell.len()
                );
            }
        }
        Ok(())
    }

    /// The separator whose first rows have the highest score, the first of equals.
    pub fn separator<S: Ord>(&self, among: [char; 4], score: impl Fn(char, &[SheetRow]) -> S) -> char {
        let score = |separator: &char| score(*separator, &self.first_rows(*separator));
        // `max_by_key` takes the last of equals
        among.into_iter().rev().max_by_key(score).unwrap_or(',')
    }

    /// The rows in which a header may stand.
    pub fn first_rows(&self, separator: char) -> Vec<SheetRow> {
        let end = self.text.match_indices('\n').nth(LOOKED_AT).map_or(self.text.len(), |(i, _)| i + 1);
        let mut rows = Vec::new();
        let push = |number: usize, record: &ByteRecord| {
            rows.push(row(number, record));
            Ok(ControlFlow::Continue(()))
        };
        each_of(&self.text[..end], separator, self.comment, push).unwrap_or_default();
        rows
    }

    /// Comments among the first lines, without what they begin with.
    pub fn comments(&self) -> Vec<SheetRow> {
        let is = |line: &&str| self.comment.is_some() && line.as_bytes().first() == self.comment.as_ref();
        let cells = |line: &str| vec![Cell::text(line.trim_start_matches('#'))];
        self.first_lines().filter(is).map(|line| SheetRow { number: 0, cells: cells(line) }).collect()
    }

    /// Calls `push` with the number of each row, from 1, and its cells, until it breaks.
    ///
    /// # Errors
    /// Those of `push`.
    pub fn each(
        &self,
        separator: char,
        push: impl FnMut(usize, &ByteRecord) -> Result<ControlFlow<()>>,
    ) -> Result<()> {
        each_of(&self.text, separator, self.comment, push)
    }
}

fn each_of(
    text: &str,
    separator: char,
    comment: Option<u8>,
    mut push: impl FnMut(usize, &ByteRecord) -> Result<ControlFlow<()>>,
) -> Result<()> {
    if separator == ' ' {
        return each_of_spaced(text, comment, push);
    }
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(comment)
        .delimiter(separator as u8)
        .from_reader(text.as_bytes());
    let mut record = ByteRecord::new();
    while reader.read_byte_record(&mut record).is_ok_and(|more| more) {
        // a record's position is before the blank lines and comments that the reader skips
        let position = record.position();
        let start = position.map_or(0, |p| p.byte() as usize);
        let number = position.map_or(0, |p| p.line() as usize) + skipped_lines(&text[start..], comment);
        if push(number, &record)?.is_break() {
            break;
        }
    }
    Ok(())
}

/// The same where any number of spaces stands between the cells.
fn each_of_spaced(
    text: &str,
    comment: Option<u8>,
    mut push: impl FnMut(usize, &ByteRecord) -> Result<ControlFlow<()>>,
) -> Result<()> {
    let mut record = ByteRecord::new();
    for (i, line) in text.lines().enumerate() {
        record.clear();
        line.split_whitespace().for_each(|cell| record.push_field(cell.as_bytes()));
        let is_row = !record.is_empty() && line.bytes().next() != comment;
        if is_row && push(i + 1, &record)?.is_break() {
            break;
        }
    }
    Ok(())
}

/// Lines at the beginning of a text that are no rows.
fn skipped_lines(text: &str, comment: Option<u8>) -> usize {
    let is_none = |line: &&str| {
        let line = line.trim_end_matches(['\r', '\n']);
        line.is_empty() || line.bytes().next() == comment
    };
    text.split_inclusive('\n').take_while(is_none).filter(|line| line.ends_with('\n')).count()
}

fn row(number: usize, record: &ByteRecord) -> SheetRow {
    let mut row = SheetRow { number, cells: Vec::new() };
    put(&mut row, number, record);
    row
}

/// Puts a record into a row that is there, so that no cell of a long file needs memory of its own.
pub fn put(row: &mut SheetRow, number: usize, record: &ByteRecord) {
    row.number = number;
    row.cells.resize(record.len(), Cell::Empty);
    for (place, cell) in row.cells.iter_mut().zip(record) {
        match std::str::from_utf8(cell) {
            Ok(text) => place.put(text),
            Err(_) => *place = Cell::text(&String::from_utf8_lossy(cell)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> Text {
        Text::of("a.csv", bytes).unwrap()
    }

    #[test]
    fn comments_are_counted_and_are_no_rows() {
        let rows = text(b"# logger\n\n# 2 \"channels\na,b\n1,2\n").without_comments().first_rows(',');
        let numbers: Vec<usize> = rows.iter().map(|r| r.number).collect();
        assert_eq!(numbers, [4, 5]);
    }
}
