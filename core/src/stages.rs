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
    /// Probes whose gap voltage is out of range are lost in it.
    pub reading: Reading,
    /// Bit i: probe i is lost.
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
pub fn screen<const N: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<N, PROBES, PLANES>,
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
    if is_implausible(reading) {
        return Err(Unusable::Rejected(Reason::Absurd));
    }
    let all = all_probes(reading);
    let gaps = probes_out_of_gap(reading, thresholds.gap_range_v);
    let mut reading = *reading;
    reading.lose(gaps);
    let missing_mask = all & !reading.valid_mask();
    let why_missing = match (missing_mask, gaps) {
        (0, _) => Reason::None,
        (_, 0) => Reason::Probes,
        _ => Reason::Gap,
    };
    if missing_mask == all {
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

/// State of the stages average, bound and estimate, which a reading passes in this order.
#[derive(Debug, Clone)]
pub struct Estimator<const PLANES: usize> {
    tracker: Tracker<PLANES>,
    average: Average,
    growth: Growth,
    /// Of the unbalance last found, with the noise that averaging left.
    deviation_g_mm: [f32; MAX_PLANES],
}

impl<const PLANES: usize> Estimator<PLANES> {
    /// Goes on from the tracker's unbalance, which was at most `most_g_mm` ([`Estimator::most_g_mm`]); planes that are not
    /// given are bounded by what they are.
    pub fn new(tracker: Tracker<PLANES>, most_g_mm: &[f32]) -> Self {
        let growth = Growth::resume(most_g_mm, tracker.last_g_mm());
        Self { tracker, average: Average::default(), growth, deviation_g_mm: [f32::NAN; MAX_PLANES] }
    }

    /// Goes on from an unbalance that was found elsewhere for the last reading, with the deviation last found here.
    pub fn correct(&mut self, tracker: Tracker<PLANES>) {
        let most_g_mm = Growth::default().most_g_mm(tracker.last_g_mm(), &self.deviation_g_mm);
        *self = Self { deviation_g_mm: self.deviation_g_mm, ..Self::new(tracker, &most_g_mm) };
    }

    /// The unbalance `[U cos α, U sin α]` of each plane last found, g·mm.
    pub fn last_g_mm(&self) -> &[Pair] {
        self.tracker.last_g_mm()
    }

    /// What each plane's unbalance is at most, g·mm: [`Growth::most_g_mm`].
    pub fn most_g_mm(&self) -> [f32; MAX_PLANES] {
        self.growth.most_g_mm(self.last_g_mm(), &self.deviation_g_mm)
    }

    /// The mean of the readings up to this one.
    pub fn average(&mut self, thresholds: &Thresholds, time_us: u64, reading: &Reading) -> AveragedReading {
        self.average.update(thresholds.average_s, time_us, reading)
    }

    /// The bound on each plane's unbalance, g·mm, the model's floor left out.
    pub fn bound(&mut self, thresholds: &Thresholds, time_us: u64) -> [f32; MAX_PLANES] {
        self.growth.bounds_g_mm(thresholds, time_us, self.tracker.last_g_mm(), &self.deviation_g_mm)
    }

    /// The unbalance within the bounds.
    ///
    /// Errors: those of [`Tracker::update`]; mean and bounds have then taken the reading nevertheless.
    pub fn estimate<C: Numerics<N, PROBES, PLANES>, const N: usize, const PROBES: usize>(
        &mut self,
        config: &TrackConfig,
        model: &Model<N, PROBES, PLANES>,
        averaged: &AveragedReading,
        bound_g_mm: &[f32; MAX_PLANES],
    ) -> Result<Estimate, TrackError> {
        let estimate = C::update(&mut self.tracker, config, model, &averaged.reading, bound_g_mm)?;
        let share = scalar::sqrt(averaged.variance);
        self.deviation_g_mm = estimate.deviation_g_mm.map(|deviation| share * deviation);
        Ok(estimate)
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
}
