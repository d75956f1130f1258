//! Ctrl-C and SIGTERM, for commands that run until they are told to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};

/// A flag that rises with the first signal.
///
/// # Errors
/// If the system refuses the handler.
pub fn on_signal() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)).context("no handler for Ctrl-C")?;
    Ok(flag)
}
