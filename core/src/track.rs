//! Phase II: the unbalance of each plane from each reading, bounded by what it was before.
//!
//! ```text
//!      plane 1                      plane 2
//!         │  U1 = S/2 + D              │  U2 = S/2 − D
//!   ▲─────┼────────────────────────────┼─────▲        S = U1 + U2        static: a force on the shaft
//! bearing 1                            bearing 2      D = (U1 − U2)/2    dynamic: +D at plane 1, −D at plane 2, a couple
//! ```
//!
//! All are vectors `[U cos α, U sin α]` in g·mm. With one plane U2 = 0: the static unbalance is U1, the dynamic zero.

#[cfg(test)]
mod tests;

use crate::fit::Fit;
use crate::model::{MAX_PLANES, Model, Pair};
use crate::polish::{Polished, polish};
use crate::reading::{FEATURES, PROBES, ProbeVector, Reading, probe_vectors};
use crate::residual::Residual;
use crate::response::{Response, ResponseError, SupportAmplitudes, response};
use crate::scalar;
use crate::swarm::{DEFAULT_PARTICLES, SwarmConfig, search};

/// How the unbalance is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackConfig {
    /// Each plane's unbalance is at most this times the one before (Bera et al. 2023).
    pub growth: f32,
    /// Moves of the swarm of [`DEFAULT_PARTICLES`].
    pub swarm: SwarmConfig,
    /// Seed of the swarm; the number of the reading is added.
    pub seed: u64,
    /// Rounds for the amplitudes at hardening supports, at most.
    pub amplitude_rounds: u8,
    /// Part of the way each round goes towards the new amplitudes.
    pub amplitude_relaxation: f32,
    /// Change of the amplitudes, relative to the largest, at which the rounds stop.
    pub amplitude_tolerance: f32,
}

impl Default for TrackConfig {
    fn default() -> Self {
        Self {
            growth: 1.2,
            swarm: SwarmConfig::default(),
            seed: 1,
            amplitude_rounds: 8,
            amplitude_relaxation: 0.5,
            amplitude_tolerance: 1e-4,
        }
    }
}

/// Why a reading gave no estimate. The tracker is then as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrackError {
    /// A probe is lost or a number not finite.
    Incomplete,
    /// The speed is outside the model's range.
    Speed,
    /// The model has no finite response at this speed.
    Response,
}

impl From<ResponseError> for TrackError {
    fn from(_: ResponseError) -> Self {
        Self::Response
    }
}

/// The unbalance a reading shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// `[U cos α, U sin α]` of each plane, g·mm.
    pub unbalance_g_mm: [Pair; MAX_PLANES],
    /// Static unbalance, the vector sum of the planes, g·mm.
    pub static_g_mm: Pair,
    /// Dynamic unbalance as found at plane 1 (its opposite is at plane 2), g·mm.
    pub dynamic_g_mm: Pair,
    /// What the probes would show for this unbalance.
    pub calculated: [ProbeVector; PROBES],
    /// Calculated against measured.
    pub residual: Residual,
    /// The plane's unbalance lies on its bound: it may be greater than stated.
    pub at_bound: [bool; MAX_PLANES],
    /// Rounds spent on the amplitudes at hardening supports (zero without such).
    pub amplitude_rounds: u8,
}

/// The unbalance last found: the state of phase II.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracker {
    last_g_mm: [Pair; MAX_PLANES],
    /// Where the rounds for hardening supports left off; the next reading goes on from there.
    amplitudes: SupportAmplitudes,
    readings: u64,
}

impl Tracker {
    /// Starts from what phase I found.
    pub fn new<const N: usize>(model: &Model<N>) -> Self {
        Self {
            last_g_mm: model.initial_unbalance_g_mm,
            amplitudes: SupportAmplitudes::default(),
            readings: 0,
        }
    }

    /// The unbalance `[U cos α, U sin α]` of each plane last found, g·mm.
    pub fn last_g_mm(&self) -> [Pair; MAX_PLANES] {
        self.last_g_mm
    }

    /// For a model whose supports differ: the next reading finds their amplitudes anew.
    pub fn forget_amplitudes(&mut self) {
        self.amplitudes = SupportAmplitudes::default();
    }

    /// The unbalance of least absolute residual within `max(growth·|last|, floor)` of each plane.
    ///
    /// Errors: [`TrackError`]; the state is then unchanged.
    pub fn update<const N: usize>(
        &mut self,
        config: &TrackConfig,
        model: &Model<N>,
        reading: &Reading,
    ) -> Result<Estimate, TrackError> {
        if !reading.is_complete() {
            return Err(TrackError::Incomplete);
        }
        if !model.covers(reading.speed_rpm) {
            return Err(TrackError::Speed);
        }
        let speed = reading.speed_rad_s();
        let mut amplitudes = self.amplitudes;
        let mut at_speed = response(model, speed, &amplitudes)?;
        let mut fit = self.fit(config, model, &at_speed, reading);
        let seed = config.seed.wrapping_add(self.readings);
        let start = search::<DEFAULT_PARTICLES>(&config.swarm, &fit, self.last_g_mm, seed);
        let mut found = polish(&fit, start);
        let mut rounds = 0;
        if model.is_nonlinear() {
            while rounds < config.amplitude_rounds {
                let aim = at_speed.support_amplitudes(&found.unbalance_g_mm);
                let unknown = amplitudes == SupportAmplitudes::default();
                let relaxation = if unknown { 1.0 } else { config.amplitude_relaxation };
                let change = approach(&mut amplitudes, &aim, relaxation);
                if change <= config.amplitude_tolerance {
                    break;
                }
                at_speed = response(model, speed, &amplitudes)?;
                fit.set_response(&at_speed, reading);
                found = polish(&fit, found.unbalance_g_mm);
                rounds += 1;
            }
        }
        let estimate = Estimate::new(&at_speed, reading, &found, rounds)?;
        self.last_g_mm = estimate.unbalance_g_mm;
        self.amplitudes = amplitudes;
        self.readings = self.readings.wrapping_add(1);
        Ok(estimate)
    }

    fn fit<const N: usize>(
        &self,
        config: &TrackConfig,
        model: &Model<N>,
        response: &Response,
        reading: &Reading,
    ) -> Fit {
        let bound = |last: Pair| (config.growth * scalar::length(last)).max(model.unbalance_floor_g_mm);
        let mut bound_g_mm = self.last_g_mm.map(bound);
        for bound in bound_g_mm.iter_mut().skip(model.planes.len()) {
            *bound = 0.0;
        }
        let mut fit = Fit { influence: Default::default(), target_um: [0.0; FEATURES], bound_g_mm };
        fit.set_response(response, reading);
        fit
    }
}

impl Fit {
    fn set_response(&mut self, response: &Response, reading: &Reading) {
        self.influence = response.influence_matrix();
        self.target_um = reading.features();
        for (target, offset) in self.target_um.iter_mut().zip(response.offset()) {
            *target -= offset;
        }
    }
}

/// Moves `amplitudes` part of the way to `aim`; returns the largest distance relative to the largest amplitude.
fn approach(amplitudes: &mut SupportAmplitudes, aim: &SupportAmplitudes, relaxation: f32) -> f32 {
    let mut farthest = 0.0_f32;
    let mut largest = f32::MIN_POSITIVE;
    for (amplitude, &aim) in amplitudes.0.as_flattened_mut().iter_mut().zip(aim.0.as_flattened()) {
        let distance = aim - *amplitude;
        farthest = farthest.max(distance.abs());
        largest = largest.max(aim.abs());
        *amplitude += relaxation * distance;
    }
    farthest / largest
}

impl Estimate {
    fn new(response: &Response, reading: &Reading, found: &Polished, rounds: u8) -> Result<Self, TrackError> {
        let unbalance_g_mm = found.unbalance_g_mm;
        let [[a, b], [c, d]] = unbalance_g_mm;
        let calculated = response.features(&[a, b, c, d]);
        let residual = Residual::new(&calculated, &reading.features()).map_err(|_| TrackError::Response)?;
        let one_plane = response.per_unbalance.iter().all(|[_, second]| scalar::size(*second) == 0.0);
        Ok(Self {
            unbalance_g_mm,
            static_g_mm: [a + c, b + d],
            dynamic_g_mm: if one_plane { [0.0; 2] } else { [0.5 * (a - c), 0.5 * (b - d)] },
            calculated: probe_vectors(&calculated),
            residual,
            at_bound: found.at_bound,
            amplitude_rounds: rounds,
        })
    }
}
