//! What several tests share: where things are in the repository.

#[path = "report/chromium.rs"]
pub mod chromium;
#[path = "firmware/sample.rs"]
pub mod firmware;

use std::path::{Path, PathBuf};

use rotor_edge::edge::{EdgeModel, SHAPES};
use rotor_edge_core::model::{Description, Support};

/// A path inside the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the repository").join(path)
}

/// The items that a test takes: one of so `many` in `tests/all`, all of them in `tests/long`, which sets `ROTOR_EDGE_LONG`.
pub fn sampled<T>(many: usize, all: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    all.into_iter().step_by(if std::env::var_os("ROTOR_EDGE_LONG").is_some() { 1 } else { many })
}

/// A model with other supports.
///
/// # Panics
/// If it describes no machine.
pub fn with_supports(model: &EdgeModel, change: impl FnOnce(&mut [Support<SHAPES>])) -> EdgeModel {
    let description = model.description();
    let mut supports = description.supports.to_vec();
    change(&mut supports);
    EdgeModel::new(&Description { supports: &supports, ..description }).expect("a machine")
}
