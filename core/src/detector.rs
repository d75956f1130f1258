//! When the model stops describing the machine, and which bearing shows it: residuals over time.
//!
//! ```text
//! suspicious   e > floor, and
//!                e/f > ratio_floor and e > (1 + rise)·level       Rise
//!                e/f > ratio_limit                                Ratio
//!                e/f > ratio_floor and e > (1 + rise)·reference   Reference
//!              Jump instead, if none of them held without the bounds on the unbalance
//!              a plane's unbalance changed more than it may      Jump
//!              what explains the change at this speed           Keyphasor, Scale, Probe instead of these
//!              or the raw readings are                          Scatter
//! flag         the sum of suspicious time less a quarter of the other time reaches persistence_s, and that of
//!              readings persistence_readings
//! ```
//!
//! The floor is what the deployed noise may leave. The level is the usual residual of the last days; the reference that
//! of the time after the deployment, which never follows, so that a fault stays visible however slowly it grows. Both are
//! kept for one redundant row, so that they mean the same when a probe is lost: the least absolute residual leaves as many
//! features exact as there are unknowns.

mod average;
mod change;
mod evidence;
mod growth;
mod level;
mod noise;
mod reference;
#[cfg(test)]
mod reference_tests;
mod repeats;
mod scatter;
mod suspicion;
#[cfg(test)]
mod tests;

pub use average::{Average, AveragedReading};
pub use evidence::{Evidence, Observation};
pub use growth::Growth;
pub use level::Level;
pub use noise::noise_floor_um;
pub(crate) use reference::Reference;
pub(crate) use repeats::Repeats;
pub(crate) use scatter::{Dispersion, Scatter};
pub(crate) use suspicion::Suspicion;

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
    /// Bit i: probe i changed alone, with [`Reason::Probe`]; otherwise zero.
    pub changed_mask: u8,
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

/// Level, reference, suspicion and flag: with the unbalance last trusted, what of a detector survives a restart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Baseline {
    /// Of the residual for one redundant row, as is the reference.
    pub level: Level,
    /// `None` while it is being taken.
    pub reference_um: Option<f32>,
    /// Time and readings that the reference rests on so far.
    pub learned_s: f32,
    pub learned_readings: u8,
    pub suspicion: Suspicion,
    pub latched: Option<LatchedFlag>,
}

/// Memory of the residuals and of what was trusted. Readings that cannot be judged are simply not given to it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Detector {
    baseline: Baseline,
    reference: Reference,
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

    /// Suspicious readings come and go: too many lately to trust one that is not.
    pub fn is_intermittent(&self) -> bool {
        !self.baseline.suspicion.is_empty()
    }

    /// Goes on from a stored baseline and from the unbalance that was trusted; times of readings are unknown.
    pub(crate) fn resume(baseline: Baseline, reference: Reference) -> Self {
        Self { baseline, reference, ..Self::default() }
    }

    pub(crate) fn baseline(&self) -> &Baseline {
        &self.baseline
    }

    /// Whether more is known than `before` that should be stored at once: a flag, the end of learning, or twice as much
    /// learned.
    pub(crate) fn has_news_since(&self, before: &Baseline) -> bool {
        let learned = |baseline: &Baseline| (baseline.learned_s as u32).leading_zeros();
        self.baseline.latched != before.latched
            || self.is_learning() != before.reference_um.is_none()
            || learned(&self.baseline) != learned(before)
    }

    /// A new detector with the flag of another one.
    pub fn latched_only(other: &Self) -> Self {
        let baseline = Baseline { latched: other.baseline.latched, ..Baseline::default() };
        Self::resume(baseline, Reference::default())
    }

    /// Lowers the flag and begins suspicion anew: what still misfits is flagged again. What the machine is by the next
    /// trusted reading is what it is held against; level and reference of the residual stay, for another unbalance does not
    /// change the bearings.
    pub fn acknowledge(&mut self) {
        self.baseline.latched = None;
        self.baseline.suspicion = Suspicion::default();
        self.reference = Reference::default();
    }

    /// Judges a reading and remembers it.
    pub fn update(&mut self, thresholds: &Thresholds, time_us: u64, evidence: &Evidence) -> ResidualVerdict {
        let rows = f32::from(evidence.redundancy.max(1));
        let level_um = self.baseline.level.mean().map(|level| rows * level);
        let reference_um = self.baseline.reference_um.map(|reference| rows * reference);
        let limits = Limits { thresholds, evidence, level_um, reference_um };
        let part = self.reference.advance(thresholds, time_us);
        let (reason, changed_mask) = self.reason(&limits);
        let is_suspicious = reason != Reason::None;

        let dt_s = self.judged_us.map(|judged_us| seconds_since(judged_us, time_us));
        self.judged_us = Some(time_us);
        let suspicion = &mut self.baseline.suspicion;
        if suspicion.is_empty() {
            self.misfit = Misfit::default();
        }
        let is_apart = self.counted_us.is_none_or(|us| seconds_since(us, time_us) >= thresholds.average_s);
        let counts = is_apart || (is_suspicious && suspicion.run == 0);
        if counts {
            self.counted_us = Some(time_us);
        }
        suspicion.take(thresholds, is_suspicious, dt_s, counts);
        let Suspicion { run: streak, .. } = *suspicion;
        if is_suspicious {
            self.misfit.add(&evidence.residual);
        } else {
            self.learn(thresholds, dt_s, evidence.residual.e_um / rows, counts);
            self.reference.trust(thresholds, &evidence.observation, part, counts);
        }
        let suspicion = &self.baseline.suspicion;
        let flagged = is_suspicious && suspicion.persists(thresholds);
        // What is wrong with all probes alike is no bearing's.
        let is_common = matches!(reason, Reason::Keyphasor | Reason::Scale);
        let suspect = self.misfit.worst_bearing(&evidence.bearings).filter(|_| flagged && !is_common);
        if flagged && self.baseline.latched.is_none() {
            let cause = if suspicion.is_intermittent(thresholds) { Reason::Intermittent } else { reason };
            self.baseline.latched = Some(LatchedFlag { cause, suspect });
        }
        ResidualVerdict {
            residual: evidence.residual,
            floor_um: evidence.floor_um,
            level_um: level_um.unwrap_or_default(),
            reference_um,
            reason,
            changed_mask,
            streak,
            flagged,
            suspect,
        }
    }

    /// Why a reading is suspicious, and the probes that changed alone if that is the reason.
    fn reason(&self, limits: &Limits) -> (Reason, u8) {
        let Limits { thresholds, evidence, .. } = *limits;
        let misfit = limits.reason(evidence.residual.e_um);
        let is_changed = || self.reference.is_changed(thresholds, &evidence.observation);
        if misfit == Reason::None && !is_changed() {
            return (evidence.raw, 0);
        }
        let fits = limits.reason(evidence.free_residual_um) == Reason::None;
        let unnamed = if fits { Reason::Jump } else { misfit };
        // Beside the flag of a misfit the vectors had changed before: what is common to the change since is chance.
        let is_misfit =
            |latched: LatchedFlag| matches!(latched.cause, Reason::Rise | Reason::Ratio | Reason::Reference);
        if misfit != Reason::None && self.baseline.latched.is_some_and(is_misfit) {
            return (unnamed, 0);
        }
        self.reference.cause(&evidence.observation, &evidence.bearings, fits).unwrap_or((unnamed, 0))
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
#[inline(never)] // once in flash
fn seconds_since(then_us: u64, now_us: u64) -> f32 {
    now_us.saturating_sub(then_us) as f32 * 1e-6
}
