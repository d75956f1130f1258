//! Sentences of README and book have 25 words at most.

use std::fs;

use pulldown_cmark::{Event, Options, Parser as Markdown, Tag, TagEnd};

use super::repository;

const MOST_WORDS: usize = 25;

/// Texts between block boundaries: paragraphs, items and cells. Code in a sentence counts as one word.
fn texts(page: &str) -> Vec<String> {
    let (mut all, mut text, mut skipped) = (Vec::new(), String::new(), 0);
    for event in Markdown::new_ext(page, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::CodeBlock(_) | Tag::Image { .. }) => skipped += 1,
            Event::End(TagEnd::CodeBlock | TagEnd::Image) => skipped -= 1,
            Event::End(TagEnd::Paragraph | TagEnd::Item | TagEnd::TableCell | TagEnd::Heading(_)) => {
                all.push(std::mem::take(&mut text));
            }
            Event::Text(part) if skipped == 0 => text.push_str(&part),
            Event::Code(_) if skipped == 0 => text.push_str("code"),
            Event::SoftBreak | Event::HardBreak => text.push(' '),
            _ => {}
        }
    }
    all
}

/// Sentences with more words than allowed, each with their number.
fn long(page: &str) -> Vec<(usize, String)> {
    let is_word = |word: &&&str| word.chars().any(char::is_alphanumeric);
    let mut all = Vec::new();
    for text in texts(page) {
        let words: Vec<&str> = text.split_whitespace().collect();
        for sentence in words.split_inclusive(|word| {
            let word = word.trim_end_matches([')', '"', '*']);
            word.ends_with(['.', '!', '?', ':']) && word != "al."
        }) {
            let count = sentence.iter().filter(is_word).count();
            if count > MOST_WORDS {
                all.push((count, sentence.join(" ")));
            }
        }
    }
    all
}

#[test]
fn sentences_of_book_have_at_most_25_words() {
    let docs = fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = docs.filter(|path| path.extension().is_some_and(|e| e == "md"));
    let mut all = Vec::new();
    for path in pages.chain(["README.md", "CONTRIBUTING.md"].map(|page| repository().join(page))) {
        let long = long(&fs::read_to_string(&path).unwrap());
        let name = path.file_name().unwrap().display();
        all.extend(long.into_iter().map(|(count, sentence)| format!("{name}: {count} words: {sentence}")));
    }
    assert!(all.is_empty(), "split these sentences:\n{}", all.join("\n"));
    let limit = "word ".repeat(MOST_WORDS);
    assert!(long(&format!("{}. {limit}.", limit.trim_end())).is_empty());
    assert_eq!(long(&format!("{limit} `code`.")).len(), 1);
}
