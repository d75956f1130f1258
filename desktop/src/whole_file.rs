//! Files that are written whole or not at all, and that are on the disk once that is said.

use std::fs::{File, Permissions};
use std::io::{self, Read as _};
use std::path::Path;

use crate::error::Error;

/// Bytes of a drawing, at most: its parser takes up to fifty times as much memory.
const LONGEST_DRAWING: usize = 8 << 20;
/// Readable by all that the user's mask lets read.
const USUAL_MODE: u32 = 0o666;

/// Writes beside the old file under a name of its own, flushes that to the disk, renames it over the old one, and flushes
/// the folder: whenever the power goes, the old file is there or the new one.
///
/// # Errors
/// As [`check_target`], and if the disk takes it not.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_with(path, |file| file.write_all(bytes))
}

/// The same, of what `put` writes piece by piece.
///
/// # Errors
/// As [`write()`], and those of `put`.
pub fn write_with(path: &Path, put: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> Result<(), Error> {
    check_target(path)?;
    replace(path, put)
        .map_err(|e| Error::file(&path.display().to_string(), format!("cannot be written ({e})")))
}

/// The text of a drawing: a rotor file, a table beside it, or a rotor of another program.
///
/// # Errors
/// If it cannot be read, is no text, or is too long for a parser.
pub fn read_drawing(path: &Path) -> Result<String, Error> {
    let refused = |what: String| Error::file(&path.display().to_string(), what);
    let unread = |e: io::Error| refused(format!("cannot be read ({e})"));
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unread)?;
    file.take(LONGEST_DRAWING as u64 + 1).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() > LONGEST_DRAWING {
        let most = LONGEST_DRAWING >> 20;
        return Err(refused(format!("is longer than {most} MB, expected a drawing of {most} MB at most")));
    }
    io::read_to_string(&bytes[..]).map_err(unread)
}

/// Whether a file can be written there: its folder exists, and what bears its name, if anything does, is a file and
/// neither a device nor a link.
///
/// # Errors
/// One sentence that says what is there instead.
pub fn check_target(path: &Path) -> Result<(), Error> {
    let refused = |what: String| Err(Error::file(&path.display().to_string(), what));
    let folder = folder_of(path);
    if !folder.is_dir() {
        return refused(format!("cannot be written (there is no folder {})", folder.display()));
    }
    match std::fs::symlink_metadata(path) {
        Ok(there) if there.is_symlink() => {
            let to = std::fs::read_link(path).unwrap_or_default();
            refused(format!("cannot be written (it is a link to {}, expected the file itself)", to.display()))
        }
        Ok(there) if there.is_dir() => refused("cannot be written (it is a folder)".into()),
        Ok(there) if !there.is_file() => {
            refused("cannot be written (it is a device, expected a file)".into())
        }
        _ => Ok(()),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn replace(path: &Path, put: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> io::Result<()> {
    let folder = folder_of(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rotor-edge-").suffix(".partial");
    let before = std::fs::metadata(path).ok().map(|there| there.permissions());
    if let Some(mode) = before.clone().or_else(usual_permissions) {
        builder.permissions(mode);
    }
    let mut file = builder.tempfile_in(folder)?;
    // the user's mask may have narrowed what the old file allowed
    if let Some(permissions) = before {
        file.as_file().set_permissions(permissions)?;
    }
    put(&mut file)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    // where folders can be opened, a rename is on the disk when they are flushed
    if cfg!(unix) {
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

#[cfg(unix)]
fn usual_permissions() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(USUAL_MODE))
}

#[cfg(not(unix))]
fn usual_permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left_in_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rotor.toml");
        write(&path, b"one").unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn drawing_is_read_up_to_the_longest_and_no_further() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rotor.toml");
        std::fs::write(&path, vec![b'#'; LONGEST_DRAWING]).unwrap();
        assert_eq!(read_drawing(&path).unwrap().len(), LONGEST_DRAWING);
        for (bytes, says) in [
            (vec![b'#'; LONGEST_DRAWING + 1], "rotor.toml: is longer than 8 MB"),
            (vec![0xFF], "rotor.toml: cannot be read (stream did not contain valid UTF-8)"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let refused = read_drawing(&path).unwrap_err().to_string();
            assert!(refused.contains(says), "{refused}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn new_file_follows_umask_and_old_file_keeps_its_mode() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let (path, usual) = (folder.path().join("new"), folder.path().join("usual"));
        write(&path, b"one").unwrap();
        std::fs::write(&usual, b"one").unwrap();
        assert_eq!(mode(&path), mode(&usual));
        std::fs::set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(mode(&path), 0o600);
    }

    #[cfg(unix)]
    #[test]
    fn links_devices_and_folders_are_refused_and_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, b"kept").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        for (path, says) in [
            (link.as_path(), "a link to"),
            (Path::new("/dev/null"), "a device"),
            (folder.path(), "a folder"),
            (&folder.path().join("none").join("x"), "there is no folder"),
        ] {
            let refused = write(path, b"new").unwrap_err().to_string();
            assert!(refused.contains(says), "{refused}");
        }
        assert_eq!(std::fs::read(&file).unwrap(), b"kept");
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
