//! From whole readings to estimates, verdicts and a state: what a node knows of the machine.

use super::ABSURD_UM;
use crate::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, MonitorResult, NumberedReading, flag_at_bound};
use crate::judge::{Average, Evidence, Growth, Judge, Verdict};
use crate::memory::Memory;
use crate::model::{MAX_PLANES, Model, ModelError, Pair};
use crate::numerics::Numerics;
use crate::reading::Reading;
use crate::scalar;
use crate::state::{NodeState, Reason};
use crate::thresholds::Thresholds;
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};

#[derive(Debug, Clone)]
pub(super) struct Monitor<const SHAPES: usize, const PROBES: usize, const PLANES: usize> {
    /// Or why there is none.
    model: Result<Model<SHAPES, PROBES, PLANES>, Reason>,
    checksum: u32,
    tracker: Option<Tracker<PLANES>>,
    average: Average,
    growth: Growth,
    /// Of the unbalance last found, with the noise that averaging left.
    deviation_g_mm: [f32; MAX_PLANES],
    pub judge: Judge,
    pub estimate: Option<Estimate>,
    pub verdict: Option<Verdict>,
    /// Why the last whole reading could not be judged, if it could not.
    blind: Option<Reason>,
    /// Probes that the last whole reading lacked, and why.
    missing: (u8, Reason),
}

/// What became of a whole reading.
pub(super) enum Evaluated {
    Unmodelled,
    /// Speed, features or number of probes cannot be.
    Rejected,
    /// No phases or no probes.
    Skipped,
    Unsolved,
    /// An estimate, and a verdict if it is entitled to one.
    Estimated {
        result: MonitorResult,
        partial: bool,
    },
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Monitor<SHAPES, PROBES, PLANES> {
    pub fn new() -> Self {
        Self {
            model: Err(Reason::NothingStored),
            checksum: 0,
            tracker: None,
            average: Average::default(),
            growth: Growth::default(),
            deviation_g_mm: [f32::NAN; MAX_PLANES],
            judge: Judge::default(),
            estimate: None,
            verdict: None,
            blind: None,
            missing: (0, Reason::None),
        }
    }

    pub fn model(&self) -> Option<&Model<SHAPES, PROBES, PLANES>> {
        self.model.as_ref().ok()
    }

    /// Zero without a model.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    pub fn last_g_mm(&self) -> &[Pair] {
        self.tracker.as_ref().map_or(&[], Tracker::last_g_mm)
    }

    /// Decodes a model to where it stays. `is_on_trial`: the one that is there is, and goes on if the bytes are the same.
    ///
    /// Errors: those of [`Model::decode`], and the model that was there stays.
    #[inline(never)]
    pub fn decode<C: Numerics<SHAPES, PROBES, PLANES>>(
        &mut self,
        bytes: &[u8],
        is_on_trial: bool,
    ) -> Result<(), ModelError> {
        Model::<SHAPES, PROBES, PLANES>::verify::<C>(bytes)?;
        if self.model.is_err() {
            self.model = Ok(Model::EMPTY);
        }
        let before = self.checksum;
        if let Ok(model) = &mut self.model {
            self.checksum = model.read(bytes)?;
        }
        if !(is_on_trial && self.checksum == before) {
            self.begin();
        }
        Ok(())
    }

    /// Why there is no model.
    pub fn lack(&mut self, reason: Reason) {
        self.model = Err(reason);
        self.checksum = 0;
        self.tracker = None;
        self.forget();
    }

    /// Goes on with another model from the unbalance last found, if it has as many planes.
    pub fn adopt(&mut self, model: Model<SHAPES, PROBES, PLANES>) {
        self.checksum = model.checksum();
        self.model = Ok(model);
        self.begin();
    }

    fn begin(&mut self) {
        let Ok(model) = &self.model else {
            return;
        };
        let mut last_g_mm = [[f32::NAN; 2]; MAX_PLANES];
        let known = self.tracker.as_ref().map_or(&[][..], Tracker::last_g_mm);
        if known.len() == model.planes.len() {
            for (place, &last) in last_g_mm.iter_mut().zip(known) {
                *place = last;
            }
        }
        self.tracker = Some(Tracker::resume(model, &last_g_mm));
        self.forget();
        self.judge = Judge::default();
    }

    /// Begins a new record; a latched flag stays up.
    pub fn restart(&mut self) {
        self.tracker = self.model().map(Tracker::new);
        self.forget();
        self.judge = Judge::latched_only(&self.judge);
    }

    /// What was remembered of this model; `false` for a memory of another one.
    pub fn restore(&mut self, memory: &Memory) -> bool {
        let Ok(model) = &self.model else {
            return false;
        };
        if memory.model_checksum != self.checksum {
            return false;
        }
        let tracker = Tracker::resume(model, &memory.unbalance_g_mm);
        self.forget();
        self.growth = Growth::resume(&memory.most_g_mm, tracker.last_g_mm());
        self.tracker = Some(tracker);
        self.judge = memory.judge();
        true
    }

    /// What is to be remembered, with that judge.
    pub fn memory(&self, judge: &Judge) -> Memory {
        let last_g_mm = self.last_g_mm();
        Memory::new(self.checksum, judge, last_g_mm, &self.growth.most_g_mm(last_g_mm, &self.deviation_g_mm))
    }

    fn forget(&mut self) {
        self.average = Average::default();
        self.growth = Growth::resume(&[], self.last_g_mm());
        self.deviation_g_mm = [f32::NAN; MAX_PLANES];
        (self.estimate, self.verdict, self.blind) = (None, None, None);
        self.missing = (0, Reason::None);
    }

    /// State, reason and mask of missing probes; a latched flag is not looked at. `is_outdated`: the last verdict is older
    /// than the age limit.
    pub fn state(&self, is_outdated: bool) -> (NodeState, Reason, u8) {
        let (mask, why_missing) = self.missing;
        let (state, reason) = match (&self.model, &self.verdict, self.blind) {
            (Err(reason), ..) => (NodeState::NoModel, *reason),
            (_, None, None) => (NodeState::Waiting, Reason::NoReading),
            (_, None, Some(blind)) => (NodeState::Blind, blind),
            (_, Some(_), blind) if is_outdated => (NodeState::Stale, blind.unwrap_or(Reason::Age)),
            (_, Some(_), Some(blind)) => (NodeState::Blind, blind),
            (_, Some(verdict), None) if verdict.is_suspicious() => (NodeState::Suspicious, verdict.reason),
            (_, Some(_), None) if self.judge.is_learning() => (NodeState::Learning, Reason::Learning),
            (_, Some(_), None) => (NodeState::Tracking, why_missing),
        };
        (state, reason, mask)
    }

    /// The reading becomes an estimate and, if it is entitled to one, a verdict.
    pub fn evaluate<C: Numerics<SHAPES, PROBES, PLANES>>(
        &mut self,
        track: &TrackConfig,
        thresholds: &Thresholds,
        time_us: u64,
        numbered: &NumberedReading,
    ) -> Evaluated {
        let mut reading = numbered.reading;
        let (Ok(model), Some(tracker)) = (&self.model, &mut self.tracker) else {
            return Evaluated::Unmodelled;
        };
        let all = all_probes(&reading);
        let gaps = probes_out_of_gap(&reading, thresholds.gap_range_v);
        self.missing = (0, Reason::None);
        let impossible = if reading.probes().len() != model.probes.len() {
            Some(Reason::ProbeCount)
        } else if !numbered.keyphasor.is_usable() {
            self.blind = Some(Reason::Keyphasor);
            return Evaluated::Skipped;
        } else if !model.covers(reading.speed_rpm) {
            Some(Reason::Speed)
        } else if is_absurd(&reading) {
            Some(Reason::Absurd)
        } else {
            None
        };
        if impossible.is_some() {
            self.blind = impossible;
            return Evaluated::Rejected;
        }
        reading.lose(gaps);
        let missing_mask = all & !reading.valid_mask();
        let why_missing = match (missing_mask, gaps) {
            (0, _) => Reason::None,
            (_, 0) => Reason::Probes,
            _ => Reason::Gap,
        };
        self.missing = (missing_mask, why_missing);
        if missing_mask == all {
            self.blind = Some(why_missing);
            return Evaluated::Skipped;
        }
        let averaged = self.average.update(thresholds.average_s, time_us, &reading);
        let bounds_g_mm =
            self.growth.bounds_g_mm(thresholds, time_us, tracker.last_g_mm(), &self.deviation_g_mm);
        let estimate = match C::update(tracker, track, model, &averaged.reading, &bounds_g_mm) {
            Ok(estimate) => estimate,
            Err(error) => {
                self.blind = Some(why_blind(error));
                return Evaluated::Unsolved;
            }
        };
        let evidence = Evidence::new(model, &estimate, &averaged);
        let floor_um = evidence.floor_um.max(thresholds.floor_um);
        self.blind = if estimate.redundancy == 0 {
            Some(Reason::NoRedundancy)
        } else if estimate.residual.f_um <= floor_um {
            Some(Reason::BelowNoise)
        } else {
            None
        };
        let mut result = MonitorResult {
            sequence: numbered.sequence,
            flags: 0,
            suspect: None,
            redundancy: estimate.redundancy,
            streak: 0,
            used_mask: reading.valid_mask(),
            reason: self.blind.unwrap_or(why_missing),
            planes: estimate.planes,
            unbalance_g_mm: estimate.unbalance_g_mm,
            static_g_mm: estimate.static_g_mm,
            dynamic_g_mm: estimate.dynamic_g_mm,
            e_um: estimate.residual.e_um,
            ratio: estimate.residual.ratio,
            floor_um,
            level_um: 0.0,
        };
        for (plane, at_bound) in (0..).zip(estimate.at_bound) {
            result.flags |= if at_bound { flag_at_bound(plane) } else { 0 };
        }
        let share = scalar::sqrt(averaged.variance);
        self.deviation_g_mm = estimate.deviation_g_mm.map(|deviation| share * deviation);
        self.estimate = Some(estimate);
        if self.blind.is_none() {
            let verdict = self.judge.update(thresholds, time_us, &evidence);
            if verdict.is_suspicious() {
                result.flags |= FLAG_SUSPICIOUS | if verdict.flagged { FLAG_FLAGGED } else { 0 };
                result.reason = verdict.reason;
            }
            (result.suspect, result.streak, result.level_um) =
                (verdict.suspect, verdict.streak, verdict.level_um);
            self.verdict = Some(verdict);
        }
        Evaluated::Estimated { result, partial: missing_mask != 0 }
    }
}

fn why_blind(error: TrackError) -> Reason {
    match error {
        TrackError::Incomplete => Reason::Probes,
        TrackError::Speed => Reason::Speed,
        TrackError::Response => Reason::Response,
        TrackError::Undetermined => Reason::Undetermined,
        TrackError::ProbeCount => Reason::ProbeCount,
    }
}

/// A feature no probe can show. A lost probe (NaN) is not absurd.
fn is_absurd(reading: &Reading) -> bool {
    reading.probes().iter().any(|probe| probe.cos_um.abs() > ABSURD_UM || probe.sin_um.abs() > ABSURD_UM)
}

fn all_probes(reading: &Reading) -> u8 {
    reading.probes().iter().fold(0, |mask, _| mask << 1 | 1)
}

/// Probes whose gap voltage is stated and outside of the range.
fn probes_out_of_gap(reading: &Reading, [lowest_v, highest_v]: [f32; 2]) -> u8 {
    let is_out = |gap_v: f32| gap_v.is_finite() && !(lowest_v..=highest_v).contains(&gap_v);
    let gaps = reading.gaps_v().iter().enumerate();
    gaps.fold(0, |mask, (probe, &gap_v)| mask | u8::from(is_out(gap_v)) << probe)
}
