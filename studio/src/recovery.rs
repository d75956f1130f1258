//! Sessions that have no file yet: each is kept in its own recovery file, in a folder of the user, until somebody saves or dismisses
//! the session.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, Result, anyhow, bail};
use jiff::Timestamp;

use crate::session::Session;
use crate::session::stored::{self, FileLock};

/// How the names of recovery files end.
const ENDING: &str = "json";

/// A recovery file of this studio: no other one touches it.
#[derive(Debug)]
pub struct RecoveryFile {
    path: PathBuf,
    /// Of the session as it stands there; `None` before it was written.
    pub revision: Option<u64>,
    _lock: FileLock,
}

/// A session that another studio left behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offer {
    /// Name of its file, without the folder.
    pub name: String,
    pub sentence: String,
    /// Whether it can be gone on with.
    pub is_usable: bool,
}

/// The folder of recovery files.
#[derive(Debug, Clone)]
pub struct RecoveryFolder(PathBuf);

impl RecoveryFolder {
    /// That of this user; `None` where the system names no folder for a user's files.
    pub fn of_user() -> Option<Self> {
        let stated = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let usual = match std::env::consts::OS {
            "windows" => stated("LOCALAPPDATA"),
            "macos" => stated("HOME").map(|home| home.join("Library/Application Support")),
            _ => stated("HOME").map(|home| home.join(".local/state")),
        };
        let state = stated("XDG_STATE_HOME").or(usual)?;
        Some(Self(state.join("rotor-edge").join("recovery")))
    }

    #[cfg(test)]
    pub fn at(path: &Path) -> Self {
        Self(path.into())
    }

    /// A file that no other session has; nothing stands in it yet.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn new_file(&self) -> Result<RecoveryFile> {
        let folder = self.made()?;
        let mut bytes = [0; 8];
        getrandom::fill(&mut bytes).map_err(|e| anyhow!("no random numbers ({e})"))?;
        let random = u64::from_le_bytes(bytes);
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let path = folder.join(format!("{since_1970}-{random:016x}.{ENDING}"));
        Ok(RecoveryFile { _lock: FileLock::of(&path)?, path, revision: None })
    }

    /// The folder, there and by its one name.
    fn made(&self) -> Result<PathBuf> {
        let shown = || format!("{}: the folder for recovery cannot be made", self.0.display());
        std::fs::create_dir_all(&self.0).with_context(shown)?;
        std::fs::canonicalize(&self.0).with_context(shown)
    }

    /// Sessions that were left behind, the newest first; those of studios that still run are none.
    pub fn offers(&self) -> Vec<Offer> {
        let Ok(folder) = std::fs::canonicalize(&self.0) else { return Vec::new() };
        let Ok(entries) = std::fs::read_dir(&folder) else { return Vec::new() };
        let is_kept = |path: &PathBuf| path.extension().is_some_and(|end| end == ENDING);
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_kept).collect();
        let free = |path: &PathBuf| FileLock::of(path).is_ok();
        paths.retain(free);
        paths.sort();
        paths.iter().rev().filter_map(|path| offer(path)).collect()
    }

    /// A session that was left behind, with its file, which is this studio's from now on.
    ///
    /// # Errors
    /// If it is gone, another studio has it, or it cannot be read; its file stays as it is.
    pub fn take(&self, name: &str) -> Result<(Session, RecoveryFile)> {
        let (path, lock) = self.locked(name)?;
        let mut session = read(&path)?;
        session.is_changed = true;
        let revision = Some(session.revision);
        Ok((session, RecoveryFile { path, revision, _lock: lock }))
    }

    /// Deletes a session that was left behind.
    ///
    /// # Errors
    /// If another studio has it, or it cannot be deleted.
    pub fn dismiss(&self, name: &str) -> Result<()> {
        let (path, _lock) = self.locked(name)?;
        std::fs::remove_file(&path).with_context(|| format!("{}: cannot be deleted", path.display()))
    }

    fn locked(&self, name: &str) -> Result<(PathBuf, FileLock)> {
        let is_plain = Path::new(name).file_name().is_some_and(|own| own == name);
        let path = self.made()?.join(name);
        if !is_plain || !path.is_file() {
            bail!("{name}: there is no such unsaved session; load the page again");
        }
        let lock = FileLock::of(&path)?;
        Ok((path, lock))
    }
}

impl RecoveryFile {
    /// Brings it up to date.
    ///
    /// # Errors
    /// If it cannot be written; what stood there stays.
    pub fn write(&mut self, session: &Session) -> Result<()> {
        if self.revision == Some(session.revision) {
            return Ok(());
        }
        stored::write(&self.path, session)?;
        self.revision = Some(session.revision);
        Ok(())
    }

    /// Deletes it: the session is saved elsewhere.
    pub fn delete(self) {
        // if it stays it is offered once more, and nothing is lost
        let _ = std::fs::remove_file(&self.path);
    }
}

fn read(path: &Path) -> Result<Session> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| anyhow!("{name}: cannot be read ({e})"))?;
    stored::parse(&name, &text)
}

/// What is said of a file; `None` if it is gone.
fn offer(path: &Path) -> Option<Offer> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let changed = std::fs::metadata(path).and_then(|there| there.modified()).ok()?;
    let when = Timestamp::try_from(changed).ok()?.strftime("%Y-%m-%d %H:%M UTC");
    let (sentence, is_usable) = match read(path) {
        Ok(session) => {
            let files = format!("{}, {}", session.files.rotor.name, session.files.data.name);
            let step = session.current().words();
            (
                format!("An unsaved session of {files} ({step}, last changed {when}) can be gone on with."),
                true,
            )
        }
        Err(_) => {
            let what = "This version cannot read the unsaved session";
            (
                format!(
                    "{what} {} (last changed {when}); the file stays there until you delete it.",
                    path.display()
                ),
                false,
            )
        }
    };
    Some(Offer { name, sentence, is_usable })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::files::InputFiles;

    fn changed() -> Session {
        let mut session = Session::open(InputFiles::sample()).unwrap();
        session.fork();
        session
    }

    #[test]
    fn session_left_behind_is_offered_taken_and_not_offered_twice() {
        let state = tempfile::tempdir().unwrap();
        let folder = RecoveryFolder::at(&state.path().join("new/recovery"));
        assert_eq!(folder.offers(), []);
        let session = changed();
        let mut first = folder.new_file().unwrap();
        first.write(&session).unwrap();
        // its studio runs
        assert_eq!(folder.offers(), []);
        let mut second = folder.new_file().unwrap();
        second.write(&session).unwrap();
        assert_ne!(first.path, second.path);
        drop((first, second));
        let offers = folder.offers();
        assert!(offers.len() == 2 && offers.iter().all(|o| o.is_usable), "{offers:?}");
        assert!(
            offers[0].sentence.starts_with("An unsaved session of rotor.toml, runup-day126.csv (as it was")
        );
        let (taken, file) = folder.take(&offers[0].name).unwrap();
        assert!(taken.is_changed && taken.branches == session.branches);
        assert_eq!(folder.offers(), offers[1..]);
        assert!(folder.take(&offers[0].name).unwrap_err().to_string().contains("another studio"));
        file.delete();
        folder.dismiss(&offers[1].name).unwrap();
        assert_eq!(folder.offers(), []);
    }

    #[test]
    fn unreadable_recovery_files_are_named_and_stay() {
        let state = tempfile::tempdir().unwrap();
        let folder = RecoveryFolder::at(state.path());
        let old = "{\"kind\":\"rotor-edge studio session\",\"version\":0}";
        for (name, text) in [("1-bad.json", "{\"kind"), ("2-old.json", old), ("3-empty.json", "")] {
            std::fs::write(state.path().join(name), text).unwrap();
        }
        let offers = folder.offers();
        assert_eq!(offers.len(), 3);
        for offer in &offers {
            assert!(!offer.is_usable && offer.sentence.contains(&offer.name), "{offer:?}");
            assert!(folder.take(&offer.name).is_err());
            assert!(state.path().join(&offer.name).is_file());
        }
        for name in ["../1-bad.json", "none.json", ""] {
            assert!(folder.dismiss(name).unwrap_err().to_string().contains("no such unsaved session"));
        }
    }
}
