//! The worked examples of CONTRIBUTING.md are parts of files that are compiled and run.

use std::fs;

use super::{blocks, repository};

/// Lines without indentation and without the mark of a doc comment.
fn plain_lines(text: &str) -> Vec<&str> {
    text.lines().map(|line| line.trim_start().trim_start_matches("//!").trim()).collect()
}

#[test]
fn worked_examples_are_parts_of_compiled_files() {
    let page = fs::read_to_string(repository().join("CONTRIBUTING.md")).unwrap();
    let mut files = Vec::new();
    for (language, block) in blocks(&page) {
        let Some(file) = language.strip_prefix("rust file=") else { continue };
        let source = fs::read_to_string(repository().join(file)).unwrap();
        let (source, excerpt) = (plain_lines(&source), plain_lines(&block));
        assert!(
            source.windows(excerpt.len()).any(|lines| lines == excerpt),
            "{file} has no such lines:\n{block}"
        );
        files.push(file.to_string());
    }
    let expected =
        ["desktop/src/effects", "desktop/src/bearing", "core/examples", "host-sim/src/ingest/format"];
    for (file, folder) in files.iter().zip(expected) {
        assert!(file.starts_with(folder), "{file}");
    }
    assert_eq!(files.len(), expected.len());
}
