//! The browser that pages are looked at with.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::repository;

/// Flags of a fresh browser that loads nothing by itself.
pub const FLAGS: [&str; 9] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
];

/// Path of the browser, installed if need be; without one, says that these `tests` did not run.
///
/// # Panics
/// If there is none and `CI` is set.
pub fn find(tests: &str) -> Option<PathBuf> {
    // once for all tests, which run side by side: it may have to be installed
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let output = Command::new(repository("tests/report/browser")).output().expect("bash is there");
        let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_string();
        if output.status.success() { Ok(said(&output.stdout).into()) } else { Err(said(&output.stderr)) }
    });
    match found {
        Ok(path) => Some(path.clone()),
        Err(why) => {
            assert!(std::env::var_os("CI").is_none(), "no browser: {why}");
            // what a test prints is not shown where it passes, unless it is written so
            let said = format!("NOT RUN, {tests}: {why}\n");
            std::io::stderr().write_all(said.as_bytes()).expect("stderr is there");
            None
        }
    }
}
