//! Sections, tables and figures of a page.

use maud::{Markup, PreEscaped, html};

use super::chart::Chart;

/// A part of a report under its own heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    pub heading: String,
    /// What to know before the tables and figures.
    pub paragraphs: Vec<String>,
    /// Tables, before the figures.
    pub tables: Vec<PageTable>,
    /// Figures, two in a row where there is room.
    pub figures: Vec<Figure>,
}

/// A figure with its caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of the `<figure>` element, unique in the page; see [`identifier`].
    pub id: String,
    /// What it shows, in bold before the caption.
    pub title: String,
    /// What to look for.
    pub caption: String,
    /// The drawing, from a builder of this module.
    pub drawing: Drawing,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// Drawn by the page's script.
    Chart(Chart),
    Markup(String),
}

impl From<Chart> for Drawing {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<Markup> for Drawing {
    fn from(markup: Markup) -> Self {
        Self::Markup(markup.into_string())
    }
}

/// A table; the first column holds names, the others numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct PageTable {
    pub caption: String,
    /// Names and units of the columns.
    pub columns: Vec<String>,
    /// Cells as they are printed.
    pub rows: Vec<Vec<String>>,
}

/// Lower-case letters, digits and hyphens of a text: a name for an element.
pub fn identifier(text: &str) -> String {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

impl Figure {
    /// A figure that is called by its title.
    pub fn new(title: impl Into<String>, caption: impl Into<String>, drawing: impl Into<Drawing>) -> Self {
        let title = title.into();
        Self { id: identifier(&title), title, caption: caption.into(), drawing: drawing.into() }
    }
}

impl Section {
    /// Whether the page's script draws something of it.
    pub(super) fn is_drawn(&self) -> bool {
        self.figures.iter().any(|f| matches!(f.drawing, Drawing::Chart(_)))
    }

    pub(super) fn markup(&self) -> Markup {
        html! {
            section {
                h2 id={ "section-" (identifier(&self.heading)) } { (self.heading) }
                @for text in &self.paragraphs { p { (text) } }
                @for table in &self.tables { (table.markup()) }
                @if !self.figures.is_empty() {
                    div class="figures" {
                        @for figure in &self.figures { (figure.markup()) }
                    }
                }
            }
        }
    }
}

impl Figure {
    /// The element that the page's script draws.
    pub fn markup(&self) -> Markup {
        html! {
            figure id=(self.id) class=[matches!(self.drawing, Drawing::Chart(_)).then_some("drawn")] {
                @match &self.drawing {
                    Drawing::Markup(markup) => (PreEscaped(markup)),
                    Drawing::Chart(chart) => (chart.markup(&self.title)),
                }
                figcaption { b { (self.title) "." } " " (self.caption) }
            }
        }
    }
}

impl PageTable {
    fn markup(&self) -> Markup {
        html! {
            div class="table" {
                table {
                    caption { (self.caption) }
                    thead { tr { @for name in &self.columns { th scope="col" { (name) } } } }
                    tbody {
                        @for row in &self.rows { tr { @for cell in row { td class=[is_number(cell).then_some("number")] { (cell) } } } }
                    }
                }
            }
        }
    }
}

/// Longest number with its unit or interval that is kept on one line.
const LONGEST_NUMBER: usize = 18;

/// Whether a cell is a number, with a unit or an interval behind it.
fn is_number(cell: &str) -> bool {
    let first = cell.trim_start_matches(['-', '−', '+', '±', '<']).chars().next();
    first.is_some_and(|c| c.is_ascii_digit()) && cell.chars().count() <= LONGEST_NUMBER
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_with_units_and_intervals_stay_on_one_line() {
        for cell in ["100.0 %", "−8.0 ± 0.2", "1549.8 to 1802.8", "<0.1 %", "58.10 MN/m"] {
            assert!(is_number(cell), "{cell}");
        }
        for cell in ["", "–", "the data", "+ pedestal@OB", "49.6 (at 1650; noise 3.2)"] {
            assert!(!is_number(cell), "{cell}");
        }
    }

    #[test]
    fn identifiers_are_letters_digits_and_hyphens() {
        assert_eq!(identifier("Bode, run “day 126”"), "bode-run-day-126");
    }
}
