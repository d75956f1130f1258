//! The command lines of `tests/golden/commands.toml`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::tolerance::Class;

/// A part of the command lines that is run by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    Quick,
    Slow,
}

/// An output of a command that is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Output {
    /// Exit code, standard output and standard error.
    Text,
    /// Standard output of a second run, with `--json`.
    Json,
    /// Visible text of the page that `--report` writes.
    Page,
}

/// A change to a copied input file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    pub file: String,
    pub from: String,
    pub to: String,
}

/// One command line and what is recorded of it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoldenCommand {
    pub name: String,
    pub class: Class,
    /// Arguments; double quotes hold those with spaces together.
    pub run: String,
    #[serde(default = "text")]
    pub outputs: Vec<Output>,
    #[serde(default)]
    pub is_slow: bool,
    /// Files that the command writes and that are recorded.
    #[serde(default)]
    pub writes: Vec<String>,
    /// Command lines that make input files; their output is not recorded.
    #[serde(default)]
    pub before: Vec<String>,
    #[serde(default)]
    pub edits: Vec<Edit>,
    /// JSON keys, and words of lines, whose numbers are rounding errors: only growth is a difference.
    #[serde(default)]
    pub rounding: Vec<String>,
}

fn text() -> Vec<Output> {
    vec![Output::Text]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    command: Vec<GoldenCommand>,
}

impl GoldenCommand {
    pub fn group(&self) -> Group {
        if self.is_slow { Group::Slow } else { Group::Quick }
    }

    pub fn has(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}

/// The repository's folder.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the repository")
}

/// The folder of the manifest and the answers.
pub fn folder() -> PathBuf {
    repository().join("tests/golden")
}

/// All command lines, in the order of the file.
pub fn read() -> Vec<GoldenCommand> {
    let path = folder().join("commands.toml");
    let manifest: Manifest = toml::from_str(&std::fs::read_to_string(&path).unwrap())
        .unwrap_or_else(|problem| panic!("tests/golden/commands.toml: {problem}"));
    let mut names = BTreeSet::new();
    for command in &manifest.command {
        assert!(names.insert(&command.name), "commands.toml: the name {} is there twice", command.name);
    }
    manifest.command
}

/// The arguments of a command line.
pub fn arguments(line: &str) -> Vec<String> {
    let mut all = Vec::new();
    for (index, part) in line.split('"').enumerate() {
        match index % 2 {
            1 => all.push(part.to_string()),
            _ => all.extend(part.split_whitespace().map(str::to_string)),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_argument_keeps_its_spaces() {
        assert_eq!(arguments("add r.toml \"seal@disk 3\" -o x"), ["add", "r.toml", "seal@disk 3", "-o", "x"]);
    }
}
