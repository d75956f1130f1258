//! When the model stops describing the machine, and which bearing shows it: residuals over time.
//!
//! ```text
//! suspicious   e > floor, and
//!                e/f > ratio_floor and e > (1 + rise)·level       Rise
//!                e/f > ratio_limit                                Ratio
//!                e/f > ratio_floor and e > (1 + rise)·reference   Reference
//!              Jump instead, if none of them held without the bounds on the unbalance
//!              or the raw readings are                             Scatter
//! flag         suspicious without a break for persistence_s and persistence_readings
//! ```
//!
//! The floor is what the deployed noise may leave. The level is the usual residual of the last days; the reference that
//! of the time after the deployment, which never follows, so that a fault stays visible however slowly it grows. Both are
//! kept for one redundant row, so that they mean the same when a probe is lost: the least absolute residual leaves as many
//! features exact as there are unknowns.

mod average;
mod evidence;
mod growth;
mod level;
mod noise;
mod repeats;
mod scatter;
#[cfg(test)]
mod tests;

pub use average::{Average, AveragedReading};
pub use evidence::Evidence;
pub use growth::Growth;
pub use level::Level;
pub use noise::noise_floor_um;
pub(crate) use repeats::Repeats;
pub(crate) use scatter::{Dispersion, Scatter};

use crate::reading::MAX_PROBES;
use crate::residual::Residual;
use crate::state::Reason;
use crate::thresholds::Thresholds;

/// What the monitor makes of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct ResidualVerdict {
    /// The residual that was judged.
    pub residual: Residual,
    /// The floor it was held against, µm.
    pub floor_um: f32,
    /// The level it was held against, µm; zero at the first reading.
    pub level_um: f32,
    /// The reference it was held against, µm; `None` while it is being taken.
    pub reference_um: Option<f32>,
    /// Why it is suspicious; [`Reason::None`] if it is not.
    pub reason: Reason,
    /// Suspicious readings in a row, this one included; those within the averaging time count as one.
    pub streak: u16,
    /// Suspicion persisted.
    pub flagged: bool,
    /// With a flag: the bearing with the greatest residual a probe since suspicion began, from zero.
    pub suspect: Option<u8>,
}

impl ResidualVerdict {
    pub fn is_suspicious(&self) -> bool {
        self.reason != Reason::None
    }
}

/// A flag that stays until it is acknowledged or the model replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LatchedFlag {
    pub cause: Reason,
    /// The bearing suspected then, from zero.
    pub suspect: Option<u8>,
}

/// Level, reference, streak and flag: the part of a detector that survives a restart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Baseline {
    /// Of the residual for one redundant row, as is the reference.
    pub level: Level,
    /// `None` while it is being taken.
    pub reference_um: Option<f32>,
    /// Time and readings that the reference rests on so far.
    pub learned_s: f32,
    pub learned_readings: u8,
    /// Suspicious readings in a row.
    pub streak: u16,
    pub suspicious_s: f32,
    pub latched: Option<LatchedFlag>,
}

/// Memory of the residuals. Readings that cannot be judged are simply not given to it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Detector {
    baseline: Baseline,
    judged_us: Option<u64>,
    counted_us: Option<u64>,
    misfit: Misfit,
}

/// Residuals since suspicion began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Misfit {
    sum_um: [f32; MAX_PROBES],
    readings: [u16; MAX_PROBES],
}

impl Detector {
    /// When the last reading was judged, µs.
    pub fn judged_us(&self) -> Option<u64> {
        self.judged_us
    }

    /// The flag, if one is up.
    pub fn latched(&self) -> Option<LatchedFlag> {
        self.baseline.latched
    }

    /// The reference is still being taken.
    pub fn is_learning(&self) -> bool {
        self.baseline.reference_um.is_none()
    }

    /// Goes on from a stored baseline; times of readings are unknown.
    pub(crate) fn resume(baseline: Baseline) -> Self {
        Self { baseline, ..Self::default() }
    }

    pub(crate) fn baseline(&self) -> &Baseline {
        &self.baseline
    }

    /// Whether more is known than `before` that should be stored at once: a flag, the end of learning, or twice as much
    /// learned.
    pub fn has_news_since(&self, before: &Self) -> bool {
        let learned = |detector: &Self| (detector.baseline.learned_s as u32).leading_zeros();
        self.baseline.latched != before.baseline.latched
            || self.is_learning() != before.is_learning()
            || learned(self) != learned(before)
    }

    /// A new detector with the flag of another one.
    pub fn latched_only(other: &Self) -> Self {
        Self::resume(Baseline { latched: other.baseline.latched, ..Baseline::default() })
    }

    /// Lowers the flag. Suspicion begins anew: what still misfits is flagged again.
    pub fn acknowledge(&mut self) {
        self.baseline.latched = None;
        (self.baseline.streak, self.baseline.suspicious_s) = (0, 0.0);
    }

    /// Judges a reading and remembers it.
    pub fn update(&mut self, thresholds: &Thresholds, time_us: u64, evidence: &Evidence) -> ResidualVerdict {
        let rows = f32::from(evidence.redundancy.max(1));
        let level_um = self.baseline.level.mean().map(|level| rows * level);
        let reference_um = self.baseline.reference_um.map(|reference| rows * reference);
        let limits = Limits { thresholds, evidence, level_um, reference_um };
        let mut reason = limits.reason(evidence.residual.e_um);
        if reason != Reason::None && limits.reason(evidence.free_residual_um) == Reason::None {
            reason = Reason::Jump;
        }
        if reason == Reason::None {
            reason = evidence.raw;
        }
        let dt_s = self.judged_us.map(|judged_us| seconds_since(judged_us, time_us));
        self.judged_us = Some(time_us);
        let counts = self.counted_us.is_none_or(|us| seconds_since(us, time_us) >= thresholds.average_s);
        if reason == Reason::None {
            (self.baseline.streak, self.baseline.suspicious_s) = (0, 0.0);
            self.learn(thresholds, dt_s, evidence.residual.e_um / rows, counts);
        } else {
            if self.baseline.streak == 0 {
                self.misfit = Misfit::default();
            } else {
                // After a restart nobody knows for how long: long enough, if there are readings enough.
                self.baseline.suspicious_s += dt_s.unwrap_or(thresholds.persistence_s);
            }
            self.misfit.add(&evidence.residual);
        }
        if counts || (reason != Reason::None && self.baseline.streak == 0) {
            self.counted_us = Some(time_us);
            self.baseline.streak = self.baseline.streak.saturating_add(u16::from(reason != Reason::None));
        }
        let flagged = reason != Reason::None
            && self.baseline.streak >= u16::from(thresholds.persistence_readings)
            && self.baseline.suspicious_s >= thresholds.persistence_s;
        let suspect = self.misfit.worst_bearing(&evidence.bearings).filter(|_| flagged);
        if flagged && self.baseline.latched.is_none() {
            self.baseline.latched = Some(LatchedFlag { cause: reason, suspect });
        }
        ResidualVerdict {
            residual: evidence.residual,
            floor_um: evidence.floor_um,
            level_um: level_um.unwrap_or_default(),
            reference_um,
            reason,
            streak: self.baseline.streak,
            flagged,
            suspect,
        }
    }

    /// Level and reference from readings that are not suspicious: an event cannot raise what it is measured by.
    fn learn(&mut self, thresholds: &Thresholds, dt_s: Option<f32>, value: f32, counts: bool) {
        // After a restart nobody knows for how long the first reading stands: for one mean's time at least.
        let dt_s = dt_s.unwrap_or(thresholds.average_s);
        let is_first = self.baseline.level.mean().is_none();
        self.baseline.level.update(thresholds.level_s, dt_s, value);
        if self.baseline.reference_um.is_some() {
            return;
        }
        if !is_first {
            self.baseline.learned_s += dt_s;
        }
        self.baseline.learned_readings = self.baseline.learned_readings.saturating_add(u8::from(counts));
        if self.baseline.learned_s >= thresholds.learning_s
            && self.baseline.learned_readings >= thresholds.learning_readings
        {
            self.baseline.level.fold(thresholds.level_s);
            self.baseline.reference_um = self.baseline.level.mean();
        }
    }
}

/// What a residual is held against.
struct Limits<'a> {
    thresholds: &'a Thresholds,
    evidence: &'a Evidence,
    level_um: Option<f32>,
    reference_um: Option<f32>,
}

impl Limits<'_> {
    /// Why a residual of `e_um` for this reading would be suspicious.
    fn reason(&self, e_um: f32) -> Reason {
        let Thresholds { rise, ratio_limit, ratio_floor, .. } = *self.thresholds;
        let ratio = e_um / self.evidence.residual.f_um;
        let is_above = |usual_um: Option<f32>| {
            ratio > ratio_floor && usual_um.is_some_and(|usual_um| e_um > (1.0 + rise) * usual_um)
        };
        if e_um <= self.evidence.greater_floor_um(self.thresholds) {
            Reason::None
        } else if is_above(self.level_um) {
            Reason::Rise
        } else if ratio > ratio_limit {
            Reason::Ratio
        } else if is_above(self.reference_um) {
            Reason::Reference
        } else {
            Reason::None
        }
    }
}

impl Misfit {
    fn add(&mut self, residual: &Residual) {
        for ((sum_um, readings), &probe_um) in
            self.sum_um.iter_mut().zip(&mut self.readings).zip(&residual.probe_um)
        {
            // A lost probe has none, and a sum that long decides nothing new.
            if probe_um > 0.0 && *readings < u16::MAX {
                *sum_um += probe_um;
                *readings = readings.saturating_add(1);
            }
        }
    }

    /// The bearing of the greatest mean over its probes' means.
    fn worst_bearing(&self, bearings: &[u8; MAX_PROBES]) -> Option<u8> {
        let mut worst: Option<(u8, f32)> = None;
        for &bearing in bearings {
            let (mut sum_um, mut probes) = (0.0, 0.0);
            for ((&sum, &readings), _) in self
                .sum_um
                .iter()
                .zip(&self.readings)
                .zip(bearings)
                .filter(|&((_, &n), &b)| b == bearing && n > 0)
            {
                sum_um += sum / f32::from(readings);
                probes += 1.0;
            }
            if probes > 0.0 && worst.is_none_or(|(_, most)| sum_um / probes > most) {
                worst = Some((bearing, sum_um / probes));
            }
        }
        worst.map(|(bearing, _)| bearing)
    }
}

/// Seconds from one time to another; zero if the clock went back.
fn seconds_since(then_us: u64, now_us: u64) -> f32 {
    now_us.saturating_sub(then_us) as f32 * 1e-6
}
