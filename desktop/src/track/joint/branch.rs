//! An explanation of a record, carried on by its own filter.

use nalgebra::DVector;

use super::kalman::{Gaussian, Innovation};
use super::motion::ProcessModel;
use super::passes::{JointProblem, Pass, impossible_from};
use super::state::Layout;
use crate::machine::drawing::Noise;
use crate::track::record::Day;

/// An explanation of the record, and its filter at the last reading.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Its probability relative to the most probable explanation.
    pub weight: f64,
    pub layout: Layout,
    pub motion: ProcessModel,
    pub state: Gaussian,
    /// Whether readings say anything of the state; of a machine that nothing explains they do not.
    pub is_read: bool,
}

impl JointProblem {
    /// The end of a run of the filter as an explanation of this probability.
    pub(super) fn branch(
        &self,
        weight: f64,
        motion: &ProcessModel,
        pass: &Pass,
        is_read: bool,
    ) -> Option<Branch> {
        let state = pass.visits.last()?.filtered();
        Some(Branch { weight, layout: self.layout.clone(), motion: motion.clone(), state, is_read })
    }
}

impl Branch {
    /// The point at which a reading at the predicted state is linearised.
    pub fn point(&self) -> DVector<f64> {
        self.layout.at_rest(self.state.mean.clone())
    }

    /// Takes a reading in after these paces; returns whether it is impossible. `None` if the machine is singular.
    pub fn advance(&mut self, day: &Day, paces: f64, noise: &Noise) -> Option<bool> {
        self.state = self.state.predicted(&self.layout.step(paces, &self.motion, None, false));
        if !self.is_read {
            return Some(false);
        }
        let point = self.point();
        let linear = self.layout.linear(day, &point, noise)?;
        let left = linear.left - &linear.slope * (&self.state.mean - &point);
        let innovation = Innovation::new(&self.state, &linear.slope, &left, &linear.variance)?;
        let is_impossible = innovation.squared > impossible_from(linear.variance.len());
        if !is_impossible {
            self.state = innovation.update(&self.state);
        }
        Some(is_impossible)
    }

    pub fn under(&self, conditions: &[f64]) -> Gaussian {
        self.layout.known_under(&self.state, conditions)
    }
}
