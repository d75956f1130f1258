//! The page around a report: style, scripts and content policy.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, PreEscaped, html};
use sha2::{Digest as _, Sha256};

use super::document::{Section, identifier};
use super::story::Story;

/// Style of pages and their figures.
pub const STYLE: &str = include_str!("style.css");
/// The library that draws, and what uses it.
pub const SCRIPTS: [&str; 2] = [
    include_str!("library/echarts.js"),
    concat!("\"use strict\";\n", include_str!("script/options.js"), include_str!("script/page.js")),
];

/// The browser fetches nothing at all, and runs nothing but the page's own scripts.
fn policy() -> String {
    let hash = |script: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(script)));
    let scripts = SCRIPTS.map(hash).join(" ");
    format!("default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {scripts}")
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

#[cfg(test)]
mod tests {
    use super::super::document::PageTable;
    use super::*;

    #[test]
    fn text_from_files_cannot_become_markup() {
        let section = Section {
            heading: "<script>".into(),
            paragraphs: vec!["a & b".into()],
            tables: vec![PageTable {
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
}
