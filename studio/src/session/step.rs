//! The steps of a model from the file as it was given to the better one, and the way back.

use anyhow::{Context as _, Result};
use rotor_edge::command::fitted_model;
use rotor_edge_desktop::diagnose::{add, fit_holding};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;
use serde::{Deserialize, Serialize};

use super::parameters::ParameterId;

/// Name of a model's file in messages.
const MODEL: &str = "the model";

/// What a step did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Change {
    /// The file as it was given.
    Given,
    Added {
        effect: String,
        at: Option<String>,
    },
    /// Fitted with these parameters held.
    Fitted {
        held: Vec<ParameterId>,
    },
}

/// A model and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub change: Change,
    pub rotor: Rotor,
    /// Its file, as `add` writes it.
    pub file: String,
}

impl Step {
    /// The file as it was given.
    pub fn given(rotor: Rotor, file: String) -> Self {
        Self { change: Change::Given, rotor, file }
    }

    /// A step as it was stored.
    ///
    /// # Errors
    /// If its file is none of a rotor.
    pub fn stored(change: Change, file: String) -> Result<Self> {
        Ok(Self { change, rotor: rotor_file::parse(MODEL, &file)?, file })
    }

    /// A model with an effect more, as `add` writes it.
    ///
    /// # Errors
    /// As `add`.
    pub fn adding(rotor: &Rotor, readings: &[Reading], effect: &str, at: Option<&str>) -> Result<Self> {
        let better = add(rotor, readings, effect, at)?;
        let change = Change::Added { effect: effect.into(), at: at.map(String::from) };
        // a fit can end with numbers that no file may have
        Self::of(change, &better.rotor, readings)
            .with_context(|| format!("{} cannot be added", better.added.label()))
    }

    /// The model with these parameters held where they are and the others fitted.
    ///
    /// # Errors
    /// If it cannot be fitted.
    pub fn holding(rotor: &Rotor, readings: &[Reading], held: &[ParameterId]) -> Result<Self> {
        let parameters: Vec<_> = held.iter().filter_map(ParameterId::held).collect();
        let best = fit_holding(rotor, readings, &parameters)?;
        Self::of(Change::Fitted { held: held.to_vec() }, &best.rotor, readings)
    }

    fn of(change: Change, rotor: &Rotor, readings: &[Reading]) -> Result<Self> {
        Self::stored(change, rotor_file::text(MODEL, &fitted_model(rotor, readings))?)
    }

    /// Parameters that its fit holds.
    pub fn held(&self) -> &[ParameterId] {
        match &self.change {
            Change::Fitted { held } => held,
            _ => &[],
        }
    }

    /// `effect@place` of what was added, or what else was done.
    pub fn label(&self) -> String {
        match &self.change {
            Change::Given => "as it was".into(),
            Change::Added { effect, at } => match at {
                Some(at) => format!("{effect}@{at}"),
                None => effect.clone(),
            },
            Change::Fitted { held } if held.is_empty() => "fitted".into(),
            Change::Fitted { held } => format!("fitted, {} held", held.len()),
        }
    }

    /// The same in words.
    pub fn words(&self) -> String {
        match &self.change {
            Change::Added { effect, at } => format!("with {}", effect_words(effect, at.as_deref())),
            _ => self.label(),
        }
    }
}

/// An effect at its place in words.
pub fn effect_words(effect: &str, at: Option<&str>) -> String {
    let kind = effect.replace('_', " ");
    at.map_or_else(|| kind.clone(), |at| format!("{kind} at {at}"))
}

/// One line of steps; those behind the current one can be had again.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    steps: Vec<Step>,
    at: usize,
}

impl Branch {
    pub fn of(first: Step) -> Self {
        Self { steps: vec![first], at: 0 }
    }

    /// Steps that were stored; `None` if there are none.
    pub fn stored(steps: Vec<Step>, at: usize) -> Option<Self> {
        (at < steps.len()).then_some(Self { steps, at })
    }

    pub fn current(&self) -> &Step {
        &self.steps[self.at]
    }

    /// Steps up to the current one.
    pub fn taken(&self) -> &[Step] {
        &self.steps[..=self.at]
    }

    pub fn all(&self) -> &[Step] {
        &self.steps
    }

    pub fn at(&self) -> usize {
        self.at
    }

    pub fn can_redo(&self) -> bool {
        self.at + 1 < self.steps.len()
    }

    /// Takes a step; what could be had again is gone.
    pub fn push(&mut self, step: Step) {
        self.steps.truncate(self.at + 1);
        self.steps.push(step);
        self.at += 1;
    }

    pub fn undo(&mut self) {
        self.at = self.at.saturating_sub(1);
    }

    pub fn redo(&mut self) {
        self.at = (self.at + 1).min(self.steps.len() - 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::files::InputFiles;

    #[test]
    fn undo_and_redo_go_through_the_steps_and_a_new_one_ends_them() {
        let files = InputFiles::sample();
        let (rotor, readings) = files.parsed().unwrap();
        let mut branch = Branch::of(Step::given(rotor.clone(), files.rotor.text));
        branch.push(Step::adding(&rotor, &readings, "seal", Some("disk 3")).unwrap());
        let with = branch.current().clone();
        branch.undo();
        assert!(branch.can_redo() && branch.at() == 0);
        branch.undo();
        branch.redo();
        branch.redo();
        assert_eq!(branch.current(), &with);
        branch.undo();
        branch.push(Step::adding(&rotor, &readings, "seal", Some("disk 2")).unwrap());
        assert_eq!((branch.current().label().as_str(), branch.can_redo()), ("seal@disk 2", false));
    }
}
