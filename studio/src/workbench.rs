//! The session of this process, and what is worked out of it in the background.

use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Result, anyhow, bail};
use rotor_edge::answers::plan::PlanAnswer;
use rotor_edge::command::shown;
use rotor_edge_desktop::plan::{PlanRequest, plan_telling};

use crate::session::analysis::{Analysis, DiagnosisState, ModelKey, SearchProgress, diagnosed};
use crate::session::stored::{self, FileLock};
use crate::session::{FittedTo, Session};

/// Models that are remembered, so that undo and redo cost nothing.
const REMEMBERED: usize = 64;

/// A model as far as it was looked at.
struct KnownModel {
    key: ModelKey,
    analysis: Arc<Analysis>,
    diagnosis: Option<DiagnosisState>,
}

/// What further measurements would tell.
#[derive(Debug, Clone)]
pub enum PlanState {
    Running(Arc<SearchProgress>),
    Found(Arc<PlanAnswer>),
    Failed(String),
}

/// Where a session is kept, while it is.
struct SessionFile {
    path: PathBuf,
    _lock: FileLock,
}

/// The session, if one is open, and what is known of it.
#[derive(Default)]
pub struct Bench {
    pub session: Option<Session>,
    known: Vec<KnownModel>,
    plan: Option<(ModelKey, PlanState)>,
    file: Option<SessionFile>,
    /// Input files that no other studio has.
    locks: Vec<FileLock>,
    /// Why the last save by itself failed.
    pub not_saved: Option<String>,
    /// Grows with every change, so that a page knows an old answer.
    pub version: u64,
}

/// The bench of this process, shared by everybody who asks.
#[derive(Clone, Default)]
pub struct Workbench(Arc<Mutex<Bench>>);

impl Workbench {
    /// The bench, for as long as nothing else is asked. Background work never waits for it while others wait for that work.
    pub fn lock(&self) -> MutexGuard<'_, Bench> {
        // every change is whole before anything can panic
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a change, saves the session where it has a file, and looks for what the current model lacks.
    ///
    /// # Errors
    /// As the change.
    pub fn change<T>(&self, change: impl FnOnce(&mut Bench) -> Result<T>) -> Result<T> {
        let mut bench = self.lock();
        let answer = change(&mut bench)?;
        bench.version += 1;
        bench.save_session();
        self.diagnose_current(&mut bench);
        Ok(answer)
    }

    /// Begins to diagnose the current model, unless that was done.
    fn diagnose_current(&self, bench: &mut Bench) {
        let Some(session) = &bench.session else { return };
        let (key, model) = (session.key(session.current()), session.model());
        let (Ok(model), Ok(_)) = (model, bench.current()) else { return };
        let Some(known) = bench.known.iter_mut().find(|k| k.key == key) else { return };
        if known.diagnosis.is_some() {
            return;
        }
        let progress = Arc::new(SearchProgress::default());
        known.diagnosis = Some(DiagnosisState::Running(progress.clone()));
        let this = self.clone();
        std::thread::spawn(move || {
            let found = match unbroken(|| diagnosed(&model, &progress)) {
                Ok(answer) => DiagnosisState::Found(Arc::new(answer)),
                Err(error) => DiagnosisState::Failed(shown(&error)),
            };
            let mut bench = this.lock();
            if let Some(known) = bench.known.iter_mut().find(|k| k.key == key) {
                known.diagnosis = Some(found);
            }
            bench.version += 1;
        });
    }

    /// Begins to plan further measurements for the current model.
    ///
    /// # Errors
    /// If no session is open.
    pub fn plan(&self) -> Result<()> {
        let mut bench = self.lock();
        let session = bench.opened()?;
        let (key, model) = (session.key(session.current()), session.model()?);
        if bench.plan.as_ref().is_some_and(|(known, _)| *known == key) {
            return Ok(());
        }
        let progress = Arc::new(SearchProgress::default());
        bench.plan = Some((key.clone(), PlanState::Running(progress.clone())));
        bench.version += 1;
        let this = self.clone();
        std::thread::spawn(move || {
            let found = match unbroken(|| planned(&model, &progress)) {
                Ok(answer) => PlanState::Found(Arc::new(answer)),
                Err(error) => PlanState::Failed(shown(&error)),
            };
            let mut bench = this.lock();
            if bench.plan.as_ref().is_some_and(|(known, _)| *known == key) {
                bench.plan = Some((key, found));
            }
            bench.version += 1;
        });
        Ok(())
    }
}

/// Work whose end somebody waits for: a fault in it is told as a failure.
fn unbroken<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let done = std::panic::catch_unwind(AssertUnwindSafe(work));
    done.unwrap_or_else(|_| bail!("a fault of the program ended this; please report it with the two files"))
}

/// What the measurements of a model, and more of them, could show.
fn planned(model: &FittedTo, progress: &SearchProgress) -> Result<PlanAnswer> {
    let mut speeds_rpm: Vec<f64> = model.readings.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let request = PlanRequest {
        speeds_rpm,
        runs: None,
        unbalance_kg_m: None,
        probability: PlanRequest::USUAL_PROBABILITY,
    };
    let tell = |done, planned| progress.tell(done, planned);
    Ok(PlanAnswer::of(&model.rotor.name, &plan_telling(&model.rotor, &request, &tell)?))
}

impl Bench {
    /// The session.
    ///
    /// # Errors
    /// If none is open.
    pub fn opened(&self) -> Result<&Session> {
        self.session.as_ref().ok_or_else(no_session)
    }

    /// The same, to be changed.
    ///
    /// # Errors
    /// If none is open.
    pub fn opened_mut(&mut self) -> Result<&mut Session> {
        self.session.as_mut().ok_or_else(no_session)
    }

    /// Begins a session; the one before is gone, unless its model cannot be fitted at all.
    ///
    /// # Errors
    /// If another studio has one of its files open, or its model cannot be fitted.
    pub fn begin(&mut self, session: Session) -> Result<()> {
        let paths = session.files.paths.iter().flatten().take(1);
        let own = |path: &&PathBuf| self.locked().contains(path);
        let (kept, new): (Vec<_>, Vec<_>) = paths.partition(own);
        let locks = new.into_iter().map(|path| FileLock::of(path)).collect::<Result<Vec<_>>>()?;
        let step = session.current().clone();
        let analysis = Analysis::of(&step.words(), &session, &session.model()?)?;
        if kept.is_empty() {
            self.locks.clear();
        }
        self.locks.extend(locks);
        (self.file, self.plan, self.not_saved) = (None, None, None);
        self.known =
            vec![KnownModel { key: session.key(&step), analysis: Arc::new(analysis), diagnosis: None }];
        self.session = Some(session);
        Ok(())
    }

    /// Files that this studio has locked: those of the session that is open.
    fn locked(&self) -> Vec<&PathBuf> {
        let paths = self.session.iter().flat_map(|s| s.files.paths.iter().flatten()).take(1);
        if self.locks.is_empty() { Vec::new() } else { paths.collect() }
    }

    /// What a step leaves of the readings.
    ///
    /// # Errors
    /// If it cannot be fitted.
    pub fn analysis(&mut self, step: &crate::session::step::Step) -> Result<Arc<Analysis>> {
        let session = self.opened()?;
        let key = session.key(step);
        if let Some(known) = self.known.iter().find(|k| k.key == key) {
            return Ok(known.analysis.clone());
        }
        let model = session.fitted_to(step)?;
        let analysis = Arc::new(Analysis::of(&step.words(), session, &model)?);
        if self.known.len() >= REMEMBERED {
            self.known.remove(0);
        }
        self.known.push(KnownModel { key, analysis: analysis.clone(), diagnosis: None });
        Ok(analysis)
    }

    /// That of the current step.
    ///
    /// # Errors
    /// As [`Self::analysis`].
    pub fn current(&mut self) -> Result<Arc<Analysis>> {
        let step = self.opened()?.current().clone();
        self.analysis(&step)
    }

    /// How far the diagnosis of a step is.
    pub fn diagnosis(&self, step: &crate::session::step::Step) -> Option<DiagnosisState> {
        let key = self.session.as_ref()?.key(step);
        self.known.iter().find(|k| k.key == key)?.diagnosis.clone()
    }

    /// How far the plan of the current model is.
    pub fn plan(&self) -> Option<PlanState> {
        let session = self.session.as_ref()?;
        let key = session.key(session.current());
        self.plan.as_ref().filter(|(known, _)| *known == key).map(|(_, state)| state.clone())
    }

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

    /// Brings the session's file up to date.
    fn save_session(&mut self) {
        let (Some(file), Some(session)) = (&self.file, &mut self.session) else { return };
        if !session.is_changed {
            return;
        }
        match stored::write(&file.path, session) {
            Ok(()) => (session.is_changed, self.not_saved) = (false, None),
            Err(error) => self.not_saved = Some(shown(&error)),
        }
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

fn no_session() -> anyhow::Error {
    anyhow!("nothing is open yet; open a rotor's file with measurements, or the sample")
}
