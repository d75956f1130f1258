//! Method 4 as it would have gone day by day: each reading with what was known on its day.
//!
//! The joint method lets later days speak of earlier ones. Here it is asked again and again, of the record up to a reading
//! and of the run-ups until then, and only its newest answer counts: so the answer of a day is that of the whole record up
//! to that day, by what it is. Everything is learned anew each time, how bearings wander as well.

use rayon::prelude::*;

use super::answer::{Config, Flag};
use super::joint::{Event, Later};
use super::{Track, track};
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;

/// Records that are followed at a time, between two reports of progress.
const AT_A_TIME: usize = 8;

/// Follows a record by [`super::Method::Joint`] as [`track`] does, with the estimates of every `every`th reading, and of the
/// last, as they were on their day, and its flags as they went up. What was learned beside is of the whole record.
/// Readings so early that nothing could be said are left out. `progress` hears how many readings of how many are done.
///
/// # Errors
/// As [`track`] of the whole record.
pub fn as_known_then(
    rotor: &Rotor,
    record: &[Reading],
    runup: &[Reading],
    later: &[Later],
    config: &Config,
    every: usize,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Track, Error> {
    let mut whole = track(rotor, record, runup, later, config, &mut |_, _| ())?;
    let until = |last: usize| -> Option<Track> {
        let known = &record[..=last];
        let now_d = super::record::time_d(last, &record[last]);
        let later: Vec<Later> = later.iter().filter(|l| l.time_d <= now_d).cloned().collect();
        track(rotor, known, runup, &later, config, &mut |_, _| ()).ok()
    };
    let count = record.len();
    let mut asked: Vec<usize> = (0..count).rev().step_by(every.max(1)).skip(1).collect();
    asked.reverse();
    let (mut estimates, mut outlooks, mut flags) = (Vec::new(), Vec::new(), Vec::new());
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
            outlooks.extend(joint.known_then.last().copied());
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
        joint.known_then = outlooks;
    }
    Ok(whole)
}

/// Whether two events are one that was placed on other days as more became known.
fn same(one: &Event, other: &Event) -> bool {
    const NEAR_D: f64 = 3.0;
    one.interval_d.low - NEAR_D <= other.interval_d.high
        && other.interval_d.low - NEAR_D <= one.interval_d.high
}
