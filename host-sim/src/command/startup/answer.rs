//! What `startup` answers.

use nalgebra::Complex;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::startup::Startup;
use rotor_edge_desktop::startup::refinement::{ModelRefinement, ModelStage};
use rotor_edge_desktop::startup::series::RunUp;

/// A start-up, evaluated, and what the answers are measured in.
pub struct Answer {
    pub readings: Vec<Reading>,
    pub found: Startup,
    /// The models, from the simple one on.
    pub stages: Vec<ModelStage>,
    /// The rotor model, where one could be fitted.
    pub chain: Option<ModelRefinement>,
    /// Clearance that errors are given in percent of, µm.
    pub clearance_um: f64,
    /// Whether nobody stated the clearance.
    pub clearance_assumed: bool,
    pub bearings: [String; 2],
    pub speeds_rpm: Vec<f64>,
    /// Range that errors are summed up over, rpm.
    pub range_rpm: [f64; 2],
    /// Runs whose weights are not known.
    pub unknown_weights: Vec<String>,
    /// What could not be done or was assumed, one sentence each.
    pub remarks: Vec<String>,
}

impl Answer {
    /// An error in percent of the clearance.
    pub fn percent(&self, error_m: f64) -> f64 {
        error_m * 1e8 / self.clearance_um
    }

    /// The disk's own unbalance: of the last model in one plane, or of the two-degree model, kg·m.
    pub fn own_kg_m(&self) -> Option<Complex<f64>> {
        match self.chain.as_ref().map(|c| c.unbalance_kg_m.as_slice()) {
            Some([(one, _)]) => Some(*one),
            _ => self.found.own_kg_m.map(|own| own.unbalance_kg_m),
        }
    }

    /// Whether the weights of a run are known.
    pub fn is_known(&self, run: &RunUp) -> bool {
        !self.unknown_weights.iter().any(|u| u == run.label())
    }
}
