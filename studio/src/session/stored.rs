//! The file of a session.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use rotor_edge_desktop::whole_file;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::files::InputFiles;
use super::mask::Mask;
use super::practice::Practice;
use super::step::{Branch, Change, Step};
use super::{BRANCHES, Session};

/// What the file says that it is.
const KIND: &str = "rotor-edge studio session";
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct StoredSession {
    kind: String,
    version: u32,
    files: InputFiles,
    mask: Mask,
    branches: Vec<StoredBranch>,
    branch: usize,
    practice: Option<Practice>,
}

#[derive(Serialize, Deserialize)]
struct StoredBranch {
    at: usize,
    steps: Vec<StoredStep>,
}

#[derive(Serialize, Deserialize)]
struct StoredStep {
    change: Change,
    /// The model's file.
    file: String,
}

/// Writes a session, whole or not at all.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, session: &Session) -> Result<()> {
    let branch = |branch: &Branch| StoredBranch {
        at: branch.at(),
        steps: branch
            .all()
            .iter()
            .map(|step| StoredStep { change: step.change.clone(), file: step.file.clone() })
            .collect(),
    };
    let stored = StoredSession {
        kind: KIND.into(),
        version: VERSION,
        files: session.files.clone(),
        mask: session.mask.clone(),
        branches: session.branches.iter().map(branch).collect(),
        branch: session.branch,
        practice: session.practice.clone(),
    };
    Ok(whole_file::write(path, format!("{}\n", serde_json::to_string_pretty(&stored)?).as_bytes())?)
}

/// A session from the text of its file; `name` is only for messages.
///
/// # Errors
/// One sentence on what was expected.
pub fn parse(name: &str, text: &str) -> Result<Session> {
    let expected = || format!("{name}: expected the file of a session, which the studio writes");
    let stored: StoredSession = serde_json::from_str(text).with_context(expected)?;
    if stored.kind != KIND || stored.version != VERSION {
        bail!("{}, version {VERSION}", expected());
    }
    let (rotor, readings) = stored.files.parsed()?;
    let branch = |branch: StoredBranch| -> Result<Branch> {
        let step = |step: StoredStep| match step.change {
            Change::Given => Ok(Step::given(rotor.clone(), step.file)),
            change => Step::stored(change, step.file),
        };
        let steps: Vec<Step> = branch.steps.into_iter().map(step).collect::<Result<_>>()?;
        Branch::stored(steps, branch.at).with_context(expected)
    };
    let branches: Vec<Branch> = stored.branches.into_iter().map(branch).collect::<Result<_>>()?;
    if stored.branch >= branches.len() || branches.len() > BRANCHES.len() {
        bail!("{}, with one or two branches", expected());
    }
    let mut session = Session::of(stored.files.clone(), rotor, readings);
    (session.mask, session.practice) = (stored.mask, stored.practice);
    (session.branches, session.branch) = (branches, stored.branch);
    session.model()?;
    Ok(session)
}

/// That no other studio has a file open; held until it is dropped.
#[derive(Debug)]
pub struct FileLock {
    /// The lock ends with the handle.
    _file: File,
}

impl FileLock {
    /// Locks a file for this process, by a lock of its name in a folder of the user.
    ///
    /// # Errors
    /// If another studio has it.
    pub fn of(path: &Path) -> Result<Self> {
        let whole = whole_path(path);
        let digest = Sha256::digest(whole.as_os_str().as_encoded_bytes());
        let name: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        let folder = lock_folder();
        std::fs::create_dir_all(&folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
        let lock = folder.join(format!("{name}.lock"));
        let file = File::create(&lock).with_context(|| format!("{}: cannot be locked", path.display()))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => {
                bail!("{}: another studio has this file open; go on there, or end it first", path.display())
            }
            Err(TryLockError::Error(error)) => {
                Err(error).with_context(|| format!("{}: cannot be locked", path.display()))
            }
        }
    }
}

/// Where the locks of this user are: others may not write there.
fn lock_folder() -> PathBuf {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|folder| folder.is_dir());
    let user = std::env::var("USER").or_else(|_| std::env::var("USERNAME")).unwrap_or_default();
    let plain: String = user.chars().filter(|c| c.is_alphanumeric()).collect();
    own.unwrap_or_else(std::env::temp_dir).join(format!("rotor-edge-studio-{plain}"))
}

/// A path that is the same for every way to name the file.
fn whole_path(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_session_is_the_same_again() {
        let mut session = Session::open(InputFiles::sample()).unwrap();
        session.add("seal", Some("disk 3")).unwrap();
        session.fork();
        session.undo();
        session.mask.probes.push("15Y".into());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.json");
        write(&path, &session).unwrap();
        let again = parse("s.json", &std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(again.branches, session.branches);
        assert_eq!((again.mask, again.branch), (session.mask, session.branch));
    }

    #[test]
    fn files_that_are_no_session_are_refused() {
        for text in ["", "{}", "[1, 2]", "{\"kind\":\"other\"}"] {
            let said = parse("x.json", text).unwrap_err();
            assert!(said.to_string().starts_with("x.json: expected the file of a session"), "{said}");
        }
    }

    #[test]
    fn second_studio_on_one_file_is_refused_until_the_first_ends() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rotor.toml");
        let first = FileLock::of(&path).unwrap();
        assert!(FileLock::of(&path).unwrap_err().to_string().contains("another studio"));
        drop(first);
        FileLock::of(&path).unwrap();
    }
}
