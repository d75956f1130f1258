//! The pages for people: their commands run, their links lead somewhere, their terms and sentences keep to one style.

mod commands;
mod examples;
mod glossary;
mod links;
mod recording;
mod sentences;
mod sessions;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pulldown_cmark::{CodeBlockKind, Event, Parser as Markdown, Tag, TagEnd};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// Every page that is for people.
fn pages() -> Vec<PathBuf> {
    let is_page = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "md");
    let folders = [
        "",
        "docs",
        "boards",
        "boards/nucleo-g474re",
        "boards/emulated-g474",
        "python",
        "tests/kits",
        "tests/machines",
    ];
    let of_folder = |folder: &&str| {
        let entries = fs::read_dir(repository().join(folder)).unwrap();
        entries.map(|entry| entry.unwrap().path()).filter(is_page).collect::<Vec<_>>()
    };
    folders.iter().flat_map(of_folder).collect()
}

/// Blocks of code with their language.
fn blocks(page: &str) -> Vec<(String, String)> {
    let mut all = Vec::new();
    let mut within: Option<(String, String)> = None;
    for event in Markdown::new(page) {
        match event {
            Event::Start(Tag::CodeBlock(kind)) => {
                let language = if let CodeBlockKind::Fenced(language) = kind {
                    language.to_string()
                } else {
                    String::new()
                };
                within = Some((language, String::new()));
            }
            Event::Text(text) => {
                if let Some((_, block)) = &mut within {
                    block.push_str(&text);
                }
            }
            Event::End(TagEnd::CodeBlock) => all.extend(within.take()),
            _ => {}
        }
    }
    all
}

#[test]
fn complete_small_file_of_the_docs_is_checked() {
    let page = fs::read_to_string(repository().join("docs/ten-minutes.md")).unwrap();
    let all = blocks(&page);
    let (_, small) = all.iter().find(|(language, _)| language == "toml file=fan.toml").unwrap();
    assert!(small.lines().count() <= 14, "{small}");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("fan.toml"), small).unwrap();
    let program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
        .args(["check", "fan.toml", "--report", "check.html"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&program.stdout);
    assert!(program.status.success(), "{}", String::from_utf8_lossy(&program.stderr));
    assert!(said.starts_with("Stable from"), "the answer comes first: {said}");
    let page = fs::read_to_string(folder.path().join("check.html")).unwrap();
    assert!(page.contains("class=\"verdict\"") && page.contains("running range"), "no first screen");
}

#[test]
fn the_book_lists_every_page_and_the_readme_is_short() {
    let summary = fs::read_to_string(repository().join("docs/SUMMARY.md")).unwrap();
    for entry in fs::read_dir(repository().join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_chapter = name.ends_with(".md") && name != "SUMMARY.md";
        assert!(!is_chapter || summary.contains(&format!("({name})")), "{name} is not in docs/SUMMARY.md");
    }
    let lines = fs::read_to_string(repository().join("README.md")).unwrap().lines().count();
    assert!(lines < 200, "{lines}");
}
