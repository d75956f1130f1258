//! Method 4 filtered: the estimate of each reading uses only data up to its day.
//!
//! The joint method is a smoother: later days change the estimates of earlier ones. Here it runs again for each reading,
//! on the record and run-ups up to that day, and only its newest estimate is kept. Each run learns everything anew,
//! the random walk of the bearings included.

use rayon::prelude::*;

use super::answer::{Config, Flag};
use super::joint::{Event, LaterRunup};
use super::{Track, track};
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;

/// Runs in parallel between two reports of progress.
const AT_A_TIME: usize = 8;

/// Follows a record by [`super::Method::Joint`] as [`track`] does, but re-estimates every `every`th reading and the last
/// from the data up to its day, and dates each flag by the reading that raised it. Constants and process model are of
/// the whole record. Readings too early for an estimate are left out. `progress` takes the readings done and their total.
///
/// # Errors
/// As [`track`] of the whole record.
pub fn filtered(
    rotor: &Rotor,
    record: &[Reading],
    runup: &[Reading],
    later: &[LaterRunup],
    config: &Config,
    every: usize,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Track, Error> {
    let mut whole = track(rotor, record, runup, later, config, &mut |_, _| ())?;
    let until = |last: usize| -> Option<Track> {
        let known = &record[..=last];
        let now_d = super::record::time_d(last, &record[last]);
        let later: Vec<LaterRunup> = later.iter().filter(|l| l.time_d <= now_d).cloned().collect();
        let outages = config.outages.iter().filter(|outage| outage.to_d <= now_d).copied().collect();
        let config = Config { outages, ..config.clone() };
        track(rotor, known, runup, &later, &config, &mut |_, _| ()).ok()
    };
    let count = record.len();
    let mut asked: Vec<usize> = (0..count).rev().step_by(every.max(1)).skip(1).collect();
    asked.reverse();
    let (mut estimates, mut filter_states, mut flags) = (Vec::new(), Vec::new(), Vec::new());
    let mut events: Vec<Event> = Vec::new();
    let mut take = |newest: &Track, last: usize| {
        let (Some(estimate), Some(joint)) = (newest.estimates.last(), &newest.joint) else { return };
        for (event, flag) in joint.events.iter().zip(&newest.flags) {
            if !events.iter().any(|known| same(known, event)) {
                events.push(*event);
                flags.push(Flag { time_d: estimate.time_d, ..*flag });
            }
        }
        if estimate.row == last {
            estimates.push(estimate.clone());
            filter_states.extend(joint.filter_states.last().copied());
        }
    };
    for (round, rows) in asked.chunks(AT_A_TIME).enumerate() {
        let tracks: Vec<Option<Track>> = rows.par_iter().map(|last| until(*last)).collect();
        tracks.iter().zip(rows).for_each(|(newest, last)| newest.iter().for_each(|t| take(t, *last)));
        progress(round * AT_A_TIME + rows.len(), asked.len() + 1);
    }
    take(&whole, count - 1);
    progress(asked.len() + 1, asked.len() + 1);
    whole.remarks.push(format!(
        "Each of the {} estimates is what was known on its day, of the record until then.",
        estimates.len()
    ));
    whole.fixed.retain(|fixed| estimates.iter().any(|e| e.row == fixed.row));
    (whole.estimates, whole.flags) = (estimates, flags);
    if let Some(joint) = &mut whole.joint {
        joint.filter_states = filter_states;
    }
    Ok(whole)
}

/// Whether two events are the same: with more data its estimated day moves.
fn same(one: &Event, other: &Event) -> bool {
    const NEAR_D: f64 = 3.0;
    one.interval_d.low - NEAR_D <= other.interval_d.high
        && other.interval_d.low - NEAR_D <= one.interval_d.high
}
