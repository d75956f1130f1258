//! What a file holds before anybody knows what it means: rows of cells.

use std::borrow::Cow;

use jiff::civil::DateTime;

#[derive(Debug, Clone, PartialEq)]
pub enum Cell<'a> {
    Empty,
    /// Text; cells of a text file are borrowed from it, because copying each of them takes longer than reading the file.
    Text(Cow<'a, str>),
    Number(f64),
    /// A calendar time without a zone, as spreadsheets have them.
    Time(DateTime),
}

impl<'a> Cell<'a> {
    /// Text without space around it; nothing is an empty cell.
    #[inline]
    pub fn text(text: &'a str) -> Self {
        match trimmed(text) {
            "" => Self::Empty,
            text => Self::Text(Cow::Borrowed(text)),
        }
    }

    /// The same of a text that does not stay.
    pub fn copied(text: &str) -> Cell<'static> {
        Cell::text(text).into_owned()
    }

    pub fn into_owned(self) -> Cell<'static> {
        match self {
            Self::Empty => Cell::Empty,
            Self::Text(text) => Cell::Text(Cow::Owned(text.into_owned())),
            Self::Number(x) => Cell::Number(x),
            Self::Time(time) => Cell::Time(time),
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
            Self::Text(text) => Some(text.to_string()),
            Self::Number(x) => Some(x.to_string()),
            Self::Empty | Self::Time(_) => None,
        }
    }

    pub fn is_empty(&self) -> bool {
        *self == Self::Empty
    }
}

/// Without space around it. Most cells have none.
#[inline]
fn trimmed(text: &str) -> &str {
    let is_plain = |b: Option<&u8>| b.is_some_and(u8::is_ascii_graphic);
    let bytes = text.as_bytes();
    if is_plain(bytes.first()) && is_plain(bytes.last()) {
        return text;
    }
    text.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}')
}

/// One row, with its number in the file, from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetRow<'a> {
    pub number: usize,
    pub cells: Vec<Cell<'a>>,
}

impl<'a> SheetRow<'a> {
    pub fn into_owned(self) -> SheetRow<'static> {
        let Self { number, cells } = self;
        SheetRow { number, cells: cells.into_iter().map(Cell::into_owned).collect() }
    }

    #[inline]
    pub fn cell(&self, column: usize) -> &Cell<'a> {
        self.cells.get(column).unwrap_or(&Cell::Empty)
    }

    pub fn is_blank(&self) -> bool {
        self.cells.iter().all(Cell::is_empty)
    }
}
