//! Tells the program its version, and the commit where that is known: of a clone by git, of a packed crate by cargo.

use std::path::Path;
use std::process::Command;

/// Cargo writes the commit into a crate that it packs.
const PACKED: &str = ".cargo_vcs_info.json";
/// Digits that tell a commit from others.
const DIGITS: usize = 12;

fn main() {
    let commit = match Path::new(PACKED).exists() {
        true => packed(),
        // a repository around somebody else's copy of the crate says nothing of it
        false => Path::new("../.git").exists().then(cloned).flatten(),
    };
    let commit = commit.map_or(String::new(), |commit| format!(" ({commit})"));
    println!("cargo::rustc-env=ROTOR_EDGE_VERSION={}{commit}", env!("CARGO_PKG_VERSION"));
}

fn packed() -> Option<String> {
    println!("cargo::rerun-if-changed={PACKED}");
    let text = std::fs::read_to_string(PACKED).ok()?;
    let (_, sha) = text.split_once("\"sha1\"")?;
    let digits = sha.chars().skip_while(|c| !c.is_ascii_hexdigit()).take(DIGITS);
    Some(digits.collect())
}

fn cloned() -> Option<String> {
    // both change with every commit and checkout; one that is not there would count as changed for ever
    for file in ["HEAD", "logs/HEAD"] {
        let path = git(&["rev-parse", "--git-path", file])?;
        if Path::new(&path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    git(&["rev-parse", &format!("--short={DIGITS}"), "HEAD"])
}

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
}
