//! From whole readings to estimates, verdicts and a state: all that is known of a machine, whatever the readings come over.
//!
//! # Life of a monitor
//! 1. [`Monitor::new`], without a model.
//! 2. What was stored: [`Monitor::load`] with the model's bytes or with the reason why there are none, then
//!    [`Monitor::restore`] with the memory.
//! 3. Again and again: [`Monitor::take`] with every reading, [`Monitor::status`] whenever somebody asks, and now and then,
//!    or at once when a flag is raised, [`Monitor::memory`] for the flash.
//!
//! Times are µs since the start and must not go back.
//!
//! ```
//! # use rotor_edge_core::model::{Description, Matrices, Model, Modes, Noise, Probe, Spring, Support};
//! # use rotor_edge_core::nalgebra::{Matrix1, SVector};
//! use rotor_edge_core::monitor::{Monitor, Taken};
//! use rotor_edge_core::reading::{Keyphasor, ProbeVector, Reading, rad_s};
//! use rotor_edge_core::response::{SupportAmplitudes, response};
//! use rotor_edge_core::state::{NodeState, Reason};
//! use rotor_edge_core::thresholds::Thresholds;
//! use rotor_edge_core::track::TrackConfig;
//! # let matrices = Matrices {
//! #     stiffness: Matrix1::new(0.0), mass: Matrix1::new(10.0), polar_inertia: Matrix1::new(0.0),
//! # };
//! # let place = SVector::from([1.0]);
//! # let modes = Modes::new(&matrices, &[Spring { shape: place, stiffness_n_m: 5e6 }; 2]).unwrap();
//! # let one = modes.shape(&place);
//! # let model = Model::<1, 2, 1>::new(&Description {
//! #     machine: [0; 4], shaft: &modes.shaft(), internal_damping_s: 0.0,
//! #     planes: &[modes.forward(&place)], initial_unbalance_g_mm: &[[1000.0, 0.0]],
//! #     supports: &[Support::isotropic(one, 5e6, 100.0), Support::isotropic(one, 5e6, 100.0)],
//! #     knots: &[], forcings: &[],
//! #     probes: &[Probe::plain(one, [1.0, 0.0], 0), Probe::plain(one, [0.0, 1.0], 0)], masked: 0,
//! #     unbalance_floor_g_mm: 1.0, noise: Noise::default(), speed_range_rpm: [100.0, 2e5],
//! # }).unwrap();
//! let mut monitor = Monitor::<1, 2, 1>::new(TrackConfig::default(), Thresholds::DEFAULT).unwrap();
//! assert_eq!(monitor.status(0).state, NodeState::NoModel);
//!
//! // a disk on two springs; its probes show 1,000 g·mm
//! let at_speed = response(&model, rad_s(3000.0), &SupportAmplitudes::default()).unwrap();
//! let shown = [0, 1].map(|probe| ProbeVector::from_phasor(at_speed.probes()[probe].phasor(&[[1000.0, 0.0]])));
//! monitor.set_model(model).unwrap();
//! let reading = Reading::new(3000.0, &shown).unwrap();
//! let taken = monitor.take(0, &reading, Keyphasor::Locked);
//! assert!(matches!(taken, Taken::Estimated(judgement) if judgement.verdict.is_ok()));
//! assert!((monitor.estimate().unwrap().unbalance_g_mm[0][0] - 1000.0).abs() < 1.0);
//! assert_eq!(monitor.status(0).state, NodeState::Learning);
//!
//! // a minute later nothing is known any more
//! let status = monitor.status(60_000_000);
//! assert_eq!((status.state, status.reason), (NodeState::Stale, Reason::Age));
//! ```

use core::marker::PhantomData;

use crate::detector::{Detector, Evidence, LatchedFlag, ResidualVerdict};
use crate::memory::Memory;
use crate::model::{MAX_PLANES, Model, ModelError};
use crate::numerics::{InPlace, Numerics};
use crate::packed::Packed;
use crate::reading::{Keyphasor, Reading};
use crate::stages::{Estimator, RawHistory, Unusable, screen};
use crate::state::{NodeState, Reason, Status};
use crate::thresholds::{ThresholdError, Thresholds};
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};

/// A monitor for machines of up to `PROBES` probes and `PLANES` planes, modelled by `SHAPES` basis shapes. `C`: what it
/// calculates with.
#[derive(Debug, Clone)]
pub struct Monitor<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C = InPlace> {
    track: TrackConfig,
    thresholds: Thresholds,
    /// Or why there is none.
    model: Result<Model<SHAPES, PROBES, PLANES>, Reason>,
    checksum: u32,
    /// `None` exactly without a model.
    estimator: Option<Estimator<PLANES>>,
    raw: RawHistory,
    detector: Detector,
    estimate: Option<Estimate>,
    verdict: Option<ResidualVerdict>,
    /// Why the last whole reading could not be judged, if it could not.
    blind: Option<Reason>,
    /// Probes that the last whole reading lacked, and why.
    missing: (u8, Reason),
    numerics: PhantomData<C>,
}

/// What became of a whole reading.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Taken {
    /// There is no model.
    Unmodelled,
    /// Speed, features or number of probes cannot be.
    Rejected,
    /// No phases or no probes.
    Skipped,
    /// It does not determine the unbalance.
    Unsolved,
    /// An estimate ([`Monitor::estimate`]), and a verdict if it is entitled to one.
    Estimated(Judgement),
}

/// What is to be said of a reading beside its estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Judgement {
    /// Bit i: probe i was used.
    pub used_mask: u8,
    /// [`Reason::None`] if no probe is missing.
    pub why_missing: Reason,
    /// Residual up to which nothing is suspicious, µm.
    pub floor_um: f32,
    /// The memory should be stored at once: a flag was raised, or much was learned.
    pub is_news: bool,
    /// Or why the reading says nothing about the model.
    pub verdict: Result<ResidualVerdict, Reason>,
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Monitor<SHAPES, PROBES, PLANES, C>
{
    /// A monitor without a model.
    ///
    /// Errors: [`ThresholdError`].
    #[inline(never)]
    pub fn new(track: TrackConfig, thresholds: Thresholds) -> Result<Self, ThresholdError> {
        thresholds.check()?;
        Ok(Self::with_checked(track, thresholds))
    }

    #[inline]
    pub(crate) fn with_checked(track: TrackConfig, thresholds: Thresholds) -> Self {
        Self {
            track,
            thresholds,
            model: Err(Reason::NothingStored),
            checksum: 0,
            estimator: None,
            raw: RawHistory::default(),
            detector: Detector::default(),
            estimate: None,
            verdict: None,
            blind: None,
            missing: (0, Reason::None),
            numerics: PhantomData,
        }
    }

    /// What it judges by.
    pub fn thresholds(&self) -> &Thresholds {
        &self.thresholds
    }

    /// Judges by others from the next reading on.
    ///
    /// Errors: [`ThresholdError`], and those before stay.
    pub fn set_thresholds(&mut self, thresholds: Thresholds) -> Result<(), ThresholdError> {
        thresholds.check()?;
        self.thresholds = thresholds;
        Ok(())
    }

    /// Takes up the stored model, or why there is none; a model that cannot be used is a reason too, which is returned.
    /// Without a model the state is [`NodeState::NoModel`].
    pub fn load(&mut self, stored: Result<&[u8], Reason>) -> Result<(), Reason> {
        let loaded = stored.and_then(|bytes| self.decode(bytes).map_err(why_no_model));
        if let Err(reason) = loaded {
            self.clear_model(reason);
        }
        loaded
    }

    /// The last estimate; `None` since the last change of the model.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// The last verdict; [`Monitor::status`] tells whether it still stands.
    pub fn verdict(&self) -> Option<&ResidualVerdict> {
        self.verdict.as_ref()
    }

    /// The flag, if one is up.
    pub fn latched(&self) -> Option<LatchedFlag> {
        self.detector.latched()
    }

    #[cfg(test)]
    pub(crate) fn detector(&self) -> &Detector {
        &self.detector
    }

    pub fn model(&self) -> Option<&Model<SHAPES, PROBES, PLANES>> {
        self.model.as_ref().ok()
    }

    /// Zero without a model.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    #[cfg(test)]
    pub(crate) fn last_g_mm(&self) -> &[crate::model::Pair] {
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
    pub(crate) fn decode(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
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

    /// `reason`: why there is no model.
    fn clear_model(&mut self, reason: Reason) {
        self.model = Err(reason);
        self.checksum = 0;
        self.estimator = None;
        self.forget();
    }

    /// Goes on with another model from the unbalance last found, if it has as many planes. The residuals begin a new level
    /// and a new reference, and a latched flag is lowered.
    ///
    /// Errors: [`ModelError`], and the model that was there stays.
    pub fn set_model(&mut self, model: Model<SHAPES, PROBES, PLANES>) -> Result<(), ModelError> {
        model.check_by::<C>()?;
        self.checksum = model.checksum();
        self.model = Ok(model);
        self.begin();
        Ok(())
    }

    fn begin(&mut self) {
        let Ok(model) = &self.model else {
            return;
        };
        let mut last_g_mm = [[f32::NAN; 2]; MAX_PLANES];
        let known = self.estimator.as_ref().map_or(&[][..], Estimator::last_g_mm);
        if known.len() == model.planes.len() {
            for (place, &last) in last_g_mm.iter_mut().zip(known) {
                *place = last;
            }
        }
        self.estimator = Some(Estimator::new(Tracker::resume(model, &last_g_mm), &[]));
        self.forget();
        self.detector = Detector::default();
    }

    /// Begins a new record: the model's initial unbalance, no residual level and no reference. A latched flag stays up.
    pub fn restart(&mut self) {
        self.estimator = self.model().map(|model| Estimator::new(Tracker::new(model), &[]));
        self.forget();
        self.detector = Detector::latched_only(&self.detector);
    }

    /// Goes on from a memory, after [`Monitor::load`]; `false` for one of another model.
    #[inline(never)]
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

    /// What must survive a loss of power.
    #[inline(never)]
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

    /// What is known of the machine at this time.
    pub fn status(&self, time_us: u64) -> Status {
        let age_us = self.age_us(time_us);
        let (state, reason, missing_mask) = self.state(self.is_outdated(time_us));
        let latched = self.detector.latched().filter(|_| state != NodeState::NoModel);
        Status {
            state: if latched.is_some() { NodeState::Flagged } else { state },
            reason,
            missing_mask,
            cause: latched.map_or(Reason::None, |latched| latched.cause),
            suspect: latched.and_then(|latched| latched.suspect),
            age_s: age_us.map_or(f32::INFINITY, |us| us as f32 * 1e-6),
        }
    }

    /// The last verdict stands and is suspicious, whatever flag is up.
    #[cfg(feature = "can")]
    pub(crate) fn is_suspicious(&self, time_us: u64) -> bool {
        self.state(self.is_outdated(time_us)).0 == NodeState::Suspicious
    }

    /// The last verdict is older than the age limit.
    pub(crate) fn is_outdated(&self, time_us: u64) -> bool {
        self.age_us(time_us).is_some_and(|age_us| age_us > self.age_limit_us())
    }

    /// When the last verdict will be too old, µs; `None` before the first. It may lie in the past.
    pub fn outdated_at(&self) -> Option<u64> {
        let judged_us = self.detector.judged_us()?;
        Some(judged_us.saturating_add(self.age_limit_us()).saturating_add(1))
    }

    fn age_us(&self, time_us: u64) -> Option<u64> {
        self.detector.judged_us().map(|judged_us| time_us.saturating_sub(judged_us))
    }

    fn age_limit_us(&self) -> u64 {
        (self.thresholds.age_limit_s * 1e6) as u64
    }

    /// State, reason and mask of missing probes; a latched flag is not looked at.
    fn state(&self, is_outdated: bool) -> (NodeState, Reason, u8) {
        let (mask, why_missing) = self.missing;
        let (state, reason) = match (&self.model, &self.verdict, self.blind) {
            (Err(reason), ..) => (NodeState::NoModel, *reason),
            (_, None, None) => (NodeState::Waiting, Reason::NoReading),
            (_, None, Some(blind)) => (NodeState::Blind, blind),
            (_, Some(_), blind) if is_outdated => (NodeState::Stale, blind.unwrap_or(Reason::Age)),
            (_, Some(_), Some(blind)) => (NodeState::Blind, blind),
            (_, Some(verdict), None) if verdict.is_suspicious() => {
                let mask = if verdict.reason == Reason::Probe { verdict.changed_mask } else { mask };
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
    #[inline(never)] // a frame of its own: in that of a caller who holds the monitor, every access takes longer code
    pub fn take(&mut self, time_us: u64, reading: &Reading, keyphasor: Keyphasor) -> Taken {
        let (track, thresholds) = (&self.track, &self.thresholds);
        let (Ok(model), Some(estimator)) = (&self.model, &mut self.estimator) else {
            return Taken::Unmodelled;
        };
        let screened = screen(model, thresholds, keyphasor, reading);
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
                return Taken::Unsolved;
            }
        };
        let evidence = Evidence { raw: screened.suspicion, ..Evidence::new(model, &estimate, &averaged) };
        let before = *self.detector.baseline();
        let judged = match evidence.why_unjudged(thresholds) {
            None => Ok(self.detector.update(thresholds, time_us, &evidence)),
            Some(reason) => Err(reason),
        };
        if !judged.is_ok_and(|verdict| !verdict.is_suspicious()) {
            estimator.distrust();
        }
        let judgement = Judgement {
            used_mask: screened.reading.valid_mask(),
            why_missing: screened.why_missing,
            floor_um: evidence.greater_floor_um(thresholds),
            is_news: self.detector.has_news_since(&before),
            verdict: judged,
        };
        self.estimate = Some(estimate);
        self.blind = judged.err();
        self.verdict = judged.ok().or(self.verdict);
        Taken::Estimated(judgement)
    }

    fn pass_over(&mut self, unusable: Unusable) -> Taken {
        let (evaluated, reason, missing) = match unusable {
            Unusable::Rejected(reason) => (Taken::Rejected, reason, (0, Reason::None)),
            Unusable::Skipped { reason, missing_mask: 0 } => (Taken::Skipped, reason, (0, Reason::None)),
            Unusable::Skipped { reason, missing_mask } => (Taken::Skipped, reason, (missing_mask, reason)),
        };
        (self.blind, self.missing) = (Some(reason), missing);
        evaluated
    }
}

fn why_no_model(error: ModelError) -> Reason {
    match error {
        ModelError::Schema => Reason::Schema,
        ModelError::BasisSize | ModelError::Probes | ModelError::Planes => Reason::Size,
        _ => Reason::Damaged,
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
