//! Files, messages and answers of earlier programs stay readable: `tests/compatibility` holds one of each.

mod json_keys;
mod names;
mod protocol;
mod rotor_files;
mod state_files;
mod tables;

use std::path::PathBuf;

/// A file that an earlier program wrote.
fn kept(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/compatibility").join(name)
}

/// The path of such a file as an argument.
fn argument(name: &str) -> String {
    kept(name).display().to_string()
}
