//! The glossary of the book is what `explain` prints, and every page links each term to it at its first use.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use pulldown_cmark::{Event, Options, Parser as Markdown, Tag, TagEnd};
use serde_json::Value;

use super::links::anchor;
use super::repository;
use crate::program::{json, rotor_edge};

/// Terms that are ordinary words as well: a page links them where they are meant, and no test can tell.
const ORDINARY_WORDS: [&str; 4] = ["feature", "interval", "evidence", "lag"];

fn groups() -> Vec<(String, Vec<String>)> {
    let Value::Object(groups) = json(&rotor_edge(&["explain", "--json"])) else { panic!("an object") };
    let words = |list: &Value| {
        list.as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    groups.iter().map(|(name, list)| (name.clone(), words(list))).collect()
}

/// The page, made from the answers of `explain`.
fn made() -> String {
    let mut page = String::from(
        "# Glossary\n\nThe words that the program and this book use. `rotor-edge explain WORD` prints the same entry.\n",
    );
    for title in ["terms", "verdicts", "effects", "states", "reasons"] {
        let (_, mut words) = groups().into_iter().find(|(name, _)| name == title).unwrap();
        words.sort_by_key(|word| word.to_lowercase());
        let heading = title[..1].to_uppercase() + &title[1..];
        write!(page, "\n## {heading}\n").unwrap();
        for word in words {
            let answer = json(&rotor_edge(&["explain", &word, "--json"]));
            // a reason that is a term as well is explained there
            if title == "reasons" && answer["kind"] != "reason of a state" {
                continue;
            }
            let paragraphs = answer["means"].as_array().unwrap().iter();
            let means = paragraphs.map(|p| p.as_str().unwrap()).collect::<Vec<_>>().join("\n");
            write!(page, "\n### {word}\n\n{means}\n").unwrap();
            let next = answer["next"].as_str().unwrap();
            if !next.is_empty() {
                write!(page, "\n*What to do:* {next}\n").unwrap();
            }
        }
    }
    page
}

#[test]
fn glossary_of_book_is_what_explain_prints() {
    let path = repository().join("docs/glossary.md");
    let made = made();
    if std::env::var("ROTOR_EDGE_GOLDEN").is_ok_and(|value| value == "accept") {
        fs::write(&path, &made).unwrap();
    }
    assert!(
        fs::read_to_string(&path).unwrap() == made,
        "docs/glossary.md is not what `explain` prints; ROTOR_EDGE_GOLDEN=accept with this test writes it"
    );
}

/// Where a text has a term as a word of its own, with or without an s.
fn position(text: &str, term: &str) -> Option<usize> {
    let is_part = |c: char| c.is_alphanumeric() || c == '-';
    text.match_indices(term).map(|(at, _)| at).find(|at| {
        let (before, after) = (&text[..*at], &text[at + term.len()..]);
        let after = after.strip_prefix('s').unwrap_or(after);
        !before.ends_with(is_part) && !after.starts_with(is_part)
    })
}

/// Terms whose first use on a page is no link to the glossary.
fn unlinked(page: &str, mut terms: Vec<String>) -> Vec<String> {
    let mut missing = Vec::new();
    let (mut skipped, mut linked) = (0, None);
    for event in Markdown::new_ext(page, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Heading { .. } | Tag::CodeBlock(_) | Tag::Image { .. }) => skipped += 1,
            Event::End(TagEnd::Heading(_) | TagEnd::CodeBlock | TagEnd::Image) => skipped -= 1,
            Event::Start(Tag::Link { dest_url, .. }) => linked = Some(dest_url.to_string()),
            Event::End(TagEnd::Link) => linked = None,
            Event::Text(text) if skipped == 0 => {
                let text = text.to_lowercase();
                terms.retain(|term| {
                    if position(&text, &term.to_lowercase()).is_none() {
                        return true;
                    }
                    match &linked {
                        // the text of another link is a title
                        Some(link) if !link.contains("glossary.md#") => return true,
                        Some(link) => assert!(link.ends_with(&anchor(term)), "{term} links to {link}"),
                        None => missing.push(term.clone()),
                    }
                    false
                });
            }
            _ => {}
        }
    }
    missing
}

#[test]
fn terms_link_to_glossary_at_first_use_on_each_page() {
    let (_, terms) = groups().into_iter().find(|(name, _)| name == "terms").unwrap();
    let terms: Vec<String> =
        terms.into_iter().filter(|term| !ORDINARY_WORDS.contains(&term.as_str())).collect();
    assert!(terms.len() > 25, "{terms:?}");
    let docs = fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let is_page = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.ends_with(".md") && name != "SUMMARY.md" && name != "glossary.md"
    };
    let pages = docs.filter(is_page).chain([repository().join("README.md")]);
    let mut missing = Vec::new();
    for path in pages {
        let name = path.file_name().unwrap().display();
        for term in unlinked(&fs::read_to_string(&path).unwrap(), terms.clone()) {
            missing.push(format!("{name}: [{term}](glossary.md#{})", anchor(&term)));
        }
    }
    assert!(missing.is_empty(), "link the first use of these terms:\n{}", missing.join("\n"));
    assert_eq!(unlinked("A residual is a [residual](x.md).", vec!["residual".into()]), ["residual"]);
}
