//! Tables in text, with a separator between the cells.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use anyhow::{Result, bail};

use super::super::encoding::decoded;
use super::super::sheet::{Cell, SheetRow};

/// Rows in which the header is looked for.
const LOOKED_AT: usize = 200;

/// Bytes of a cell; one that is longer is no name, number or remark, but a file of another kind.
const LONGEST_CELL: usize = 100_000;

/// Bytes of a block of rows, roughly: little beside a file, and long enough for a thread.
const BLOCK_BYTES: usize = 1 << 20;

/// A table in text, before it is cut into cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    pub file: String,
    text: String,
    /// Lines that begin with it are no rows.
    comment: Option<u8>,
    /// Start of each block, bytes, and the number of its first line; computed once.
    blocks: OnceLock<Vec<(usize, usize)>>,
}

/// What takes a row.
pub type Push<'p, 'a> = &'p mut dyn FnMut(&SheetRow<'a>) -> Result<ControlFlow<()>>;

impl Text {
    /// Decodes the bytes of a file.
    ///
    /// # Errors
    /// If they are no text in any of the encodings.
    pub fn of(file: &str, bytes: Vec<u8>) -> Result<Self> {
        match decoded(bytes) {
            Some(text) => Ok(Self { file: file.into(), text, comment: None, blocks: OnceLock::new() }),
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
    pub fn first_rows<'a>(&'a self, separator: char) -> Vec<SheetRow<'a>> {
        let end = self.text.match_indices('\n').nth(LOOKED_AT).map_or(self.text.len(), |(i, _)| i + 1);
        let mut rows = Vec::new();
        let first = Block { text: &self.text[..end], line: 1, comment: self.comment };
        // what is called has no errors
        let _ = first.each(separator, &mut |row| {
            rows.push(row.clone());
            Ok(ControlFlow::Continue(()))
        });
        rows
    }

    /// Comments among the first lines, without what they begin with.
    pub fn comments(&self) -> Vec<SheetRow<'_>> {
        let is = |line: &&str| self.comment.is_some() && line.as_bytes().first() == self.comment.as_ref();
        let row = |line| SheetRow { number: 0, cells: vec![Cell::text(str::trim_start_matches(line, '#'))] };
        self.first_lines().filter(is).map(row).collect()
    }

    /// Blocks of whole rows. Only behind the last quotation mark does every end of a line end a row.
    pub fn blocks(&self) -> impl Iterator<Item = Block<'_>> {
        let all = self.blocks.get_or_init(|| self.begins());
        all.iter().enumerate().map(|(i, (begin, line))| {
            let end = all.get(i + 1).map_or(self.text.len(), |(end, _)| *end);
            Block { text: &self.text[*begin..end], line: *line, comment: self.comment }
        })
    }

    fn begins(&self) -> Vec<(usize, usize)> {
        let bytes = self.text.as_bytes();
        let quoted = self.text.rfind('"').map_or(0, |last| last + 1);
        let (mut all, mut line) = (vec![(0, 1)], 1);
        let mut least = BLOCK_BYTES.max(quoted);
        while let Some(end) = bytes.get(least..).and_then(|rest| rest.iter().position(|b| *b == b'\n')) {
            let (from, begin) = (all[all.len() - 1].0, least + end + 1);
            line += lines(&bytes[from..begin]);
            all.push((begin, line));
            least = begin + BLOCK_BYTES;
        }
        all
    }

    /// No fewer than it has rows.
    pub fn most_rows(&self) -> usize {
        let last = self.blocks().last();
        last.map_or(0, |block| block.line + lines(block.text.as_bytes()))
    }

    /// Calls `push` with each row until it breaks.
    ///
    /// # Errors
    /// Those of `push`.
    pub fn each<'a>(&'a self, separator: char, push: Push<'_, 'a>) -> Result<()> {
        for block in self.blocks() {
            if block.each(separator, push)?.is_break() {
                break;
            }
        }
        Ok(())
    }
}

/// Consecutive rows of a text.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    text: &'a str,
    /// Number of its first line, from 1.
    line: usize,
    comment: Option<u8>,
}

impl<'a> Block<'a> {
    /// Calls `push` with each row until it breaks.
    ///
    /// # Errors
    /// Those of `push`.
    pub fn each(self, separator: char, push: Push<'_, 'a>) -> Result<ControlFlow<()>> {
        if separator == ' ' {
            return self.each_spaced(push);
        }
        let Self { mut text, line, comment } = self;
        // one for all rows, since a million of them would be a million allocations
        let mut row = SheetRow { number: line, cells: Vec::new() };
        while let Some(first) = text.bytes().next() {
            row.cells.clear();
            if Some(first) == comment {
                text = text.find('\n').map_or("", |end| &text[end + 1..]);
            } else if let Some(behind) = cut(text, separator as u8, &mut row.cells) {
                // a line of nothing is none
                let is_row = !matches!(first, b'\r' | b'\n');
                if is_row && push(&row)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                text = behind;
            } else {
                return Self { text, line: row.number, comment }.each_quoted(separator, push);
            }
            row.number += 1;
        }
        Ok(ControlFlow::Continue(()))
    }

    /// The same where cells may hold quotation marks, separators and ends of lines.
    fn each_quoted(self, separator: char, push: Push<'_, 'a>) -> Result<ControlFlow<()>> {
        let Self { text, line, comment } = self;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(comment)
            .delimiter(separator as u8)
            .from_reader(text.as_bytes());
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).is_ok_and(|more| more) {
            // a record's position is before the blank lines and comments that the reader skips
            let position = record.position();
            let start = position.map_or(0, |p| p.byte() as usize);
            let before = position.map_or(1, |p| p.line() as usize) - 1;
            let number = line + before + skipped_lines(&text[start..], comment);
            if push(&SheetRow { number, cells: record.iter().map(Cell::copied).collect() })?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// The same where any number of spaces stands between the cells.
    fn each_spaced(self, push: Push<'_, 'a>) -> Result<ControlFlow<()>> {
        for (i, line) in self.text.lines().enumerate() {
            let cells: Vec<Cell> = line.split_whitespace().map(Cell::text).collect();
            let is_row = !cells.is_empty() && line.bytes().next() != self.comment;
            if is_row && push(&SheetRow { number: self.line + i, cells })?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Cuts a line into cells, and returns what follows it; nothing where a quotation mark does more than to stand at both ends
/// of a cell. A line ends as each of the usual systems ends lines.
fn cut<'a>(text: &'a str, separator: u8, cells: &mut Vec<Cell<'a>>) -> Option<&'a str> {
    let bytes = text.as_bytes();
    let is_end = |b: u8| b == separator || b == b'\n' || b == b'\r';
    let mut from = 0;
    loop {
        let end = if bytes.get(from) == Some(&b'"') {
            let quoted = bytes[from + 1..].iter().position(|b| *b == b'"' || *b == b'\n')?;
            let end = from + 1 + quoted + 1;
            if bytes[end - 1] != b'"' || bytes.get(end).is_some_and(|b| !is_end(*b)) {
                return None;
            }
            cells.push(Cell::text(&text[from + 1..end - 1]));
            end
        } else {
            let length = bytes[from..].iter().position(|b| is_end(*b) || *b == b'"');
            let end = length.map_or(bytes.len(), |length| from + length);
            if bytes.get(end) == Some(&b'"') {
                return None;
            }
            cells.push(Cell::text(&text[from..end]));
            end
        };
        from = end + 1;
        match bytes.get(end) {
            None => return Some(""),
            Some(b'\n') => return Some(&text[from..]),
            Some(b'\r') => return Some(text[from..].strip_prefix('\n').unwrap_or(&text[from..])),
            Some(_) => (),
        }
    }
}

/// Ends of lines in a text.
fn lines(bytes: &[u8]) -> usize {
    // a sum of 255 bytes fits into a byte, so that a processor adds many at once
    let of = |byte: u8| -> usize {
        let of_chunk = |chunk: &[u8]| chunk.iter().fold(0, |n: u8, b| n.wrapping_add(u8::from(*b == byte)));
        bytes.chunks(255).map(|chunk| usize::from(of_chunk(chunk))).sum()
    };
    let is_pair = |pair: &&[u8]| *pair == b"\r\n";
    let (returns, feeds) = (of(b'\r'), of(b'\n'));
    // a carriage return alone ends a line as well
    if returns == 0 { feeds } else { feeds + returns - bytes.windows(2).filter(is_pair).count() }
}

/// Lines at the beginning of a text that are no rows.
fn skipped_lines(text: &str, comment: Option<u8>) -> usize {
    let is_none = |line: &&str| {
        let line = line.trim_end_matches(['\r', '\n']);
        line.is_empty() || line.bytes().next() == comment
    };
    text.split_inclusive('\n').take_while(is_none).filter(|line| line.ends_with('\n')).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> Text {
        Text::of("a.csv", bytes.to_vec()).unwrap()
    }

    #[test]
    fn comments_are_counted_and_are_no_rows() {
        let text = text(b"# logger\n\n# 2 \"channels\na,b\n1,2\n").without_comments();
        let numbers: Vec<usize> = text.first_rows(',').iter().map(|r| r.number).collect();
        assert_eq!(numbers, [4, 5]);
    }

    fn cells(text: &Text, separator: char) -> Vec<(usize, Vec<String>)> {
        let mut all = Vec::new();
        text.each(separator, &mut |row| {
            let cells = row.cells.iter().map(|cell| cell.as_text().unwrap_or_default().to_string());
            all.push((row.number, cells.collect()));
            Ok(ControlFlow::Continue(()))
        })
        .unwrap();
        all
    }

    #[test]
    fn rows_of_all_line_ends_and_quotes_equal_those_of_csv() {
        let lines = [
            "a,b,c",
            "1,2,3",
            "\"1\",\" 2 \",\"\"",
            " 4 ,,",
            "",
            "5",
            "x\"y,\"7\",8",
            "\"a,b\",c\"",
            "9,10,11",
        ];
        let quoted = "1,2\n\"two\nlines, \"\"quoted\"\"\",4\n\n5,6\n";
        let texts = ["\n", "\r\n"].map(|end| lines.join(end)).into_iter().chain([quoted.to_string()]);
        for of in texts {
            let mut reader =
                csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(of.as_bytes());
            let expected: Vec<Vec<String>> = reader
                .records()
                .map(|record| record.unwrap().iter().map(|cell| cell.trim().to_string()).collect())
                .collect();
            let read = cells(&text(of.as_bytes()), ',');
            assert_eq!(read.iter().map(|(_, cells)| cells.clone()).collect::<Vec<_>>(), expected, "{of:?}");
            for (number, cells) in read {
                let line = of.lines().nth(number - 1).unwrap();
                let first = line.split([',', '"']).find(|part| !part.trim().is_empty()).unwrap_or_default();
                assert!(cells.concat().contains(first.trim()), "row {number} of {of:?}: {cells:?}");
            }
        }
        let old = cells(&text(b"a;b\r1;2\r\r3;4"), ';');
        assert_eq!(old.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [1, 2, 4]);
    }

    #[test]
    fn blocks_of_a_long_text_hold_all_rows_with_their_numbers() {
        let line = |n: usize| format!("{n},{}\r\n", n as f64 / 7.0);
        for head in ["n,x\n", "\"n\nof\",x\n"] {
            let body: String = (0..100_000).map(line).collect();
            let text = text(format!("{head}{body}").as_bytes());
            assert!(text.blocks().count() > 2, "{head}");
            let above = head.lines().count();
            for (k, (number, cells)) in cells(&text, ',').iter().skip(1).enumerate() {
                assert_eq!((*number, cells[0].as_str()), (k + above + 1, k.to_string().as_str()));
            }
        }
    }
}
