//! The session of this process, and what is worked out of it in the background.

mod keeping;

use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Result, anyhow, bail};
use rotor_edge::answers::plan::PlanAnswer;
use rotor_edge::command::shown;
use rotor_edge_desktop::plan::{PlanRequest, plan_telling};

use crate::recovery::{Offer, RecoveryFile, RecoveryFolder};
use crate::session::analysis::{Analysis, DiagnosisState, ModelKey, SearchProgress, diagnosed};
use crate::session::stored::FileLock;
use crate::session::{FittedTo, Looking, Session};
use crate::trial::Trials;

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
    /// The diagnosis is not done, which says between what a measurement is to decide.
    Waiting,
    Running(Arc<SearchProgress>),
    Found(Arc<PlanAnswer>),
    Failed(String),
}

/// Where a session is kept, while it is.
struct SessionFile {
    path: PathBuf,
    _lock: FileLock,
}

/// A session that is put aside for practice, with where it is kept.
struct Aside {
    session: Session,
    file: Option<SessionFile>,
    recovery: Option<RecoveryFile>,
}

/// The session, if one is open, and what is known of it.
#[derive(Default)]
pub struct Bench {
    pub session: Option<Session>,
    known: Vec<KnownModel>,
    plan: Option<(ModelKey, PlanState)>,
    pub(crate) trials: Trials,
    file: Option<SessionFile>,
    /// Where sessions are kept that have no file.
    recovery_folder: Option<RecoveryFolder>,
    recovery: Option<RecoveryFile>,
    /// The session in whose machine something was hidden.
    aside: Option<Aside>,
    /// Sessions that were left behind unsaved.
    pub offers: Vec<Offer>,
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
        // a plan may wait for a model that was diagnosed while another one was looked at
        self.plan_if_diagnosed(&mut bench);
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
            this.plan_if_diagnosed(&mut bench);
            bench.version += 1;
        });
    }

    /// Plans further measurements for the current model as soon as it is diagnosed, unless that was done.
    ///
    /// # Errors
    /// If no session is open.
    pub fn plan(&self) -> Result<()> {
        let mut bench = self.lock();
        let session = bench.opened()?;
        let key = session.key(session.current());
        session.model()?;
        if bench.plan().is_some() {
            return Ok(());
        }
        bench.plan = Some((key, PlanState::Waiting));
        bench.version += 1;
        self.plan_if_diagnosed(&mut bench);
        Ok(())
    }

    /// Begins to plan further measurements for the current model, and what decides between the rivals of its diagnosis, if that is
    /// asked for and the diagnosis is done.
    fn plan_if_diagnosed(&self, bench: &mut Bench) {
        if !matches!(bench.plan(), Some(PlanState::Waiting)) || bench.is_diagnosing() {
            return;
        }
        let Some(session) = &bench.session else { return };
        let key = session.key(session.current());
        let model = match session.model() {
            Ok(model) => model,
            Err(error) => {
                bench.plan = Some((key, PlanState::Failed(shown(&error))));
                return;
            }
        };
        let between = bench.rivals();
        let progress = Arc::new(SearchProgress::default());
        bench.plan = Some((key.clone(), PlanState::Running(progress.clone())));
        let this = self.clone();
        std::thread::spawn(move || {
            let found = match unbroken(|| planned(&model, between, &progress)) {
                Ok(answer) => PlanState::Found(Arc::new(answer)),
                Err(error) => PlanState::Failed(shown(&error)),
            };
            let mut bench = this.lock();
            if bench.plan.as_ref().is_some_and(|(known, _)| *known == key) {
                bench.plan = Some((key, found));
            }
            bench.version += 1;
        });
    }
}

/// Work whose end somebody waits for: a fault in it is told as a failure.
pub(crate) fn unbroken<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let done = std::panic::catch_unwind(AssertUnwindSafe(work));
    done.unwrap_or_else(|_| bail!("a fault of the program ended this; please report it with the two files"))
}

/// What the measurements of a model, and more of them, could show, and which of them decides between some effects.
fn planned(model: &FittedTo, between: Vec<String>, progress: &SearchProgress) -> Result<PlanAnswer> {
    let mut speeds_rpm: Vec<f64> = model.readings.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let request = PlanRequest { between, ..PlanRequest::at(speeds_rpm) };
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
        let analysis = Self::first_analysis(&session)?;
        if kept.is_empty() {
            self.locks.clear();
        }
        self.locks.extend(locks);
        self.leave_behind();
        self.open(session, analysis);
        Ok(())
    }

    fn first_analysis(session: &Session) -> Result<Analysis> {
        Analysis::of(&session.current().words(), session, &session.model()?)
    }

    fn open(&mut self, session: Session, analysis: Analysis) {
        (self.file, self.plan, self.not_saved) = (None, None, None);
        let key = session.key(session.current());
        self.known = vec![KnownModel { key, analysis: Arc::new(analysis), diagnosis: None }];
        self.session = Some(session);
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
        self.remember(key, analysis.clone());
        Ok(analysis)
    }

    /// Keeps what a model leaves of the readings.
    pub(crate) fn remember(&mut self, key: ModelKey, analysis: Arc<Analysis>) {
        if self.known.iter().any(|known| known.key == key) {
            return;
        }
        if self.known.len() >= REMEMBERED {
            self.known.remove(0);
        }
        self.known.push(KnownModel { key, analysis, diagnosis: None });
    }

    /// Whether somebody still wants to look at this.
    pub(crate) fn is_looking(&self, looking: &Looking) -> bool {
        self.session.as_ref().and_then(|session| session.looking.as_ref()) == Some(looking)
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

    /// Whether the current model is being diagnosed.
    fn is_diagnosing(&self) -> bool {
        let current = self.session.as_ref().map(|session| session.current());
        matches!(current.and_then(|step| self.diagnosis(step)), Some(DiagnosisState::Running(_)))
    }

    /// Labels of the effects that the diagnosis of the current model cannot tell apart; none before it is done.
    fn rivals(&self) -> Vec<String> {
        let current = self.session.as_ref().map(|session| session.current());
        let Some(DiagnosisState::Found(found)) = current.and_then(|step| self.diagnosis(step)) else {
            return Vec::new();
        };
        let is_effect = |label: &&String| found.candidates.iter().any(|c| c.fitted.label == **label);
        let group = found.indistinguishable.first();
        let rivals: Vec<String> = group.into_iter().flatten().filter(is_effect).cloned().collect();
        if rivals.len() > 1 { rivals } else { Vec::new() }
    }

    /// How far the plan of the current model is.
    pub fn plan(&self) -> Option<PlanState> {
        let session = self.session.as_ref()?;
        let key = session.key(session.current());
        self.plan.as_ref().filter(|(known, _)| *known == key).map(|(_, state)| state.clone())
    }
}

fn no_session() -> anyhow::Error {
    anyhow!("nothing is open yet; open a rotor's file with measurements, or the sample")
}
