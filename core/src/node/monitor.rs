//! From whole readings to estimates, verdicts and a state: what a node knows of the machine.

use crate::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, MonitorResult, NumberedReading, flag_at_bound};
use crate::detector::{Detector, Evidence, ResidualVerdict};
use crate::memory::Memory;
use crate::model::{MAX_PLANES, Model, ModelError, Pair};
use crate::numerics::Numerics;
use crate::stages::{Estimator, RawHistory, ScreenedReading, Unusable, screen};
use crate::state::{NodeState, Reason};
use crate::thresholds::Thresholds;
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};

#[derive(Debug, Clone)]
pub(super) struct Monitor<const SHAPES: usize, const PROBES: usize, const PLANES: usize> {
    /// Or why there is none.
    model: Result<Model<SHAPES, PROBES, PLANES>, Reason>,
    checksum: u32,
    /// `None` exactly without a model.
    estimator: Option<Estimator<PLANES>>,
    raw: RawHistory,
    pub detector: Detector,
    pub estimate: Option<Estimate>,
    pub verdict: Option<ResidualVerdict>,
    /// Why the last whole reading could not be judged, if it could not.
    blind: Option<Reason>,
    /// Probes that the last whole reading lacked, and why.
    missing: (u8, Reason),
}

/// What became of a whole reading.
pub(super) enum Evaluation {
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
            estimator: None,
            raw: RawHistory::default(),
            detector: Detector::default(),
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
        self.estimator.as_ref().map_or(&[], Estimator::last_g_mm)
    }

    /// Lowers the flag. The next trusted reading is what the machine is held against.
    pub fn acknowledge(&mut self) {
        self.detector.acknowledge();
        if let Some(estimator) = &mut self.estimator {
            estimator.forget_bounds();
        }
    }

    /// Decodes a model to where it stays. With the checksum of the one that is there, all goes on.
    ///
    /// Errors: those of [`Model::decode`], and the model that was there stays.
    #[inline(never)]
    pub fn decode<C: Numerics<SHAPES, PROBES, PLANES>>(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        Model::<SHAPES, PROBES, PLANES>::verify::<C>(bytes)?;
        if self.model.is_err() {
            self.model = Ok(Model::EMPTY);
        }
        let before = self.checksum;
        if let Ok(model) = &mut self.model {
            self.checksum = model.read(bytes)?;
        }
        if self.estimator.is_none() || self.checksum != before {
            self.begin();
        }
        Ok(())
    }

    /// Why there is no model.
    pub fn clear_model(&mut self, reason: Reason) {
        self.model = Err(reason);
        self.checksum = 0;
        self.estimator = None;
        self.forget();
    }

    /// Goes on with another model from the unbalance last found, if it has as many planes.
    pub fn set_model(&mut self, model: Model<SHAPES, PROBES, PLANES>) {
        self.checksum = model.checksum();
        self.model = Ok(model);
        self.begin();
    }

    fn begin(&mut self) {
        let Ok(model) = &self.model else {
            return;
        };
        let mut last_g_mm = [[f32::NAN; 2]; MAX_PLANES];
        let known = self.last_g_mm();
        if known.len() == model.planes.len() {
            for (place, &last) in last_g_mm.iter_mut().zip(known) {
                *place = last;
            }
        }
        self.estimator = Some(Estimator::new(Tracker::resume(model, &last_g_mm), &[]));
        self.forget();
        self.detector = Detector::default();
    }

    /// Begins a new record; a latched flag stays up.
    pub fn restart(&mut self) {
        self.estimator = self.model().map(|model| Estimator::new(Tracker::new(model), &[]));
        self.forget();
        self.detector = Detector::latched_only(&self.detector);
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
        self.estimator = Some(Estimator::new(tracker, &memory.most_g_mm));
        self.forget();
        self.detector = memory.detector();
        true
    }

    /// The memory to store.
    pub fn memory(&self) -> Memory {
        let most_g_mm = self.estimator.as_ref().map_or([f32::MAX; MAX_PLANES], Estimator::most_g_mm);
        let trusted_g_mm = self.estimator.as_ref().map_or(&[][..], Estimator::trusted_g_mm);
        Memory::new(self.checksum, &self.detector, trusted_g_mm, &most_g_mm)
    }

    fn forget(&mut self) {
        (self.estimate, self.verdict, self.blind) = (None, None, None);
        self.missing = (0, Reason::None);
        self.raw = RawHistory::default();
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
            (_, Some(verdict), None) if verdict.is_suspicious() => {
                let named = matches!(verdict.reason, Reason::Probe | Reason::Bearing);
                let mask = if named { verdict.changed_mask } else { mask };
                return (NodeState::Suspicious, verdict.reason, mask);
            }
            // A flag tells of suspicion before.
            (_, Some(_), None) if self.detector.is_intermittent() && self.detector.latched().is_none() => {
                (NodeState::Suspicious, Reason::Intermittent)
            }
            (_, Some(_), None) if self.detector.is_learning() => (NodeState::Learning, Reason::Learning),
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
    ) -> Evaluation {
        let (Ok(model), Some(estimator)) = (&self.model, &mut self.estimator) else {
            return Evaluation::Unmodelled;
        };
        let screened = screen(model, thresholds, numbered.keyphasor, &numbered.reading);
        let screened = match screened.and_then(|screened| self.raw.judge(model.noise, screened)) {
            Ok(screened) => screened,
            Err(unusable) => return self.pass_over(unusable),
        };
        self.missing = (screened.missing_mask, screened.why_missing);
        let averaged = estimator.average(thresholds, time_us, &screened.reading);
        let bounds_g_mm = estimator.bound(thresholds, time_us);
        let estimate = match estimator.estimate::<C, _, _>(track, model, &averaged, &bounds_g_mm) {
            Ok(estimate) => estimate,
            Err(error) => {
                self.blind = Some(why_blind(error));
                return Evaluation::Unsolved;
            }
        };
        let evidence = Evidence { raw: screened.suspicion, ..Evidence::new(model, &estimate, &averaged) };
        let judged = match evidence.why_unjudged(thresholds) {
            None => Ok(self.detector.update(thresholds, time_us, &evidence)),
            Some(reason) => Err(reason),
        };
        if !judged.is_ok_and(|verdict| !verdict.is_suspicious()) {
            estimator.distrust();
        }
        let floor_um = evidence.greater_floor_um(thresholds);
        let result = result_of(numbered.sequence, &screened, &estimate, floor_um, &judged);
        self.estimate = Some(estimate);
        self.blind = judged.err();
        self.verdict = judged.ok().or(self.verdict);
        Evaluation::Estimated { result, partial: screened.missing_mask != 0 }
    }

    fn pass_over(&mut self, unusable: Unusable) -> Evaluation {
        let (evaluated, reason, missing) = match unusable {
            Unusable::Rejected(reason) => (Evaluation::Rejected, reason, (0, Reason::None)),
            Unusable::Skipped { reason, missing_mask: 0 } => (Evaluation::Skipped, reason, (0, Reason::None)),
            Unusable::Skipped { reason, missing_mask } => {
                (Evaluation::Skipped, reason, (missing_mask, reason))
            }
        };
        (self.blind, self.missing) = (Some(reason), missing);
        evaluated
    }
}

/// The estimate of a screened reading as a result, with its verdict or why it has none.
fn result_of(
    sequence: u16,
    screened: &ScreenedReading,
    estimate: &Estimate,
    floor_um: f32,
    judged: &Result<ResidualVerdict, Reason>,
) -> MonitorResult {
    let mut result = MonitorResult {
        sequence,
        flags: 0,
        suspect: None,
        redundancy: estimate.redundancy,
        streak: 0,
        used_mask: screened.reading.valid_mask(),
        reason: screened.why_missing,
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
    match judged {
        Err(reason) => result.reason = *reason,
        Ok(verdict) => {
            if verdict.is_suspicious() {
                result.flags |= FLAG_SUSPICIOUS | if verdict.flagged { FLAG_FLAGGED } else { 0 };
                result.reason = verdict.reason;
            }
            (result.suspect, result.streak, result.level_um) =
                (verdict.suspect, verdict.streak, verdict.level_um);
        }
    }
    result
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
