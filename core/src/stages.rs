//! The stages from a reading to an estimate, as a node runs them: screen, hold against the readings before, average,
//! bound, estimate. What follows, the judgement of the estimate, is that of [`detector`](crate::detector).

mod raw;

use crate::detector::{Average, AveragedReading, Growth};
use crate::model::{MAX_PLANES, Model, Pair};
use crate::numerics::Numerics;
use crate::reading::{Keyphasor, Reading};
use crate::scalar;
use crate::state::Reason;
use crate::thresholds::Thresholds;
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};
pub use raw::RawHistory;

/// No probe reads more than this, µm: a feature beyond it is a fault of transmission or scaling.
pub const MAX_PLAUSIBLE_UM: f32 = 10_000.0;

/// A reading with at least one usable probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScreenedReading {
    /// Probes that the model masks and probes whose gap voltage is out of range are lost in it.
    pub reading: Reading,
    /// Bit i: probe i is lost and the model uses it.
    pub missing_mask: u8,
    /// [`Reason::None`] if no probe is lost.
    pub why_missing: Reason,
    /// [`Reason::Scatter`] if the raw readings up to this one scatter too much, else [`Reason::None`].
    pub suspicion: Reason,
}

/// Why a reading gives no estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unusable {
    /// Speed, features or number of probes are impossible for the model.
    Rejected(Reason),
    /// The keyphasor or the phases cannot be believed, or every probe is lost.
    Skipped {
        /// [`Reason::Keyphasor`], [`Reason::Probes`], [`Reason::Gap`], [`Reason::Repeated`] or [`Reason::Scatter`].
        reason: Reason,
        /// Bit i: probe i is lost; zero where keyphasor or scatter is the reason.
        missing_mask: u8,
    },
}

/// The usable part of a reading.
///
/// Errors: the first fault in the order number of probes, keyphasor, speed, features, lost probes.
#[inline(never)]
pub fn screen<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
    thresholds: &Thresholds,
    keyphasor: Keyphasor,
    reading: &Reading,
) -> Result<ScreenedReading, Unusable> {
    if reading.probes().len() != model.probes.len() {
        return Err(Unusable::Rejected(Reason::ProbeCount));
    }
    if !keyphasor.is_usable() {
        return Err(Unusable::Skipped { reason: Reason::Keyphasor, missing_mask: 0 });
    }
    if !model.covers(reading.speed_rpm) {
        return Err(Unusable::Rejected(Reason::Speed));
    }
    let mut reading = *reading;
    reading.lose(model.masked);
    if is_implausible(&reading) {
        return Err(Unusable::Rejected(Reason::Absurd));
    }
    let used = all_probes(&reading) & !model.masked;
    let gaps = used & probes_out_of_gap(&reading, thresholds.gap_range_v);
    reading.lose(gaps);
    let missing_mask = used & !reading.valid_mask();
    let why_missing = match (missing_mask, gaps) {
        (0, _) => Reason::None,
        (_, 0) => Reason::Probes,
        _ => Reason::Gap,
    };
    if missing_mask == used {
        return Err(Unusable::Skipped { reason: why_missing, missing_mask });
    }
    Ok(ScreenedReading { reading, missing_mask, why_missing, suspicion: Reason::None })
}

impl ScreenedReading {
    /// Loses further probes, for this reason.
    fn lose(&mut self, mask: u8, reason: Reason) {
        if mask != 0 {
            self.reading.lose(mask);
            self.missing_mask |= mask;
            self.why_missing = reason;
        }
    }
}

/// A lost probe (NaN) is not absurd.
fn is_implausible(reading: &Reading) -> bool {
    reading
        .probes()
        .iter()
        .any(|probe| probe.cos_um.abs() > MAX_PLAUSIBLE_UM || probe.sin_um.abs() > MAX_PLAUSIBLE_UM)
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

/// Greatest step of the unbalance after an acknowledgement, relative to the greatest of any plane: a trial weight on a well
/// balanced rotor. The certificate's rounding is a part of the bound, so a bound must be none beyond need.
const OPEN: f32 = 32.0;

/// State of the stages average, bound and estimate, which a reading passes in this order.
#[derive(Debug, Clone)]
pub struct Estimator<const PLANES: usize> {
    tracker: Tracker<PLANES>,
    average: Average,
    growth: Growth,
    trusted: Trusted<PLANES>,
    /// As it was before the last estimate.
    before: Trusted<PLANES>,
}

/// The unbalance last trusted.
#[derive(Debug, Clone, Copy)]
struct Trusted<const PLANES: usize> {
    unbalance_g_mm: [Pair; PLANES],
    /// With the noise that averaging left.
    deviation_g_mm: [f32; MAX_PLANES],
    /// There was none since an acknowledgement.
    is_open: bool,
}

impl<const PLANES: usize> Estimator<PLANES> {
    /// Goes on from the tracker's unbalance, which was at most `most_g_mm` ([`Estimator::most_g_mm`]); planes that are not
    /// given are bounded by what they are.
    pub fn new(tracker: Tracker<PLANES>, most_g_mm: &[f32]) -> Self {
        let is_open = most_g_mm.contains(&f32::MAX);
        let growth = if is_open { Growth::default() } else { Growth::resume(most_g_mm, tracker.last_g_mm()) };
        let trusted = Trusted::new(&tracker, [f32::NAN; MAX_PLANES], is_open);
        Self { tracker, average: Average::default(), growth, trusted, before: trusted }
    }

    /// Goes on from an unbalance that was found elsewhere for the last reading, with the deviation last found here.
    pub fn correct(&mut self, tracker: Tracker<PLANES>) {
        let deviation_g_mm = self.trusted.deviation_g_mm;
        let most_g_mm = Growth::default().most_g_mm(tracker.last_g_mm(), &deviation_g_mm);
        let trusted = Trusted::new(&tracker, deviation_g_mm, false);
        *self = Self { trusted, before: trusted, ..Self::new(tracker, &most_g_mm) };
    }

    /// The unbalance `[U cos α, U sin α]` of each plane last found, g·mm.
    pub fn last_g_mm(&self) -> &[Pair] {
        self.tracker.last_g_mm()
    }

    /// The same of the last estimate that [`Estimator::distrust`] did not take back: what is remembered.
    pub fn trusted_g_mm(&self) -> &[Pair] {
        self.trusted.unbalance_g_mm.get(..self.last_g_mm().len()).unwrap_or_default()
    }

    /// What each plane's unbalance is at most, g·mm: [`Growth::most_g_mm`]; the largest number after an acknowledgement.
    pub fn most_g_mm(&self) -> [f32; MAX_PLANES] {
        if self.trusted.is_open {
            return [f32::MAX; MAX_PLANES];
        }
        self.growth.most_g_mm(self.trusted_g_mm(), &self.trusted.deviation_g_mm)
    }

    /// The last estimate, of a reading that is suspicious or cannot be judged, bounds nothing.
    pub fn distrust(&mut self) {
        self.trusted = self.before;
    }

    /// The unbalance was changed: the next trusted estimate is the first one.
    pub fn forget_bounds(&mut self) {
        self.growth = Growth::default();
        self.trusted.is_open = true;
        self.before = self.trusted;
    }

    /// The mean of the readings up to this one.
    pub fn average(&mut self, thresholds: &Thresholds, time_us: u64, reading: &Reading) -> AveragedReading {
        self.average.update(thresholds.average_s, time_us, reading)
    }

    /// The bound on each plane's unbalance, g·mm, the model's floor left out.
    pub fn bound(&mut self, thresholds: &Thresholds, time_us: u64) -> [f32; MAX_PLANES] {
        let Trusted { unbalance_g_mm, deviation_g_mm, is_open } = self.trusted;
        if is_open {
            let largest =
                unbalance_g_mm.iter().fold(0.0, |most, &plane| scalar::greater(most, scalar::length(plane)));
            return [OPEN * largest; MAX_PLANES];
        }
        let planes = self.tracker.last_g_mm().len();
        let trusted_g_mm = unbalance_g_mm.get(..planes).unwrap_or_default();
        self.growth.bounds_g_mm(thresholds, time_us, trusted_g_mm, &deviation_g_mm)
    }

    /// The unbalance within the bounds. It is trusted until [`Estimator::distrust`].
    ///
    /// Errors: those of [`Tracker::update`]; mean and bounds have then taken the reading nevertheless.
    pub fn estimate<C: Numerics<SHAPES, PROBES, PLANES>, const SHAPES: usize, const PROBES: usize>(
        &mut self,
        config: &TrackConfig,
        model: &Model<SHAPES, PROBES, PLANES>,
        averaged: &AveragedReading,
        bound_g_mm: &[f32; MAX_PLANES],
    ) -> Result<Estimate, TrackError> {
        let estimate = C::update(&mut self.tracker, config, model, &averaged.reading, bound_g_mm)?;
        let share = scalar::sqrt(averaged.variance);
        self.before = self.trusted;
        self.trusted =
            Trusted::new(&self.tracker, estimate.deviation_g_mm.map(|deviation| share * deviation), false);
        Ok(estimate)
    }
}

impl<const PLANES: usize> Trusted<PLANES> {
    fn new(tracker: &Tracker<PLANES>, deviation_g_mm: [f32; MAX_PLANES], is_open: bool) -> Self {
        let mut unbalance_g_mm = [[0.0; 2]; PLANES];
        for (own, &last) in unbalance_g_mm.iter_mut().zip(tracker.last_g_mm()) {
            *own = last;
        }
        Self { unbalance_g_mm, deviation_g_mm, is_open }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::tests::rigid_rotor;
    use crate::reading::ProbeVector;

    fn reading(speed_rpm: f32, cos_um: f32) -> Reading {
        Reading::new(speed_rpm, &[ProbeVector { cos_um, sin_um: 1.0 }; 4]).unwrap()
    }

    fn screened(reading: &Reading) -> Result<ScreenedReading, Unusable> {
        screen(&rigid_rotor(), &Thresholds::DEFAULT, Keyphasor::Locked, reading)
    }

    #[test]
    fn impossible_readings_are_rejected_with_their_reason() {
        let [lowest_rpm, _] = rigid_rotor().speed_range_rpm;
        let three = Reading::new(lowest_rpm, &[ProbeVector { cos_um: 1.0, sin_um: 1.0 }; 3]).unwrap();
        for (reading, reason) in [
            (three, Reason::ProbeCount),
            (reading(0.5 * lowest_rpm, 1.0), Reason::Speed),
            (reading(f32::NAN, 1.0), Reason::Speed),
            (reading(lowest_rpm, -1.01 * MAX_PLAUSIBLE_UM), Reason::Absurd),
        ] {
            assert_eq!(screened(&reading), Err(Unusable::Rejected(reason)));
        }
    }

    #[test]
    fn missing_keyphasor_skips_a_reading_of_any_speed() {
        let reading = reading(f32::NAN, 1.0);
        let screened = screen(&rigid_rotor(), &Thresholds::DEFAULT, Keyphasor::Missing, &reading);
        assert_eq!(screened, Err(Unusable::Skipped { reason: Reason::Keyphasor, missing_mask: 0 }));
    }

    #[test]
    fn probe_out_of_its_gap_range_is_lost_and_named() {
        let [lowest_rpm, _] = rigid_rotor().speed_range_rpm;
        let whole = reading(lowest_rpm, 1.0);
        let screened_whole = screened(&whole).unwrap();
        assert_eq!((screened_whole.missing_mask, screened_whole.why_missing), (0, Reason::None));
        let gap = screened(&whole.with_gaps_v(&[-10.0, -1.0, f32::NAN, -10.0])).unwrap();
        assert_eq!((gap.missing_mask, gap.why_missing), (0b10, Reason::Gap));
        assert_eq!(gap.reading.valid_mask(), 0b1101);
        let mut lost = whole;
        lost.lose(0b1111);
        let skipped = Unusable::Skipped { reason: Reason::Probes, missing_mask: 0b1111 };
        assert_eq!(screened(&lost), Err(skipped));
    }

    #[test]
    fn masked_probe_is_lost_and_is_not_missing_whatever_it_reads() {
        let model = Model { masked: 0b0010, ..rigid_rotor() };
        let [lowest_rpm, _] = model.speed_range_rpm;
        let screened = |reading: &Reading| screen(&model, &Thresholds::DEFAULT, Keyphasor::Locked, reading);
        let mut vectors = [ProbeVector { cos_um: 1.0, sin_um: 1.0 }; 4];
        for (part, gap_v) in [(1.0, -10.0), (f32::NAN, -10.0), (2.0 * MAX_PLAUSIBLE_UM, 0.0)] {
            vectors[1].cos_um = part;
            let reading = Reading::new(lowest_rpm, &vectors).unwrap().with_gaps_v(&[-10.0, gap_v]);
            let used = screened(&reading).unwrap();
            assert_eq!((used.missing_mask, used.why_missing), (0, Reason::None));
            assert_eq!(used.reading.valid_mask(), 0b1101);
        }
        let mut lost = Reading::new(lowest_rpm, &vectors).unwrap();
        lost.lose(0b1101);
        let skipped = Unusable::Skipped { reason: Reason::Probes, missing_mask: 0b1101 };
        assert_eq!(screened(&lost), Err(skipped));
    }
}
