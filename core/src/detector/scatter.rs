//! Scatter of raw readings against the model's noise and their own past, and whether they have a direction.
//!
//! ```text
//! square  s = |d|²/2, or |d − d'|²/6 if that is less, over 2σ² + |a δ z|²/2
//! mean    S ← S + (s − S)/16, s at most 4 times the limit
//! limit   3.81·max(1, L)     Scatter if a probe's S is above it
//! level   L ← L + (s − L)/n, s at most 3 L; n counts readings from 64 to 1,024; not while S is above the limit
//! none    |m|² < v ln(1/p) Σw|z|² for each probe while one scatters: no direction
//! ```
//!
//! `z` is a probe's vector, `d` its difference to that of the reading before at the same speed, `d'` the difference before
//! that one, `σ` the model's deviation of either part, `δ` the relative difference of speed. Differences do not see slow
//! changes; the differences of differences do not see steady ones, such as a run-up through a resonance. A step counts once
//! and is limited.
//!
//! `m = Σwz` is the mean of the last readings at one speed and `v = Σw²` its variance relative to that of one. If the
//! directions are independent and uniform, `|m|²/(v Σw|z|²)` has the exponential distribution (Rayleigh's test).
//!
//! Everything goes by readings, not by time: a day's reading scatters as a second's does. Readings at ever other speeds are
//! not judged, and two marks that change places more seldom than every fourth reading are a step each time.

use super::average::is_same_speed;
use crate::model::Noise;
use crate::reading::{MAX_PROBES, ProbeVector, Reading};
use crate::scalar;

/// Weight of a reading in the mean square and in the mean vector.
const WEIGHT: f32 = 1.0 / 16.0;
/// Mean square that normal noise exceeds with a probability of at most 1e-9.
///
/// The two parts of `d/√2σ` are normal with variance 1 and correlation −1/2 from one reading to the next, so
/// `E exp(θ Σ w_i s_i) = 1/det(1 − θ W R)` with `W = diag(w_i)`, `w_i = (1 − w)^i w`, R tridiagonal with 1 and 1/4 for the
/// product of neighbours. Chernoff's `P(S > c) ≤ min exp(−θc)/det` is 1e-9 at c = 3.803.
const LIMIT: f32 = 3.81;
/// Times the limit that one square counts at most: a step alone adds a quarter of the limit.
const MOST_SQUARE: f32 = 4.0;
/// Times the level that one square teaches at most: the level hardly follows what it is the measure for. Exponentially
/// distributed squares keep 94 % of their mean.
const MOST_LEARNED: f32 = 3.0;
/// Readings for which the model's noise counts in the level.
const PRIOR_READINGS: u16 = 64;
/// Readings that the level forgets over.
const LEVEL_READINGS: u16 = 1024;
/// `ln(1/p)` for the probability p = 1e-3 that readings without a direction seem to have one.
const LN_1_BY_P: f32 = 6.907_755;
/// Relative change of a vector for a relative change of speed, at most, in operation: `ω²/(ω0² − ω²)` at the 16 % from a
/// resonance that API 617 demands gives 7.
const RESPONSE_SLOPE: f32 = 8.0;
/// Deviation of a part that is taken if the model states no noise, relative to the amplitude.
const UNSTATED: Noise = Noise { relative: 0.1, floor_um: 0.0 };

/// What the last readings are to one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dispersion {
    #[default]
    Usual,
    /// A probe scatters more than noise and past allow.
    Excessive,
    /// So much that no probe has a direction.
    NoDirection,
}

/// Memory of the last readings' scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    probes: [ProbeScatter; MAX_PROBES],
    /// Readings in the mean vectors, up to that weight.
    readings: u8,
    /// Of the mean vectors relative to one reading's.
    variance: f32,
    learned: u16,
    dispersion: Dispersion,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct ProbeScatter {
    /// The last difference, µm; not finite if there is none.
    step_um: [f32; 2],
    square: f32,
    level: f32,
    mean_um: [f32; 2],
    power_um2: f32,
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            probes: [ProbeScatter::NONE; MAX_PROBES],
            readings: 0,
            variance: 0.0,
            learned: 0,
            dispersion: Dispersion::Usual,
        }
    }
}

impl Scatter {
    /// What was found last.
    pub fn dispersion(&self) -> Dispersion {
        self.dispersion
    }

    /// Takes a reading; `last` is each probe's vector before, lost where there was none, at `last_rpm`.
    pub fn update(
        &mut self,
        noise: Noise,
        last: &[ProbeVector; MAX_PROBES],
        last_rpm: f32,
        reading: &Reading,
    ) -> Dispersion {
        let noise = if noise.is_stated() { noise } else { UNSTATED };
        let is_same = is_same_speed(last_rpm, reading.speed_rpm);
        let slope = RESPONSE_SLOPE * (reading.speed_rpm / last_rpm - 1.0);
        let weight = self.weigh(is_same);
        let rate = 1.0 / f32::from(self.learned.saturating_add(PRIOR_READINGS));
        let bound = LN_1_BY_P * self.variance;
        // Fewer readings would need a nearly constant direction to show one.
        let (mut scatters, mut has_direction) = (false, bound > 0.5);
        for ((probe, last), now) in self.probes.iter_mut().zip(last).zip(reading.probes()) {
            if !now.is_finite() {
                probe.step_um = [f32::NAN; 2];
                continue;
            }
            let square_um2 = probe.square_of_step(last, now, is_same);
            let deviation_um = noise.deviation_um(*now);
            let power_um2 = square(now.cos_um, now.sin_um);
            let usual_um2 = 2.0 * deviation_um * deviation_um + 0.5 * slope * slope * power_um2;
            if square_um2.is_finite() && usual_um2 > 0.0 {
                probe.take(square_um2 / usual_um2, rate);
            }
            probe.average(weight, now, power_um2);
            scatters |= probe.square > probe.limit();
            has_direction |= square(probe.mean_um[0], probe.mean_um[1]) >= bound * probe.power_um2;
        }
        if is_same && !scatters {
            self.learned = self.learned.saturating_add(1).min(LEVEL_READINGS - PRIOR_READINGS);
        }
        self.dispersion = match (scatters, has_direction) {
            (false, _) => Dispersion::Usual,
            (true, true) => Dispersion::Excessive,
            (true, false) => Dispersion::NoDirection,
        };
        self.dispersion
    }

    /// The weight of the next reading in the mean vectors: alike at first, then exponential.
    fn weigh(&mut self, is_same_speed: bool) -> f32 {
        self.readings = if is_same_speed { self.readings.saturating_add(1) } else { 1 };
        let weight = scalar::greater(WEIGHT, 1.0 / f32::from(self.readings));
        self.variance = (1.0 - weight) * (1.0 - weight) * self.variance + weight * weight;
        weight
    }
}

impl ProbeScatter {
    const NONE: Self =
        Self { step_um: [f32::NAN; 2], square: 1.0, level: 1.0, mean_um: [0.0; 2], power_um2: 0.0 };

    /// Half the square of the difference, or a sixth of that of the last two differences, µm²; each is twice the variance of
    /// a part if readings are independent. Not finite without a difference.
    fn square_of_step(&mut self, last: &ProbeVector, now: &ProbeVector, is_same_speed: bool) -> f32 {
        let before = self.step_um;
        self.step_um = match is_same_speed {
            true => [now.cos_um - last.cos_um, now.sin_um - last.sin_um],
            false => [f32::NAN; 2],
        };
        let [cos_um, sin_um] = self.step_um;
        // Of two numbers the least, where one is none the other.
        (0.5 * square(cos_um, sin_um)).min(square(cos_um - before[0], sin_um - before[1]) / 6.0)
    }

    fn limit(&self) -> f32 {
        LIMIT * scalar::greater(1.0, self.level)
    }

    /// Takes a square relative to the model's noise.
    fn take(&mut self, square: f32, rate: f32) {
        let limit = self.limit();
        self.square += WEIGHT * (scalar::lesser(MOST_SQUARE * limit, square) - self.square);
        if self.square <= limit {
            self.level += rate * (scalar::lesser(MOST_LEARNED * self.level, square) - self.level);
        }
    }

    fn average(&mut self, weight: f32, now: &ProbeVector, power_um2: f32) {
        for (mean, part) in self.mean_um.iter_mut().zip([now.cos_um, now.sin_um]) {
            *mean += weight * (part - *mean);
        }
        self.power_um2 += weight * (power_um2 - self.power_um2);
    }
}

fn square(x: f32, y: f32) -> f32 {
    x * x + y * y
}

#[cfg(test)]
mod tests;
