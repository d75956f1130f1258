//! One spelling of each term of the glossary in terminal text, help, pages and documentation.

use std::fs;
use std::path::{Path, PathBuf};

use clap::CommandFactory as _;
use rotor_edge::command::{Cli, other_spellings_in};

use crate::golden::manifest;

/// Pages of a folder, without the change log, which quotes messages of before, and the glossary, which tells other spellings.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_page = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "md")
            && path.file_name().is_some_and(|name| name != "CHANGELOG.md" && name != "glossary.md")
    };
    entries.filter(is_page).collect()
}

/// Words of a text that are no names of columns in an export, no code and no links.
fn prose(text: &str) -> String {
    let is_code = |(k, _): &(usize, &str)| k % 2 == 1;
    let without_blocks = text.split("```").enumerate().filter(|part| !is_code(part)).map(|(_, part)| part);
    let text = without_blocks.collect::<Vec<_>>().join(" ");
    let after_target =
        |part: &str| part.split_once(')').map_or(String::new(), |(_, after)| after.to_string());
    let (first, links) = text.split_once("](").unwrap_or((&text, ""));
    let text = first.to_string() + &links.split("](").map(after_target).collect::<Vec<_>>().join(" ");
    text.split('`')
        .enumerate()
        .filter(|part| !is_code(part))
        .map(|(_, part)| part)
        .collect::<Vec<_>>()
        .join(" ")
}

#[track_caller]
fn assert_one_spelling(name: &str, text: &str) {
    let found = other_spellings_in(text);
    let advice: Vec<String> =
        found.iter().map(|(other, term)| format!("\"{other}\" for \"{term}\"")).collect();
    assert!(found.is_empty(), "{name} says {}", advice.join(", "));
}

#[test]
fn documentation_has_one_spelling_of_each_term() {
    let repository = manifest::repository();
    let folders = ["", "docs", "python", "boards"].map(|folder| repository.join(folder));
    let pages: Vec<PathBuf> = folders.iter().flat_map(|folder| pages(folder)).collect();
    assert!(pages.len() > 15, "{pages:?}");
    for page in pages {
        assert_one_spelling(&page.display().to_string(), &prose(&fs::read_to_string(&page).unwrap()));
    }
}

#[test]
fn recorded_answers_have_one_spelling_of_each_term() {
    let mut checked = 0;
    for command in manifest::read() {
        for output in ["terminal.txt", "page.txt"] {
            let path = manifest::folder().join("answers").join(&command.name).join(output);
            let Ok(text) = fs::read_to_string(path) else { continue };
            assert_one_spelling(&format!("{}/{output}", command.name), &text);
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn help_has_one_spelling_of_each_term() {
    for command in Cli::command().get_subcommands_mut() {
        let name = command.get_name().to_string();
        assert_one_spelling(&name, &command.render_long_help().to_string());
    }
}
