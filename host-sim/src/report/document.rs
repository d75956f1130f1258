//! Sections, tables and figures, and the page around them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest as _, Sha256};

use super::chart::Chart;
use super::story::Story;

const STYLE: &str = include_str!("style.css");
/// The library that draws, and what uses it.
const SCRIPTS: [&str; 2] = [
    include_str!("library/echarts.js"),
    concat!("\"use strict\";\n", include_str!("script/options.js"), include_str!("script/page.js")),
];

/// The browser fetches nothing at all, and runs nothing but the page's own scripts.
fn policy() -> String {
    let hash = |script: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(script)));
    let scripts = SCRIPTS.map(hash).join(" ");
    format!("default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {scripts}")
}

/// A part of a report under its own heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
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
    pub drawing: Drawing,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// Drawn by the page's script.
    Chart(Chart),
    /// Drawn already.
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
pub struct Table {
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

/// A whole HTML file that needs nothing but itself. `glossary` says which words of its text are to be explained, and how.
pub fn page(
    title: &str,
    story: Option<&Story>,
    sections: &[Section],
    glossary: impl Fn(&str) -> Vec<(String, String)>,
) -> String {
    let body = html! {
        @if let Some(story) = story { (story.markup()) }
        @if sections.len() > 1 {
            nav aria-label="Contents" {
                ul {
                    @for s in sections {
                        li { a href={ "#section-" (identifier(&s.heading)) } { (s.heading) } }
                    }
                }
            }
        }
        @for s in sections { (s.markup()) }
    };
    let body = body.into_string();
    let words = glossary(&body);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy());
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                (PreEscaped(body))
                @if !words.is_empty() {
                    details class="glossary" {
                        summary { "What the words mean" }
                        dl { @for (word, meaning) in &words { dt { (word) } dd { (meaning) } } }
                    }
                }
                @if story.is_some() || sections.iter().any(Section::is_drawn) {
                    @for script in SCRIPTS { script { (PreEscaped(script)) } }
                }
            }
        }
    };
    markup.into_string()
}

impl Section {
    /// Whether the page's script draws something of it.
    fn is_drawn(&self) -> bool {
        self.figures.iter().any(|f| matches!(f.drawing, Drawing::Chart(_)))
    }

    fn markup(&self) -> Markup {
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
    pub(super) fn markup(&self) -> Markup {
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

impl Table {
    fn markup(&self) -> Markup {
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
        let text = page("1 < 2", None, &[section], |_| Vec::new());
        assert!(!text.contains("<script") && !text.contains("<td><b>"), "no figure, no script");
        assert!(text.contains("a &amp; b") && text.contains("<title>1 &lt; 2</title>"));
    }

    #[test]
    fn identifiers_are_letters_digits_and_hyphens() {
        assert_eq!(identifier("Bode, run “day 126”"), "bode-run-day-126");
    }
}
