//! Readings that were taken in passing, as sums over steady responses.
//!
//! With θ(t) the angle that the shaft has turned through, a linear machine with the steady transfer H(Ω) and the impulse response
//! h shows beside `e^{iθ(t)}`
//!
//! `y(t) = ∫ h(τ) e^{i(θ(t−τ) − θ(t))} dτ`,
//!
//! whatever turns with the shaft: an unbalance with its Ω² inside, a bow, a weight, runout. With a window that is one over the
//! memory of the machine and falls smoothly to zero on both sides within a period T, the Poisson sum makes it exactly
//!
//! `y(t) = Σ_j W_j H(ν_j)`, `W_j = (1/T) ∫ w(τ) e^{i(θ(t−τ) − θ(t) + ν_j τ)} dτ`, `ν_j = 2πj/T`.
//!
//! At a constant rate α and without the window, W is the Fresnel kernel `√(i/2πα) e^{−i(Ω−ν)²/2α}`, which spreads over about √|α| of
//! speed; its first term beyond H is the lag `−(iα/2) d²H/dΩ²`. The speed is taken as linear between the readings.
//!
//! Before the first reading of a run-up the speed changed at the rate of the first two readings, from standstill: vibration that
//! is left from a critical speed below the first reading is a part of what the probes show. A machine that runs down comes from a
//! steady speed, and nothing is left from before.
//!
//! Approximations: what depends on speed in the machine itself (gyroscopic moments, oil films) is taken at the frequency ν, which is
//! right to the width √|α| of the kernel; supports that harden, soften or rub are taken at the amplitude of the steady response.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Complex;

use crate::measurement::Reading;
use crate::units::SECONDS_A_DAY;

type C = Complex<f64>;

/// Speeds at which the steady response is evaluated: as few of these as the memory of the machine allows.
pub const SPEEDS: [usize; 3] = [128, 256, 512];
/// Speeds beyond those that were run through, in `√|α|` and of their range: the larger counts.
const MARGIN: f64 = 6.0;
const MARGIN_OF_RANGE: f64 = 0.1;
/// Flanks of the window, times the margin, rad: what of their spectrum is left out is below 5e-4 of the peak of a resonance.
const FLANK: f64 = 24.0;

/// Which runs are evaluated as sweeps, and over how many speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    pub runs: Vec<Option<String>>,
    pub speeds: usize,
}

/// How one reading is a sum over steady responses.
#[derive(Debug, Clone)]
pub struct SweptRow {
    /// Speeds of the steady responses, rad/s. All readings of a run have the same.
    pub speeds_rad_s: Arc<Vec<f64>>,
    /// Share of the response at each speed.
    pub weights: Vec<C>,
}

/// The speed of a run by time: linear between its readings.
#[derive(Debug, Clone)]
pub struct SpeedHistory {
    times_s: Vec<f64>,
    speeds_rad_s: Vec<f64>,
    angles: Vec<f64>,
    /// Before the first reading: rate, and how long at most, s.
    before: [f64; 2],
}

impl SpeedHistory {
    /// Of one run's readings in turn; `None` where their times are not known or do not grow from one to the next.
    pub fn of<'r>(readings: impl Iterator<Item = &'r Reading>) -> Option<Self> {
        let (mut times_s, mut speeds_rad_s, mut angles) = (Vec::new(), Vec::new(), Vec::new());
        let mut first_d = None;
        for reading in readings {
            let time_s = (reading.time_d? - *first_d.get_or_insert(reading.time_d?)) * SECONDS_A_DAY;
            let speed = reading.speed_rad_s();
            let angle = match (times_s.last(), speeds_rad_s.last(), angles.last()) {
                (Some(t), Some(w), Some(angle)) if time_s > *t => angle + 0.5 * (w + speed) * (time_s - t),
                (None, ..) => 0.0,
                _ => return None,
            };
            times_s.push(time_s);
            speeds_rad_s.push(speed);
            angles.push(angle);
        }
        if times_s.len() < 2 {
            return None;
        }
        let mut history = Self { times_s, speeds_rad_s, angles, before: [0.0; 2] };
        let rate =
            (history.speeds_rad_s[1] - history.speeds_rad_s[0]) / (history.times_s[1] - history.times_s[0]);
        let flank_s = FLANK / MARGIN / history.fastest_rate().sqrt();
        let long_s = if rate > 0.0 { (history.speeds_rad_s[0] / rate).max(flank_s) } else { flank_s };
        history.before = [rate, long_s];
        Some(history)
    }

    /// Largest change of speed between two readings, rad/s².
    pub fn fastest_rate(&self) -> f64 {
        let rate = |k: usize| {
            (self.speeds_rad_s[k + 1] - self.speeds_rad_s[k]) / (self.times_s[k + 1] - self.times_s[k])
        };
        (0..self.times_s.len() - 1).map(rate).fold(0.0, |most, rate| rate.abs().max(most))
    }

    /// From where it is known, or can be told, to the last reading, s.
    fn duration_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1] + self.before[1]
    }

    /// Slowest and fastest speed, rad/s, where what is before the first reading counts no longer than this, s.
    fn speeds(&self, memory_s: f64) -> [f64; 2] {
        let [rate, long_s] = self.before;
        let begin = (self.speeds_rad_s[0] - rate * long_s.min(memory_s)).max(0.0);
        self.speeds_rad_s.iter().fold([begin; 2], |[low, high], w| [low.min(*w), high.max(*w)])
    }

    /// The angle turned through since the first reading, rad.
    fn angle(&self, time_s: f64) -> f64 {
        let after = self.times_s.partition_point(|t| *t <= time_s);
        let (k, rate) = if after == 0 {
            (0, self.before[0])
        } else {
            let k = (after - 1).min(self.times_s.len() - 2);
            let rate =
                (self.speeds_rad_s[k + 1] - self.speeds_rad_s[k]) / (self.times_s[k + 1] - self.times_s[k]);
            (k, rate)
        };
        let mut passed = time_s - self.times_s[k];
        // at rest before it started
        if rate > 0.0 {
            passed = passed.max(-self.speeds_rad_s[k] / rate);
        }
        self.angles[k] + (self.speeds_rad_s[k] + 0.5 * rate * passed) * passed
    }

    /// The window at τ seconds before a reading, which was taken so long after the run began.
    fn window(&self, tau: f64, memory_s: f64, since_begin_s: f64, flank_s: f64) -> f64 {
        if tau < 0.0 {
            return falling(-tau / flank_s);
        }
        let reach = memory_s.min(since_begin_s);
        let flank = flank_s.min(0.5 * reach);
        falling((tau - reach + flank) / flank)
    }
}

/// From one at zero to zero at one, all derivatives zero at both.
fn falling(at: f64) -> f64 {
    if at <= 0.0 {
        1.0
    } else if at >= 1.0 {
        0.0
    } else {
        (1.0 + ((1.0 - at).recip() - at.recip()).exp()).recip()
    }
}

/// The memory and the speeds of a plan.
struct Grid {
    /// How far back a response is followed, s.
    memory_s: f64,
    flank_s: f64,
    /// `T`, s.
    period_s: f64,
    margin_rad_s: f64,
}

impl Grid {
    /// With about so many speeds; `None` where they are too few for flanks of the window.
    fn new(histories: &[SpeedHistory], speeds: usize) -> Option<Self> {
        let rate = histories.iter().map(SpeedHistory::fastest_rate).fold(0.0, f64::max);
        let longest_s = histories.iter().map(SpeedHistory::duration_s).fold(0.0, f64::max);
        let ends = |memory_s: f64| {
            let of_each = histories.iter().map(|h| h.speeds(memory_s));
            of_each.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default()
        };
        let [low, high] = ends(0.0);
        let margin_rad_s = (MARGIN * rate.sqrt()).max(MARGIN_OF_RANGE * (high - low));
        let flank_s = FLANK / margin_rad_s;
        let range = |memory_s: f64| {
            let [low, high] = ends(memory_s);
            high + margin_rad_s - (low - margin_rad_s).max(0.0)
        };
        // a longer memory reaches back to slower speeds
        let mut memory_s = longest_s;
        for _ in 0..8 {
            memory_s = longest_s.min(TAU * speeds as f64 / range(memory_s) - flank_s);
        }
        (memory_s >= 2.0 * flank_s).then_some(Self {
            memory_s,
            flank_s,
            period_s: memory_s + flank_s,
            margin_rad_s,
        })
    }

    /// Numbers of the speeds of a run.
    fn numbers(&self, history: &SpeedHistory) -> [usize; 2] {
        let [low, high] = history.speeds(self.memory_s);
        let number = |w: f64| w * self.period_s / TAU;
        [number(low - self.margin_rad_s).ceil().max(1.0) as usize, number(high + self.margin_rad_s) as usize]
    }

    fn rows(&self, history: &SpeedHistory) -> Vec<SweptRow> {
        let [first, last] = self.numbers(history);
        let count = last + 1 - first;
        let speeds = (first..=last).map(|j| TAU * j as f64 / self.period_s);
        let speeds_rad_s = Arc::new(speeds.collect::<Vec<f64>>());
        // twice as many samples as speeds: what is beyond both ends folds into neither
        let samples = 2 * (count + 1);
        let turns: Vec<C> =
            (0..samples).map(|k| C::from_polar(1.0, TAU * k as f64 / samples as f64)).collect();
        let row = |time_s: &f64| {
            let angle = history.angle(*time_s);
            let since_begin_s = time_s + history.before[1];
            let mut weights = vec![C::from(0.0); count];
            for k in 0..samples {
                let tau = self.period_s * k as f64 / samples as f64;
                let tau = if tau > self.memory_s { tau - self.period_s } else { tau };
                let window = history.window(tau, self.memory_s, since_begin_s, self.flank_s);
                if window == 0.0 {
                    continue;
                }
                // aliased by the first number, so that the speeds of the run are what is sampled
                let f = C::from_polar(window, history.angle(time_s - tau) - angle + speeds_rad_s[0] * tau);
                let mut at = 0;
                for weight in &mut weights {
                    *weight += f * turns[at];
                    at = (at + k) % samples;
                }
            }
            // what is the same at every speed stays as it is
            let sum: C = weights.iter().sum();
            weights.iter_mut().for_each(|w| *w /= sum);
            SweptRow { speeds_rad_s: speeds_rad_s.clone(), weights }
        };
        history.times_s.iter().map(row).collect()
    }
}

impl SweepPlan {
    /// Each reading's row, where its run is swept; `None` where times are not known, contradict each other, or the speeds are too many.
    pub fn rows(&self, readings: &[Reading]) -> Option<Vec<Option<SweptRow>>> {
        let own: Vec<Vec<usize>> = self.runs.iter().map(|run| of_run(readings, run)).collect();
        let own: Vec<Vec<usize>> = own.into_iter().filter(|own| !own.is_empty()).collect();
        let history = |own: &Vec<usize>| SpeedHistory::of(own.iter().map(|i| &readings[*i]));
        let histories: Vec<SpeedHistory> = own.iter().map(history).collect::<Option<_>>()?;
        let grid = Grid::new(&histories, self.speeds)?;
        let mut rows = vec![None; readings.len()];
        for (own, history) in own.iter().zip(&histories) {
            own.iter().zip(grid.rows(history)).for_each(|(i, row)| rows[*i] = Some(row));
        }
        Some(rows)
    }

    /// Whether more speeds would reach further back than the runs do.
    pub fn is_whole(&self, readings: &[Reading]) -> bool {
        let of = |run| SpeedHistory::of(of_run(readings, run).into_iter().map(|i| &readings[i]));
        let Some(histories) = self.runs.iter().map(of).collect::<Option<Vec<_>>>() else { return false };
        let longest_s = histories.iter().map(SpeedHistory::duration_s).fold(0.0, f64::max);
        Grid::new(&histories, self.speeds).is_some_and(|grid| grid.memory_s >= longest_s)
    }
}

/// Numbers of the readings of a run.
fn of_run(readings: &[Reading], run: &Option<String>) -> Vec<usize> {
    (0..readings.len()).filter(|i| readings[*i].run == *run).collect()
}

#[cfg(test)]
mod tests;
