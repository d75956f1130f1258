//! The core without a bus and without its detector: the estimate of each reading as it was sent.

use rotor_edge_core::detector::AveragedReading;
use rotor_edge_core::model::{MAX_PLANES, Pair};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::numerics::InPlace;
use rotor_edge_core::reading::{Keyphasor, Reading};
use rotor_edge_core::stages::{Estimator, RawHistory, screen};
use rotor_edge_core::track::{Estimate, Tracker};

use crate::edge::EdgeModel;

/// Follows the same readings as a controller.
pub struct ReferencePipeline<'a> {
    model: &'a EdgeModel,
    config: NodeConfig,
    raw: RawHistory,
    estimator: Estimator<MAX_PLANES>,
}

/// What a controller answers to one reading.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// The readings up to this one as one.
    pub averaged: AveragedReading,
    /// Bound on each plane's unbalance, g·mm, the model's floor left out.
    pub bounds_g_mm: [f32; MAX_PLANES],
    /// The unbalance within these bounds.
    pub estimate: Estimate,
}

impl<'a> ReferencePipeline<'a> {
    /// Starts as a controller does that remembers nothing.
    pub fn new(model: &'a EdgeModel, config: NodeConfig) -> Self {
        Self {
            model,
            config,
            raw: RawHistory::default(),
            estimator: Estimator::new(Tracker::new(model), &[]),
        }
    }

    /// Goes on from an unbalance that was found otherwise, g·mm, for the last reading.
    pub fn resume(&mut self, last_g_mm: &[Pair]) {
        self.estimator.correct(Tracker::resume(self.model, last_g_mm));
    }

    /// Goes on from what a controller has stored when its power goes.
    pub fn cut_power(&mut self) {
        let tracker = Tracker::resume(self.model, self.estimator.trusted_g_mm());
        self.estimator = Estimator::new(tracker, &self.estimator.most_g_mm());
        self.raw = RawHistory::default();
    }

    /// The controller does not trust the last reading.
    pub fn distrust(&mut self) {
        self.estimator.distrust();
    }

    /// The answer to a reading; `None` if it gets none.
    pub fn expect(&mut self, time_us: u64, reading: &Reading) -> Option<Expected> {
        let NodeConfig { thresholds, track, .. } = &self.config;
        let screened = screen(self.model, thresholds, Keyphasor::NotStated, reading);
        let screened =
            screened.and_then(|screened| self.raw.judge(self.model.description().noise, screened)).ok()?;
        let averaged = self.estimator.average(thresholds, time_us, &screened.reading);
        let bounds_g_mm = self.estimator.bound(thresholds, time_us);
        let estimated = self.estimator.estimate::<InPlace, _, _>(track, self.model, &averaged, &bounds_g_mm);
        Some(Expected { averaged, bounds_g_mm, estimate: estimated.ok()? })
    }
}
