//! Tables as they stand in a text: rows of cells with at least two spaces between columns.

use std::collections::HashSet;
use std::ops::Range;

use unicode_width::UnicodeWidthChar as _;
use unicode_width::UnicodeWidthStr as _;

use super::wrap;

/// Spaces between two columns.
const GAP: usize = 2;
/// Width of a column down to which words wrap, if the column is as wide.
const LEAST_WRAPPED: usize = 8;
/// Width from which a column wraps rather than moves below.
const WIDEST_UNWRAPPED: usize = 30;
/// Lines of a cell beyond which a table of more than a few columns is parted.
const TALLEST: usize = 3;
const FEW: usize = 3;
/// Columns at most that name a row.
const MOST_NAMING: usize = 3;
/// Holds the second place of a wide character.
const SECOND_HALF: char = '\0';

/// A line, a character a column of the terminal.
type Line = Vec<char>;

pub struct Table {
    indent: usize,
    columns: Vec<TextColumn>,
    rows: usize,
}

struct TextColumn {
    /// As they stand, without the spaces at their ends, a row each.
    cells: Vec<String>,
    /// With the spaces that align them.
    aligned: Vec<String>,
    width: usize,
    /// Width that holds the longest word.
    least: usize,
    is_right_aligned: bool,
}

impl Table {
    /// The table with which the lines begin, if they do.
    pub fn at_start(lines: &[&str]) -> Option<Self> {
        let first = places(lines.first()?);
        let mut taken = taken(&first, &[]);
        let mut spans = spans(&taken);
        if spans.len() < 2 {
            return None;
        }
        let mut rows = vec![first];
        for line in &lines[1..] {
            let line = places(line);
            let alone = self::spans(&self::taken(&line, &[]));
            let taken_together = self::taken(&line, &taken);
            let together = self::spans(&taken_together);
            let is_row = match alone.len() {
                0 => false,
                1 => alone[0].start == spans[0].start && together.len() == spans.len(),
                more => together.len() >= spans.len() || together.len() >= 2 && together.len() == more,
            };
            if !is_row {
                break;
            }
            rows.push(line);
            (taken, spans) = (taken_together, together);
        }
        let columns = spans.iter().map(|span| TextColumn::of(&rows, span)).collect();
        Some(Self { indent: spans[0].start, columns, rows: rows.len() })
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Lines no wider than `columns`: with narrow gaps, else with cells that wrap, else as tables one below the other that
    /// each begin with the columns that name the row.
    pub fn fit(&self, columns: usize) -> Vec<String> {
        let all: Vec<usize> = (0..self.columns.len()).collect();
        if let Some(widths) = self.widths(&all, columns).filter(|widths| !self.is_tall(widths)) {
            return self.lines(&all, &widths);
        }
        let parts = self.parts(columns);
        let narrowest = (self.indent + 1..columns).find(|&narrow| self.parts(narrow).len() == parts.len());
        let mut lines = Vec::new();
        for part in narrowest.map_or(parts, |narrow| self.parts(narrow)) {
            if !lines.is_empty() {
                lines.push(String::new());
            }
            let widths = self.widths(&part, columns);
            let least = || part.iter().map(|&c| self.columns[c].least).collect();
            lines.extend(self.lines(&part, &widths.unwrap_or_else(least)));
        }
        lines
    }

    /// Widths with which these columns fit, the widest ones wrapped.
    fn widths(&self, chosen: &[usize], columns: usize) -> Option<Vec<usize>> {
        let mut widths: Vec<usize> = chosen.iter().map(|&c| self.columns[c].width).collect();
        let available = columns.checked_sub(self.indent + GAP * (chosen.len() - 1))?;
        while widths.iter().sum::<usize>() > available {
            let shrinkable = (0..chosen.len()).filter(|&k| widths[k] > self.columns[chosen[k]].least);
            let widest = shrinkable.max_by_key(|&k| widths[k])?;
            widths[widest] -= 1;
        }
        Some(widths)
    }

    /// Whether cells wrap to so many lines that the rows of a table with many columns are hard to follow.
    fn is_tall(&self, widths: &[usize]) -> bool {
        let is_tall = |(column, &width): (&TextColumn, &usize)| {
            (0..self.rows).any(|row| column.wrapped(row, width).len() > TALLEST)
        };
        self.columns.len() > FEW && self.columns.iter().zip(widths).any(is_tall)
    }

    /// The columns in as few parts as fit, each with the columns that name the row.
    fn parts(&self, columns: usize) -> Vec<Vec<usize>> {
        let width = |c: usize| {
            let column = &self.columns[c];
            column.width.min(WIDEST_UNWRAPPED).max(column.least)
        };
        let names: Vec<usize> = (0..self.naming()).collect();
        let first = self.indent + names.iter().map(|&c| width(c) + GAP).sum::<usize>() - GAP;
        let (mut parts, mut taken) = (vec![names.clone()], first);
        for c in names.len()..self.columns.len() {
            let last = parts.len() - 1;
            if parts[last].len() > names.len() && taken + GAP + width(c) > columns {
                parts.push(names.iter().copied().chain([c]).collect());
                taken = first + GAP + width(c);
            } else {
                parts[last].push(c);
                taken += GAP + width(c);
            }
        }
        parts
    }

    /// The first columns that tell the rows apart; one where none do.
    fn naming(&self) -> usize {
        let is_naming = |&count: &usize| {
            let names = (0..self.rows).map(|row| {
                self.columns[..count].iter().map(|column| column.cells[row].as_str()).collect::<Vec<_>>()
            });
            names.collect::<HashSet<_>>().len() == self.rows
        };
        (1..=MOST_NAMING.min(self.columns.len() - 1)).find(is_naming).unwrap_or(1)
    }

    fn lines(&self, chosen: &[usize], widths: &[usize]) -> Vec<String> {
        let mut lines = Vec::new();
        for row in 0..self.rows {
            let wrapped: Vec<Vec<String>> =
                chosen.iter().zip(widths).map(|(&c, &width)| self.columns[c].wrapped(row, width)).collect();
            let height = wrapped.iter().map(Vec::len).max().unwrap_or(0);
            for k in 0..height {
                let mut line = " ".repeat(self.indent);
                for (cell, &width) in wrapped.iter().zip(widths) {
                    let text = cell.get(k).map_or("", String::as_str);
                    line += text;
                    line += &" ".repeat((width + GAP).saturating_sub(text.width()));
                }
                lines.push(line.trim_end().to_string());
            }
        }
        lines
    }
}

impl TextColumn {
    fn of(rows: &[Line], span: &Range<usize>) -> Self {
        let slice = |row: &Line| -> Line {
            span.clone().map(|place| row.get(place).copied().unwrap_or(' ')).collect()
        };
        let slices: Vec<Line> = rows.iter().map(slice).collect();
        let blank_before = |line: &Line| line.iter().position(|&c| c != ' ');
        let blank_behind = |line: &Line| line.iter().rev().position(|&c| c != ' ');
        let is_same = |places: Vec<usize>| places.windows(2).all(|pair| pair[0] == pair[1]);
        let ends_alike = is_same(slices.iter().filter_map(blank_behind).collect());
        let begins_alike = is_same(slices.iter().filter_map(blank_before).collect());
        let aligned: Vec<String> =
            slices.iter().map(|line| line.iter().filter(|&&c| c != SECOND_HALF).collect()).collect();
        let cells: Vec<String> = aligned.iter().map(|cell| cell.trim().to_string()).collect();
        let longest = |cell: &String| wrap::words(cell).iter().map(|word| word.width()).max().unwrap_or(0);
        let least = cells.iter().map(longest).max().unwrap_or(0).max(span.len().min(LEAST_WRAPPED));
        Self { cells, aligned, width: span.len(), least, is_right_aligned: ends_alike && !begins_alike }
    }

    fn wrapped(&self, row: usize, width: usize) -> Vec<String> {
        if width >= self.width {
            return vec![self.aligned[row].clone()];
        }
        let aligned = self.aligned[row].trim_end();
        let indent = aligned.len() - aligned.trim_start().len();
        let is_indented = !self.is_right_aligned && indent <= GAP;
        let lines = wrap::paragraph(if is_indented { aligned } else { &self.cells[row] }, width, 0);
        let pad = |line: &String| if self.is_right_aligned { width.saturating_sub(line.width()) } else { 0 };
        lines.iter().map(|line| " ".repeat(pad(line)) + line).collect()
    }
}

fn places(line: &str) -> Line {
    let mut places = Line::new();
    for c in line.chars() {
        places.push(c);
        places.extend((1..c.width().unwrap_or(1)).map(|_| SECOND_HALF));
    }
    places
}

/// Whether a place holds a character, in this line or in the lines before it.
fn taken(line: &Line, before: &[bool]) -> Vec<bool> {
    let is_taken = |place: usize| {
        before.get(place).is_some_and(|&taken| taken) || line.get(place).is_some_and(|&c| c != ' ')
    };
    (0..line.len().max(before.len())).map(is_taken).collect()
}

/// Places of the columns, with gaps between them that all lines have.
fn spans(taken: &[bool]) -> Vec<Range<usize>> {
    let mut spans: Vec<Range<usize>> = Vec::new();
    for place in (0..taken.len()).filter(|&place| taken[place]) {
        match spans.last_mut().filter(|span| place < span.end + GAP) {
            Some(span) => span.end = place + 1,
            None => spans.push(place..place + 1),
        }
    }
    spans
}
