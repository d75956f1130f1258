//! What commands print: tables for people, one JSON object for programs, progress for the patient.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::report::{Section, page};

/// Prints one JSON object on standard output.
pub fn json(value: &impl Serialize) -> Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}

/// A progress bar on standard error; nothing where that is not a terminal.
pub fn progress(what: &str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta} left");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_message(what.to_string());
    bar
}

/// A sign of life for work of unknown length.
pub fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    bar.set_message(what.to_string());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// Writes a report, whole or not at all.
pub fn report(path: &Path, title: &str, sections: Vec<Section>) -> Result<()> {
    let partial = path.with_extension("html.partial");
    std::fs::write(&partial, page(title, sections))
        .and_then(|()| std::fs::rename(&partial, path))
        .with_context(|| format!("{}: cannot be written", path.display()))
}
