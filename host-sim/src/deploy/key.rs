//! A device's key as a file.

use std::path::Path;

use anyhow::{Context, Result, bail};
use rotor_edge_core::command::{KEY_BYTES, Key};

use crate::node::{from_hex, to_hex};

/// Bytes of a memory that nobody wrote a key to.
const EMPTY: [u8; 2] = [0x00, 0xff];

/// Reads a device's key: 64 hexadecimal digits.
///
/// # Errors
/// If the file is missing or holds something else, if it is an empty memory's, or if others than its owner may write
/// it.
pub fn read_key(path: &Path) -> Result<Key> {
    let text = std::fs::read_to_string(path).with_context(|| {
        format!("{}: cannot be read; `rotor-edge key -o FILE` makes a key", path.display())
    })?;
    let bytes = from_hex(text.trim()).and_then(|bytes| <[u8; KEY_BYTES]>::try_from(bytes).ok());
    let Some(bytes) = bytes else {
        bail!("{}: expected a key of {} hexadecimal digits", path.display(), 2 * KEY_BYTES);
    };
    if EMPTY.iter().any(|empty| bytes.iter().all(|byte| byte == empty)) {
        bail!("{}: expected a key made at random, as `rotor-edge key -o FILE` makes it", path.display());
    }
    check_writers(path)?;
    Ok(Key(bytes))
}

/// Who can write a key can replace it by one of his own.
#[cfg(unix)]
fn check_writers(path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    const OTHERS_WRITE: u32 = 0o022;
    if std::fs::metadata(path)?.permissions().mode() & OTHERS_WRITE != 0 {
        bail!("{}: can be written by others than its owner; chmod 600 it, or make a new key", path.display());
    }
    Ok(())
}

#[cfg(not(unix))]
fn check_writers(_: &Path) -> Result<()> {
    Ok(())
}

/// Writes a new random key, readable by its owner alone; never over an old one.
///
/// # Errors
/// If there is such a file, or it cannot be written.
pub fn write_new_key(path: &Path) -> Result<()> {
    let mut bytes = [0; KEY_BYTES];
    getrandom::fill(&mut bytes).context("the system gives no random numbers")?;
    write_secret(path, &to_hex(&bytes))
}

/// Writes a line into a new file that its owner alone reads.
///
/// # Errors
/// If the file exists or cannot be written.
pub fn write_secret(path: &Path, line: &str) -> Result<()> {
    use std::io::Write as _;
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).with_context(|| format!("{}: cannot be written", path.display()))?;
    writeln!(file, "{line}")?;
    Ok(file.sync_all()?)
}
