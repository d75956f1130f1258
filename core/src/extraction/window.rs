//! The turns of the window under way: angle, lengths, drift.

use core::f32::consts::TAU;

use super::phase::Phase;
use super::{FEWEST_SAMPLES, LARGEST_SURPRISE, Outcome};

/// Lengths are in samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub phase: Phase,
    /// Length of the turn before.
    period: f32,
    turns: u16,
    /// Length of the window's first turn and of all its turns.
    first_period: f32,
    length: f32,
}

impl Window {
    /// A first turn, expected to be as long as the one before, `age` after the mark.
    pub fn new(period: f32, age: f32) -> Self {
        Self { phase: Phase::steady(period, age), period, turns: 0, first_period: 0.0, length: 0.0 }
    }

    /// Begins the window that follows: the shaft turns on.
    pub fn begin_next(&mut self) {
        (self.turns, self.length) = (0, 0.0);
    }

    /// A mark ends a turn of this length, `age` before the present sample. Gives the angle by which the turn's samples lagged
    /// in their mean, rad.
    pub fn end_turn(&mut self, period: f32, age: f32) -> Result<f32, Outcome> {
        let surprise = self.phase.missing_angle(period);
        if !(-TAU * LARGEST_SURPRISE..=TAU * LARGEST_SURPRISE).contains(&surprise) {
            return Err(Outcome::OutOfStep);
        }
        if period < FEWEST_SAMPLES {
            return Err(Outcome::TooFewSamples);
        }
        if self.turns == 0 {
            self.first_period = period;
        }
        self.turns = self.turns.saturating_add(1);
        self.length += period;
        self.phase = Phase::following(self.period, period, age);
        self.period = period;
        Ok(0.5 * surprise)
    }

    pub fn turns(&self) -> u16 {
        self.turns
    }

    /// Turns a sample.
    pub fn speed(&self) -> f32 {
        f32::from(self.turns) / self.length
    }

    /// Change of speed from the first turn to the last, relative.
    pub fn drift(&self) -> f32 {
        (self.first_period - self.period) * self.speed()
    }
}
