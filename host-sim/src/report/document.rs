//! Sections, tables and figures, and the page around them.

use maud::{DOCTYPE, PreEscaped, html};

const STYLE: &str = include_str!("style.css");
/// The browser refuses to fetch anything at all.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// A part of a report under its own heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// The heading.
    pub heading: String,
    /// What to know before the tables and figures.
    pub paragraphs: Vec<String>,
    /// Tables, before the figures.
    pub tables: Vec<Table>,
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
    pub svg: String,
}

/// A table; the first column holds names, the others numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it shows.
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

/// A whole HTML file that needs nothing but itself.
pub fn page(title: &str, sections: Vec<Section>) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                @if sections.len() > 1 {
                    nav aria-label="Contents" {
                        ul {
                            @for s in &sections {
                                li { a href={ "#section-" (identifier(&s.heading)) } { (s.heading) } }
                            }
                        }
                    }
                }
                @for s in &sections { (s.markup()) }
            }
        }
    };
    markup.into_string()
}

impl Section {
    fn markup(&self) -> maud::Markup {
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
    fn markup(&self) -> maud::Markup {
        html! {
            figure id=(self.id) {
                (PreEscaped(&self.svg))
                figcaption { b { (self.title) "." } " " (self.caption) }
            }
        }
    }
}

impl Table {
    fn markup(&self) -> maud::Markup {
        html! {
            div class="table" {
                table {
                    caption { (self.caption) }
                    thead { tr { @for name in &self.columns { th scope="col" { (name) } } } }
                    tbody {
                        @for row in &self.rows { tr { @for cell in row { td { (cell) } } } }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_files_cannot_become_markup() {
        let section = Section {
            heading: "<script>".into(),
            paragraphs: vec!["a & b".into()],
            tables: vec![Table {
                caption: "t".into(),
                columns: vec!["c".into()],
                rows: vec![vec!["<b>".into()]],
            }],
            figures: vec![],
        };
        let text = page("1 < 2", vec![section]);
        assert!(!text.contains("<script") && !text.contains("<td><b>"));
        assert!(text.contains("a &amp; b") && text.contains("<title>1 &lt; 2</title>"));
    }

    #[test]
    fn identifiers_are_letters_digits_and_hyphens() {
        assert_eq!(identifier("Bode, run “day 126”"), "bode-run-day-126");
    }
}
