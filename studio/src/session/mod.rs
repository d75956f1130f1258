//! What is tried on a machine: its files, the steps from the model as it was given, readings that are left out, a hidden machine.
//!
//! | module | holds |
//! |---|---|
//! | [`files`] | files as they were given |
//! | [`step`] | models, each with what made it of the one before; undo and redo |
//! | [`parameters`] | numbers of a model that can be moved and held |
//! | [`mask`] | readings that are left out |
//! | [`practice`] | a machine with something hidden |
//! | [`analysis`] | what a model leaves of the readings |
//! | [`stored`] | the file of a session |

pub mod analysis;
pub mod files;
pub mod mask;
pub mod parameters;
pub mod practice;
pub mod step;
pub mod stored;

use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::{Result, anyhow, bail};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use analysis::ModelKey;
use files::InputFiles;
use mask::Mask;
use parameters::ParameterId;
use practice::{Practice, Reveal};
use step::{Branch, Step};

/// Sessions of this process so far.
static OPENED: AtomicU64 = AtomicU64::new(0);

/// Names of the branches.
pub const BRANCHES: [&str; 2] = ["A", "B"];

/// A model with the readings that it is fitted to.
#[derive(Debug, Clone)]
pub struct FittedTo {
    pub rotor: Rotor,
    pub readings: Vec<Reading>,
    pub held: Vec<ParameterId>,
}

/// An effect that somebody wants to look at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Looking {
    /// No other wish has it.
    pub number: u64,
    pub effect: String,
    pub at: Option<String>,
}

/// A session: plain data, and what is read from it.
#[derive(Debug, Clone)]
pub struct Session {
    /// No other session of this process has it.
    number: u64,
    pub files: InputFiles,
    /// The machine as it was given.
    pub given: Rotor,
    /// All readings.
    pub readings: Vec<Reading>,
    pub mask: Mask,
    pub branches: Vec<Branch>,
    pub branch: usize,
    pub practice: Option<Practice>,
    pub reveal: Option<Reveal>,
    /// An effect that is looked at before it is added.
    pub preview: Option<Step>,
    /// One that is being fitted to be looked at.
    pub looking: Option<Looking>,
    /// The current model with numbers that were moved by hand.
    pub moved: Option<Rotor>,
    /// Parameters that the next fit holds.
    pub held: Vec<ParameterId>,
    /// Whether something happened since it was saved.
    pub is_changed: bool,
    /// Grows with everything that a saved session holds.
    pub revision: u64,
}

impl Session {
    /// Begins with files.
    ///
    /// # Errors
    /// One sentence on what is wrong with them.
    pub fn open(files: InputFiles) -> Result<Self> {
        let (rotor, readings) = files.parsed()?;
        Ok(Self::of(files, rotor, readings))
    }

    fn of(files: InputFiles, given: Rotor, readings: Vec<Reading>) -> Self {
        let first = Step::given(given.clone(), files.rotor.text.clone());
        Self {
            number: OPENED.fetch_add(1, Ordering::Relaxed),
            files,
            given,
            readings,
            mask: Mask::default(),
            branches: vec![Branch::of(first)],
            branch: 0,
            practice: None,
            reveal: None,
            preview: None,
            looking: None,
            moved: None,
            held: Vec::new(),
            is_changed: false,
            revision: 0,
        }
    }

    /// Begins with a machine of these files in which something is hidden.
    ///
    /// # Errors
    /// If nothing can be hidden in it.
    pub fn hidden(files: &InputFiles, seed: u64) -> Result<Self> {
        let (rotor, readings) = files.parsed()?;
        let (files, practice) = Practice::hide(&files.rotor, &rotor, &readings, seed)?;
        Ok(Self { practice: Some(practice), ..Self::open(files)? })
    }

    pub fn current(&self) -> &Step {
        self.branches[self.branch].current()
    }

    /// A step with the readings that it is fitted to.
    ///
    /// # Errors
    /// If nothing is left to fit it to.
    pub fn fitted_to(&self, step: &Step) -> Result<FittedTo> {
        Ok(FittedTo {
            rotor: self.mask.rotor(&step.rotor, &self.given)?,
            readings: self.mask.readings(&self.given, &self.readings)?,
            held: step.held().to_vec(),
        })
    }

    /// The current one.
    ///
    /// # Errors
    /// As [`Self::fitted_to`].
    pub fn model(&self) -> Result<FittedTo> {
        self.fitted_to(self.current())
    }

    /// What tells a step with its readings from others.
    pub fn key(&self, step: &Step) -> ModelKey {
        ModelKey {
            session: self.number,
            file: step.file.clone(),
            held: step.held().to_vec(),
            mask: self.mask.clone(),
        }
    }

    /// Looks at no effect any more.
    pub fn forget_preview(&mut self) {
        (self.preview, self.looking) = (None, None);
    }

    /// Adds an effect; the one that is looked at is not fitted again.
    ///
    /// # Errors
    /// As `add`.
    pub fn add(&mut self, effect: &str, at: Option<&str>) -> Result<()> {
        let is_it = |step: &Step| {
            let change = step::Change::Added { effect: effect.into(), at: at.map(String::from) };
            step.change == change
        };
        let step = match self.preview.take().filter(is_it) {
            Some(step) => step,
            None => {
                let model = self.model()?;
                Step::adding(&model.rotor, &model.readings, effect, at)?
            }
        };
        self.take(step);
        Ok(())
    }

    fn take(&mut self, step: Step) {
        self.branches[self.branch].push(step);
        self.forget_trials();
    }

    /// Ends what is only looked at.
    fn forget_trials(&mut self) {
        self.forget_preview();
        (self.moved, self.reveal) = (None, None);
        self.held.clear();
        self.mark_changed();
    }

    fn mark_changed(&mut self) {
        self.is_changed = true;
        self.revision += 1;
    }

    pub fn undo(&mut self) {
        self.branches[self.branch].undo();
        self.forget_trials();
    }

    pub fn redo(&mut self) {
        self.branches[self.branch].redo();
        self.forget_trials();
    }

    /// Goes on in a second branch that begins as the current one is; none if there are two.
    pub fn fork(&mut self) {
        if self.branches.len() < BRANCHES.len() {
            self.branches.push(self.branches[self.branch].clone());
            self.branch = self.branches.len() - 1;
            self.forget_trials();
        }
    }

    /// Goes on in a branch.
    ///
    /// # Errors
    /// If there is none of this number.
    pub fn go_to(&mut self, branch: usize) -> Result<()> {
        if branch >= self.branches.len() {
            bail!("there is no such branch, expected one of {}", BRANCHES[..self.branches.len()].join(", "));
        }
        self.branch = branch;
        self.forget_trials();
        Ok(())
    }

    /// Leaves readings out, or takes them in again.
    ///
    /// # Errors
    /// If nothing is left; the session stays as it was.
    pub fn leave_out(&mut self, mask: Mask) -> Result<()> {
        let before = std::mem::replace(&mut self.mask, mask);
        if let Err(error) = self.model() {
            self.mask = before;
            return Err(error);
        }
        self.forget_trials();
        Ok(())
    }

    /// Moves a number of `from`, the current model as it is fitted, beside those that were moved.
    ///
    /// # Errors
    /// If the model has no such number.
    pub fn move_to(&mut self, from: &Rotor, id: &ParameterId, value: f64) -> Result<()> {
        let mut moved = self.moved.clone().unwrap_or_else(|| from.clone());
        parameters::set(&mut moved, id, value)?;
        moved.validate()?;
        self.forget_preview();
        self.moved = Some(moved);
        Ok(())
    }

    /// Puts numbers that were moved back.
    pub fn put_back(&mut self) {
        self.moved = None;
        self.held.clear();
    }

    /// Fits what was moved, with the held parameters where they are; a step more.
    ///
    /// # Errors
    /// If it cannot be fitted.
    pub fn fit(&mut self, from: &Rotor) -> Result<()> {
        let model = self.model()?;
        let rotor = self.moved.as_ref().unwrap_or(from);
        let step = Step::holding(rotor, &model.readings, &self.held)?;
        self.take(step);
        Ok(())
    }

    /// Tells what is hidden.
    ///
    /// # Errors
    /// If nothing is.
    pub fn uncover(&mut self) -> Result<()> {
        let Some(practice) = &mut self.practice else {
            return Err(anyhow!("nothing is hidden in this machine; open one with something hidden"));
        };
        practice.is_revealed = true;
        self.reveal = Some(practice.reveal(&self.given, self.branches[self.branch].taken())?);
        self.mark_changed();
        Ok(())
    }
}
