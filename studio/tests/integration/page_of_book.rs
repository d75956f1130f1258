//! The command line on the page of the book starts the studio.

use std::path::Path;

use rotor_edge::sample;

use crate::program::Studio;

#[test]
fn command_line_of_book_starts_studio() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studio.md");
    let page = std::fs::read_to_string(page).unwrap();
    let starts: Vec<&str> = page.lines().filter(|line| line.starts_with("rotor-edge-studio ")).collect();
    let [line] = starts[..] else { panic!("one line that starts it: {starts:?}") };
    let words: Vec<&str> = line.split(" #").next().unwrap().split_whitespace().skip(1).collect();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rotor.toml"), sample::ROTOR).unwrap();
    std::fs::write(folder.path().join("measured.csv"), sample::RUNUP_DAY_126).unwrap();
    let studio = Studio::start(folder.path(), &words);
    assert!(studio.address.starts_with("http://127.0.0.1:"), "{}", studio.address);
}
