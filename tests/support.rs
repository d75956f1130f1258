//! What several tests share: where things are in the repository.

#[path = "firmware/sample.rs"]
pub mod firmware;

use std::path::{Path, PathBuf};

/// A path inside the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the repository").join(path)
}
