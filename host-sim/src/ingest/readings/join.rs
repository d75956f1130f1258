//! Rows that hold different probes of one reading, joined.

use std::collections::HashMap;

use super::record::Record;
use crate::ingest::calendar::Moment;

/// Rows of one reading are this many times closer to each other than to the next reading of the same probe.
const CLOSER: f64 = 4.0;
/// And of one speed, relative.
const SAME_SPEED: f64 = 0.01;
/// Where no probe was read twice, rows of one reading are within this, days.
const ONE_MINUTE_D: f64 = 1.0 / 1440.0;

/// Joins rows of one run and moment, or of one speed where there are no moments, whose probes differ.
pub fn equal(record: &mut Record) {
    let probes = record.probes.len();
    let all = record.samples.len();
    if (0..all).all(|at| record.holds(at).iter().all(|held| *held)) {
        return;
    }
    let mut groups: HashMap<(Option<u32>, u64), Group> = HashMap::new();
    let mut kept = Vec::new();
    for at in 0..all {
        let sample = record.samples[at];
        let moment = match sample.when {
            Some(when) => when.bits(),
            None => sample.speed_rpm.to_bits(),
        };
        let group = groups.entry((sample.run, moment)).or_default();
        if group.lacking.is_empty() {
            group.lacking.resize(probes, 0);
        }
        match group.place(record, at) {
            Some(place) => record.join(place, at),
            None => {
                group.readings.push(at);
                kept.push(at);
            }
        }
    }
    if kept.len() < all {
        record.keep(&kept);
    }
}

/// Readings of one moment.
#[derive(Default)]
struct Group {
    readings: Vec<usize>,
    /// Of each probe the first of the readings that may lack it, so that no row looks through all of them.
    lacking: Vec<usize>,
}

impl Group {
    /// The first reading that lacks every probe that a row holds.
    fn place(&mut self, record: &Record, row: usize) -> Option<usize> {
        let held = record.holds(row);
        let mut from = 0;
        for p in (0..held.len()).filter(|p| held[*p]) {
            let is_full = |at: &usize| record.holds(*at)[p];
            while self.readings.get(self.lacking[p]).is_some_and(is_full) {
                self.lacking[p] += 1;
            }
            from = from.max(self.lacking[p]);
        }
        let lacks = |at: &&usize| record.holds(**at).iter().zip(held).all(|(a, b)| !(*a && *b));
        self.readings[from..].iter().find(lacks).copied()
    }
}

/// How many rows were joined with one before them, and how far they are apart at most, days.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JoinedRows {
    pub rows: usize,
    pub apart_d: f64,
}

/// Joins rows of one run whose probes were read shortly one after the other.
pub fn staggered(record: &mut Record) -> JoinedRows {
    let mut joined = JoinedRows::default();
    let is_whole = |at: usize| record.holds(at).iter().all(|held| *held);
    let first = record.samples.first().and_then(|sample| sample.when);
    let (Some(first), false) = (first, (0..record.samples.len()).all(is_whole)) else { return joined };
    let days: Vec<f64> = record
        .samples
        .iter()
        .map(|s| s.when.and_then(|when| when.days_since(first)).unwrap_or(f64::NAN))
        .collect();
    let mut order: Vec<usize> = (0..days.len()).collect();
    order.sort_by(|a, b| days[*a].total_cmp(&days[*b]));
    let within_d = spacing_d(record, &order, &days).map_or(ONE_MINUTE_D, |spacing| spacing / CLOSER);
    order.sort_by_key(|at| record.samples[*at].run);
    let mut gone = vec![false; days.len()];
    let mut place: Option<usize> = None;
    for at in order {
        let is_near = |place: &usize| {
            let [a, b] = [record.samples[*place], record.samples[at]];
            a.run == b.run
                && days[at] - days[*place] <= within_d
                && (a.speed_rpm.is_nan()
                    || b.speed_rpm.is_nan()
                    || (a.speed_rpm / b.speed_rpm - 1.0).abs() <= SAME_SPEED)
                && record.holds(*place).iter().zip(record.holds(at)).all(|(a, b)| !(*a && *b))
        };
        match place.filter(is_near) {
            Some(place) => {
                joined.rows += 1;
                joined.apart_d = joined.apart_d.max(days[at] - days[place]);
                record.join(place, at);
                gone[at] = true;
            }
            None => place = Some(at),
        }
    }
    if joined.rows > 0 {
        let kept: Vec<usize> = (0..gone.len()).filter(|at| !gone[*at]).collect();
        record.keep(&kept);
    }
    joined
}

/// The usual time between two readings of one probe, of the probe that is read most often; nothing if none is read twice.
fn spacing_d(record: &Record, order: &[usize], days: &[f64]) -> Option<f64> {
    let of_probe = |p: usize| {
        let seen: Vec<f64> = order.iter().filter(|at| record.holds(**at)[p]).map(|at| days[*at]).collect();
        let mut steps: Vec<f64> = seen.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied()
    };
    (0..record.probes.len()).filter_map(of_probe).reduce(f64::min)
}

impl Moment {
    /// A number that is the same for the same moment.
    fn bits(self) -> u64 {
        match self {
            Self::Zoned(us) | Self::Local(us) | Self::OfDay(us) => us as u64,
            Self::Elapsed(days) => days.to_bits(),
        }
    }
}
