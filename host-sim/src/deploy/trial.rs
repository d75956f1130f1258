//! A model on trial: what the residuals said before it, what they say with it, and which of the two is to stay.

mod run;

use std::time::Duration;

use anyhow::{Result, bail};
use rotor_edge_core::can::{Message, ResultAssembler};
use rotor_edge_core::command::{Answer, Command};

use super::{Authority, HEARTBEAT_TIME, PATIENCE, no_monitor};
use crate::bus::CanBus;
pub use run::{Candidate, TrialResult, run};

/// Consecutive parts, equal in readings, that a time is divided into: readings near each other are alike, so that they
/// count as one part's median, and not each.
pub const PARTS: usize = 9;
/// What a monitor waits beyond the time asked for, s: a confirmation over a bus that loses frames takes several.
const GRACE_S: u32 = 15;
/// A trial of so many seconds ends one that is under way, and lets the answer out before.
const LAST_S: u32 = 1;
/// Longest time until a monitor that takes its old model back has started anew and said so.
const RETURN_TIME: Duration = Duration::from_secs(10);

/// The model that a monitor uses, by its own word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelState {
    /// Its checksum, zero without one.
    pub checksum: u32,
    pub on_trial: bool,
}

/// Residuals and model of a monitor over a time.
#[derive(Debug, Clone, Default)]
pub struct Observation {
    /// Its residuals relative to the vibration, of the readings that it judged, in their order.
    pub ratios: Vec<f32>,
    /// Which model it used throughout, if it said so.
    pub model: Option<ModelState>,
}

/// Listens to monitor `node` for a time, or until it says that it uses another model than `expected`, or than it said first.
///
/// # Errors
/// If the bus fails, or the monitor says nothing.
pub fn listen(
    bus: &mut dyn CanBus,
    node: u8,
    time: Duration,
    expected: Option<ModelState>,
    mut progress: impl FnMut(Duration),
) -> Result<Observation> {
    let started = bus.now();
    let mut results = ResultAssembler::new();
    let mut observed = Observation { ratios: Vec::new(), model: expected };
    let (mut changed, mut is_there) = (false, false);
    // a heartbeat at least, however short the time
    while !changed && bus.now() - started < if is_there { time } else { time.max(HEARTBEAT_TIME) } {
        progress(bus.now() - started);
        let Some(frame) = bus.receive(PATIENCE)? else { continue };
        if frame.node() != node {
            continue;
        }
        if let Ok((_, Message::Model { checksum, on_trial, .. })) = Message::decode(&frame) {
            let model = ModelState { checksum, on_trial };
            is_there = true;
            changed = observed.model.is_some_and(|before| before != model);
            observed.model = Some(model);
        } else if let Some(result) =
            results.receive(&frame).filter(|what| what.is_judged() && what.ratio.is_finite())
        {
            observed.ratios.push(result.ratio);
        }
    }
    if !is_there {
        bail!(no_monitor(bus, node));
    }
    Ok(observed)
}

/// Which of two models describes the machine better, by the residuals of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrialVerdict {
    /// The monitor runs this model already: there is nothing to try.
    Unchanged,
    /// Fewer readings with one of them than there are parts.
    TooFewReadings,
    /// The new one is no worse.
    NoWorse,
    /// The new one's median lies above those of all parts of the old one's time. Of equal models nine parts each would say so
    /// by chance in 1.5 % of all trials, 126 of 8568: the upper five of the eighteen would have to be the new one's.
    Worse,
}

/// The medians of consecutive parts; `None` if there are fewer readings than parts.
fn medians(ratios: &[f32]) -> Option<[f32; PARTS]> {
    let bound = |part: usize| part * ratios.len() / PARTS;
    (ratios.len() >= PARTS).then(|| std::array::from_fn(|part| median(&ratios[bound(part)..bound(part + 1)])))
}

/// The upper one of two in the middle; of none, not a number.
pub fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f32::NAN)
}

/// Holds the residuals with the new model against those with the old one.
pub fn compare(old: &[f32], new: &[f32]) -> TrialVerdict {
    match (medians(old), medians(new)) {
        (Some(old), Some(new)) if old.iter().all(|part| median(&new) > *part) => TrialVerdict::Worse,
        (Some(_), Some(_)) => TrialVerdict::NoWorse,
        _ => TrialVerdict::TooFewReadings,
    }
}

/// Has a model tried for a time, and a little longer for the confirmation.
///
/// # Errors
/// As [`Authority::command`].
pub fn begin(
    authority: &mut Authority,
    bus: &mut dyn CanBus,
    model: &[u8],
    time: Duration,
    progress: impl FnMut(usize),
) -> Result<Answer> {
    let seconds = u32::try_from(time.as_secs()).unwrap_or(u32::MAX).saturating_add(1 + GRACE_S);
    authority.command(bus, Command::Trial, &body(seconds, model), progress)
}

/// Has the monitor take its old model back at once, and waits until it says so; whether it did.
///
/// # Errors
/// If the bus fails.
pub fn end(authority: &mut Authority, bus: &mut dyn CanBus, model: &[u8], old: ModelState) -> Result<bool> {
    // a monitor that does not hear this ends the trial by its own clock
    let is_heard = authority.command(bus, Command::Trial, &body(LAST_S, model), |_| ()).is_ok();
    let grace = if is_heard { Duration::ZERO } else { Duration::from_secs(GRACE_S.into()) };
    let end = bus.now() + RETURN_TIME + grace;
    while bus.now() < end {
        let Some(frame) = bus.receive(PATIENCE)? else { continue };
        if let Ok((from, Message::Model { checksum, on_trial, .. })) = Message::decode(&frame)
            && (from, ModelState { checksum, on_trial }) == (authority.node(), old)
        {
            return Ok(true);
        }
    }
    Ok(false)
}

fn body(seconds: u32, model: &[u8]) -> Vec<u8> {
    [&seconds.to_le_bytes()[..], model].concat()
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng as _, SeedableRng as _};
    use rand_xoshiro::Xoshiro128PlusPlus;

    use super::*;

    fn scattered(random: &mut Xoshiro128PlusPlus, readings: usize, level: f32) -> Vec<f32> {
        (0..readings).map(|_| level * (0.8 + 0.4 * random.next_u32() as f32 / u32::MAX as f32)).collect()
    }

    #[test]
    fn with_fewer_readings_than_parts_nothing_is_said() {
        let enough = [0.1; PARTS];
        assert_eq!(compare(&enough[1..], &enough), TrialVerdict::TooFewReadings);
        assert_eq!(compare(&enough, &[]), TrialVerdict::TooFewReadings);
        assert_eq!(compare(&enough, &enough), TrialVerdict::NoWorse);
    }

    #[test]
    fn worse_model_is_named_and_one_outlier_decides_nothing() {
        let mut random = Xoshiro128PlusPlus::seed_from_u64(1);
        let old = scattered(&mut random, 200, 0.05);
        assert_eq!(compare(&old, &scattered(&mut random, 300, 0.07)), TrialVerdict::Worse);
        assert_eq!(compare(&old, &scattered(&mut random, 100, 0.03)), TrialVerdict::NoWorse);
        let mut settling = scattered(&mut random, 180, 0.04);
        settling[..60].fill(0.9);
        assert_eq!(compare(&old, &settling), TrialVerdict::NoWorse);
    }

    #[test]
    fn equal_models_are_called_worse_as_often_as_theory_says() {
        // C(9, 5) / C(18, 5)
        let expected = 126.0 / 8568.0;
        let mut random = Xoshiro128PlusPlus::seed_from_u64(2);
        let trials = 40_000;
        let worse = (0..trials).filter(|_| {
            let [old, new] = [(); 2].map(|()| scattered(&mut random, 27, 1.0));
            compare(&old, &new) == TrialVerdict::Worse
        });
        let share = worse.count() as f64 / f64::from(trials);
        let deviation = (expected * (1.0 - expected) / f64::from(trials)).sqrt();
        assert!((share - expected).abs() < 4.0 * deviation, "{share} for {expected} ± {deviation}");
    }
}
