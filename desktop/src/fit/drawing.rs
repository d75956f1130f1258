//! The drawing that a fit takes as given: its deviations, the noise that goes with them, and its shaft.

use std::sync::{Arc, OnceLock};

use nalgebra::DVector;

use crate::effects::Place;
use crate::effects::terms::Terms;
use crate::error::Error;
use crate::machine::drawing::Physics;
use crate::receptance::modal_shaft::ModalShaft;
use crate::statistics::scatter::Scatter;
use crate::statistics::whitening::Whitening;

/// Combinations of switches of the beam theory, with and without lengths that differ in stiffness.
pub(super) const SHAFT_KINDS: usize = 16;

/// The shaft that a hypothesis is fitted on.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShaftKind {
    pub physics: Physics,
    /// The stiffness of lengths of the shaft may differ; the basis then holds additional shape functions.
    pub has_lengths: bool,
}

impl ShaftKind {
    pub fn of(terms: &Terms) -> Self {
        let has_lengths = terms.supports.iter().any(|(place, _)| matches!(place, Place::Strain(..)));
        Self { physics: terms.physics, has_lengths }
    }

    pub fn number(self) -> usize {
        usize::from(self.physics.gyroscopic)
            + 2 * usize::from(self.physics.shear_deformation)
            + 4 * usize::from(self.physics.rotary_inertia)
            + 8 * usize::from(self.has_lengths)
    }
}

/// The state of the drawing that hypotheses are fitted on.
pub struct Drawing {
    /// Deviations in standard deviations.
    pub(super) deviation: DVector<f64>,
    /// The correlated noise that scatter and other deviations amount to.
    pub(super) whitening: Arc<Whitening>,
    pub(super) plants: [OnceLock<Result<Arc<ModalShaft>, Error>>; SHAFT_KINDS],
}

impl Drawing {
    pub(super) fn new(deviation: DVector<f64>, whitening: Whitening) -> Self {
        Self { deviation, whitening: Arc::new(whitening), plants: Default::default() }
    }

    /// This drawing with its shaft, which is solved already.
    pub(super) fn solved(self, kind: &ShaftKind, plant: Arc<ModalShaft>) -> Self {
        // nothing is lost if it was solved before
        let _ = self.plants[kind.number()].set(Ok(plant));
        self
    }

    /// The same drawing with another noise.
    pub(super) fn under(&self, whitening: Whitening) -> Self {
        Self {
            deviation: self.deviation.clone(),
            whitening: Arc::new(whitening),
            plants: self.plants.clone(),
        }
    }

    /// Once more.
    pub fn as_it_is(&self) -> Self {
        Self { plants: self.plants.clone(), ..self.of_another() }
    }

    /// What it allows for, for another machine with as many dimensions and measured values.
    pub fn of_another(&self) -> Self {
        let (deviation, whitening) = (self.deviation.clone(), self.whitening.clone());
        Self { deviation, whitening, plants: Default::default() }
    }

    /// The scatter that fits on it go by.
    pub fn scatter(&self) -> Scatter {
        self.whitening.scatter()
    }
}
