//! The core without a bus and without a judge: what it makes of each reading as it was sent.

use rotor_edge_core::judge::{Average, Averaged, Growth};
use rotor_edge_core::model::{MAX_PLANES, Pair};
use rotor_edge_core::node::{ABSURD_UM, NodeConfig};
use rotor_edge_core::reading::Reading;
use rotor_edge_core::track::{Estimate, Tracker};

use crate::edge::EdgeModel;

/// Follows the same readings as a controller.
pub struct Mirror<'a> {
    model: &'a EdgeModel,
    config: NodeConfig,
    average: Average,
    growth: Growth,
    /// Of the unbalance last found, with the noise that averaging left.
    deviation_g_mm: [f32; MAX_PLANES],
    tracker: Tracker<MAX_PLANES>,
}

const UNKNOWN: [f32; MAX_PLANES] = [f32::NAN; MAX_PLANES];

/// What a controller answers to one reading.
#[derive(Debug, Clone, Copy)]
pub struct Reflection {
    /// The readings up to this one as one.
    pub averaged: Averaged,
    /// Bound on each plane's unbalance, g·mm, the model's floor left out.
    pub bounds_g_mm: [f32; MAX_PLANES],
    /// The unbalance within these bounds.
    pub estimate: Estimate,
}

impl<'a> Mirror<'a> {
    /// Starts as a controller does that remembers nothing.
    pub fn new(model: &'a EdgeModel, config: NodeConfig) -> Self {
        let tracker = Tracker::new(model);
        let growth = Growth::resume(&[], tracker.last_g_mm());
        Self { model, config, average: Average::default(), growth, tracker, deviation_g_mm: UNKNOWN }
    }

    /// Goes on from an unbalance that was found otherwise, g·mm, for the last reading.
    pub fn resume(&mut self, last_g_mm: &[Pair]) {
        let most_g_mm = Growth::default().most_g_mm(last_g_mm, &self.deviation_g_mm);
        self.begin_anew(&most_g_mm, last_g_mm);
    }

    /// Goes on from what a controller has stored when its power goes.
    pub fn cut_power(&mut self) {
        let last_g_mm = self.tracker.last_g_mm().to_vec();
        let most_g_mm = self.growth.most_g_mm(&last_g_mm, &self.deviation_g_mm);
        self.begin_anew(&most_g_mm, &last_g_mm);
        self.deviation_g_mm = UNKNOWN;
    }

    fn begin_anew(&mut self, most_g_mm: &[f32], last_g_mm: &[Pair]) {
        self.average = Average::default();
        self.growth = Growth::resume(most_g_mm, last_g_mm);
        self.tracker = Tracker::resume(self.model, last_g_mm);
    }

    /// The answer to a reading; `None` if it gets none.
    pub fn judge(&mut self, time_us: u64, reading: &Reading) -> Option<Reflection> {
        let is_absurd =
            reading.probes().iter().any(|p| p.cos_um.abs() > ABSURD_UM || p.sin_um.abs() > ABSURD_UM);
        if !self.model.covers(reading.speed_rpm) || is_absurd || reading.valid_mask() == 0 {
            return None;
        }
        let NodeConfig { thresholds, track, .. } = &self.config;
        let averaged = self.average.update(thresholds.average_s, time_us, reading);
        let last_g_mm = self.tracker.last_g_mm();
        let bounds_g_mm = self.growth.bounds_g_mm(thresholds, time_us, last_g_mm, &self.deviation_g_mm);
        let estimate = self.tracker.update(track, self.model, &averaged.reading, &bounds_g_mm).ok()?;
        let share = averaged.variance.sqrt();
        self.deviation_g_mm = estimate.deviation_g_mm.map(|deviation| share * deviation);
        Some(Reflection { averaged, bounds_g_mm, estimate })
    }
}
