//! What a file holds before anybody knows what it means: rows of cells.

use jiff::civil::DateTime;

#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    Empty,
    Text(String),
    Number(f64),
    /// A calendar time without a zone, as spreadsheets have them.
    Time(DateTime),
}

impl Cell {
    /// Text without space around it; nothing is an empty cell.
    pub fn text(text: &str) -> Self {
        let mut cell = Self::Empty;
        cell.put(text);
        cell
    }

    /// The same, in place of what was there.
    pub fn put(&mut self, text: &str) {
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        match self {
            _ if text.is_empty() => *self = Self::Empty,
            Self::Text(place) => {
                place.clear();
                place.push_str(text);
            }
            _ => *self = Self::Text(text.into()),
        }
    }

    pub fn as_text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The text of a cell that holds a state, a number as it is written shortest.
    pub fn state(&self) -> Option<String> {
        match self {
            Self::Text(text) => Some(text.clone()),
            Self::Number(x) => Some(x.to_string()),
            Self::Empty | Self::Time(_) => None,
        }
    }

    pub fn is_empty(&self) -> bool {
        *self == Self::Empty
    }
}

/// One row, with its number in the file, from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetRow {
    pub number: usize,
    pub cells: Vec<Cell>,
}

impl SheetRow {
    pub fn cell(&self, column: usize) -> &Cell {
        self.cells.get(column).unwrap_or(&Cell::Empty)
    }

    pub fn is_blank(&self) -> bool {
        self.cells.iter().all(Cell::is_empty)
    }
}
