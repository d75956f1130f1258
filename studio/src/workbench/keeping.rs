//! Where a session is kept: its file, its recovery file, the session that is put aside for practice.

use std::path::Path;

use anyhow::{Context as _, Result, anyhow, bail};
use rotor_edge::command::shown;

use super::{Aside, Bench, SessionFile};
use crate::recovery::{RecoveryFile, RecoveryFolder};
use crate::session::Session;
use crate::session::stored::{self, FileLock};

impl Bench {
    /// Opens the file of a session, which is kept up to date from now on.
    ///
    /// # Errors
    /// If it is none, or another studio has it.
    pub fn open_session(&mut self, path: &Path) -> Result<()> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| anyhow!("{name}: cannot be read ({e})"))?;
        let lock = self.lock_of_session(path)?;
        self.begin(stored::parse(&name, &text)?)?;
        self.file = Some(SessionFile { path: path.into(), _lock: lock });
        Ok(())
    }

    /// Keeps the session in a file from now on.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_session_in(&mut self, path: &Path) -> Result<()> {
        let lock = self.lock_of_session(path)?;
        stored::write(path, self.opened()?)?;
        self.file = Some(SessionFile { path: path.into(), _lock: lock });
        self.opened_mut()?.is_changed = false;
        self.not_saved = None;
        if let Some(recovery) = self.recovery.take() {
            recovery.delete();
        }
        Ok(())
    }

    /// A lock of the file of a session; what this studio has already is let go first.
    fn lock_of_session(&mut self, path: &Path) -> Result<FileLock> {
        if self.file.as_ref().is_some_and(|file| file.path == path) {
            self.file = None;
        }
        FileLock::of(path)
    }

    /// Where the session is kept.
    pub fn session_file(&self) -> Option<&Path> {
        self.file.as_ref().map(|file| file.path.as_path())
    }

    /// Brings the session's file up to date, or its recovery file while it has none.
    pub(super) fn save_session(&mut self) {
        let Some(session) = self.session.as_mut().filter(|session| session.is_changed) else { return };
        let written = match &self.file {
            Some(file) => stored::write(&file.path, session).map(|()| session.is_changed = false),
            None => keep_for_recovery(self.recovery_folder.as_ref(), &mut self.recovery, session),
        };
        self.not_saved = written.err().map(|error| shown(&error));
    }

    /// Keeps sessions without a file in this folder, and looks for those that were left behind there.
    pub fn recover_from(&mut self, folder: RecoveryFolder) {
        self.offers = folder.offers();
        self.recovery_folder = Some(folder);
    }

    /// Another session begins: the one before stays in its recovery file, and is offered again.
    pub(super) fn leave_behind(&mut self) {
        let before = [self.recovery.take(), self.aside.take().and_then(|aside| aside.recovery)];
        if before.iter().any(Option::is_some) {
            drop(before);
            self.look_for_offers();
        }
    }

    /// Begins a session in whose machine something is hidden; the one before is put aside, unless it is one for practice too.
    ///
    /// # Errors
    /// As [`Self::begin`]; what was open stays so.
    pub fn practise(&mut self, hidden: Session) -> Result<()> {
        let is_real = self.session.as_ref().is_some_and(|session| session.practice.is_none());
        let session = self.session.clone().filter(|_| is_real);
        let analysis = Self::first_analysis(&hidden)?;
        let aside = match session {
            Some(session) => Some(Aside { session, file: self.file.take(), recovery: self.recovery.take() }),
            None => self.aside.take(),
        };
        self.leave_behind();
        self.locks.clear();
        self.open(hidden, analysis);
        self.aside = aside;
        Ok(())
    }

    /// Goes back to the session that was put aside.
    ///
    /// # Errors
    /// If there is none, or another studio has opened its files meanwhile.
    pub fn end_practice(&mut self) -> Result<()> {
        let aside = self.aside.take().context("no measurements were open before this machine; open some")?;
        if let Err(error) = self.begin(aside.session.clone()) {
            self.aside = Some(aside);
            return Err(error);
        }
        (self.file, self.recovery) = (aside.file, aside.recovery);
        Ok(())
    }

    /// Whether a session was put aside.
    pub fn is_practising(&self) -> bool {
        self.aside.is_some()
    }

    fn look_for_offers(&mut self) {
        self.offers = self.recovery_folder.iter().flat_map(RecoveryFolder::offers).collect();
    }

    fn recovery_folder(&self) -> Result<&RecoveryFolder> {
        self.recovery_folder.as_ref().context("this computer names no folder for recovery")
    }

    /// Goes on with a session that was left behind.
    ///
    /// # Errors
    /// If another studio has it, or it cannot be read; its file stays.
    pub fn recover(&mut self, name: &str) -> Result<()> {
        let (session, file) = self.recovery_folder()?.take(name)?;
        self.begin(session)?;
        self.recovery = Some(file);
        self.look_for_offers();
        Ok(())
    }

    /// Deletes a session that was left behind.
    ///
    /// # Errors
    /// If another studio has it, or it cannot be deleted.
    pub fn dismiss(&mut self, name: &str) -> Result<()> {
        self.recovery_folder()?.dismiss(name)?;
        self.look_for_offers();
        Ok(())
    }

    /// Whether the session is changed, has no file, and is kept for the next start.
    pub fn is_kept_for_recovery(&self) -> bool {
        self.recovery.as_ref().is_some_and(|file| file.revision.is_some())
    }

    /// Whether a file is one that the session was read from.
    pub fn is_input(&self, path: &Path) -> bool {
        let inputs = self.session.iter().flat_map(|s| s.files.paths.iter().flatten());
        let same = |a: &Path, b: &Path| match (std::fs::canonicalize(a), std::fs::canonicalize(b)) {
            (Ok(a), Ok(b)) => a == b,
            _ => a == b,
        };
        inputs.into_iter().any(|input| same(input, path))
    }

    /// Whether the session may write a file.
    ///
    /// # Errors
    /// If it is there already and nobody said that it may be written over.
    pub fn may_write(&self, path: &Path, overwrite: bool) -> Result<()> {
        if overwrite || !path.exists() {
            return Ok(());
        }
        match self.is_input(path) {
            true => bail!("{}: the session was read from this file; expected another name", path.display()),
            false => bail!("{}: exists already, expected another name", path.display()),
        }
    }
}

/// Writes a session into its recovery file, which it gets with its first change.
fn keep_for_recovery(
    folder: Option<&RecoveryFolder>,
    file: &mut Option<RecoveryFile>,
    session: &Session,
) -> Result<()> {
    let Some(folder) = folder else { return Ok(()) };
    let file = match file {
        Some(file) => file,
        None => file.insert(folder.new_file()?),
    };
    file.write(session).context("the session is not kept for recovery, save it")
}
