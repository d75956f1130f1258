//! Method 4 online: the estimate of each reading uses only data up to its day.
//!
//! The joint method is a smoother: later days change the estimates of earlier ones. Here its filter goes on from reading to
//! reading, at one evaluation of the machine for each explanation ([`Follower`]). Process model, events and explanations are
//! learned anew when the record has grown by a tenth since the last event, after three impossible readings in a row, and
//! when an outage or a run-up is stated. So the work for a reading does not grow with the record.

use super::Track;
use super::answer::{Config, Flag, ReadingEstimate};
use super::daily::Tracking;
use super::joint::{Event, Follower, LaterRunup};
use super::track;
use crate::error::Error;
use crate::forecast::filter_state::FilterState;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;

/// Growth of the record since its last event after which everything is learned anew.
const GROWTH: f64 = 0.1;
/// Impossible readings in a row that indicate an event.
const IN_A_ROW: usize = 3;

/// Work that was done online.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Work {
    /// How often everything was learned anew.
    refits: usize,
    /// Evaluations of the machine between these.
    evaluations: usize,
}

/// Follows a record by [`super::Method::Joint`] as [`track`] does, but estimates every `every`th reading and the last
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
    let mut online = Online::new(rotor, record, runup, later, config);
    let last = record.len() - 1;
    let (mut estimates, mut filter_states) = (Vec::new(), Vec::new());
    for row in 0..last {
        let is_asked = (last - row).is_multiple_of(every.max(1));
        if let Some((estimate, known)) = online.take(row)?.filter(|_| is_asked) {
            estimates.push(estimate);
            filter_states.push(known);
        }
        progress(row + 1, record.len());
    }
    // of the last day the record knows nothing later
    if let Some(joint) = &whole.joint {
        online.claim(&joint.events, &whole.flags, row_time_d(record, last));
    }
    if let (Some(estimate), Some(joint)) = (whole.estimates.last().filter(|e| e.row == last), &whole.joint) {
        filter_states.extend(joint.filter_states.last().copied());
        estimates.push(estimate.clone());
    }
    progress(record.len(), record.len());
    whole.remarks.push(format!(
        "Each of the {} estimates is what was known on its day, of the record until then.",
        estimates.len()
    ));
    whole.fixed.retain(|fixed| estimates.iter().any(|e| e.row == fixed.row));
    (whole.estimates, whole.flags) = (estimates, online.flags);
    if let Some(joint) = &mut whole.joint {
        joint.filter_states = filter_states;
    }
    Ok(whole)
}

fn row_time_d(record: &[Reading], row: usize) -> f64 {
    super::record::time_d(row, &record[row])
}

/// A record that is followed reading by reading.
struct Online<'a> {
    rotor: &'a Rotor,
    record: &'a [Reading],
    runup: &'a [Reading],
    later: &'a [LaterRunup<'a>],
    config: &'a Config,
    fit: Option<Fit>,
    /// Events that were claimed, and the flags that they raised.
    events: Vec<Event>,
    flags: Vec<Flag>,
    work: Work,
}

/// What was learned last.
struct Fit {
    follower: Follower,
    /// Its last row, and the first row since the last event.
    row: usize,
    since: usize,
    /// Outages and run-ups that were known.
    stated: [usize; 2],
    impossible: usize,
}

impl<'a> Online<'a> {
    fn new(
        rotor: &'a Rotor,
        record: &'a [Reading],
        runup: &'a [Reading],
        later: &'a [LaterRunup<'a>],
        config: &'a Config,
    ) -> Self {
        let (events, flags) = (Vec::new(), Vec::new());
        Self { rotor, record, runup, later, config, fit: None, events, flags, work: Work::default() }
    }

    /// Outages and run-ups that are known on a day.
    fn stated(&self, now_d: f64) -> [usize; 2] {
        let outages = self.config.outages.iter().filter(|outage| outage.to_d <= now_d);
        [outages.count(), self.later.iter().filter(|l| l.time_d <= now_d).count()]
    }

    /// Takes a reading in; its estimate, unless it is too early for one.
    fn take(&mut self, row: usize) -> Result<Option<(ReadingEstimate, [FilterState; 4])>, Error> {
        let stated = self.stated(row_time_d(self.record, row));
        let Some(fit) = self.fit.as_mut().filter(|fit| fit.stated == stated) else {
            // what is stated anew ends what was known
            self.fit = None;
            return Ok(self.learn(row));
        };
        let Some(followed) = fit.follower.take(row, &self.record[row])? else { return Ok(None) };
        self.work.evaluations += followed.evaluations;
        fit.impossible = if followed.is_impossible { fit.impossible + 1 } else { 0 };
        let grown = (row - fit.row) as f64 >= GROWTH * (fit.row + 1 - fit.since) as f64;
        let is_due = grown || fit.impossible >= IN_A_ROW;
        if let Some(found) = is_due.then(|| self.learn(row)).flatten() {
            return Ok(Some(found));
        }
        Ok(Some((followed.estimate, followed.filter_states)))
    }

    /// Learns everything from the record up to a row; its estimate, if that is possible.
    fn learn(&mut self, row: usize) -> Option<(ReadingEstimate, [FilterState; 4])> {
        let now_d = row_time_d(self.record, row);
        let outages = self.config.outages.iter().filter(|outage| outage.to_d <= now_d).copied().collect();
        let config = Config { outages, ..self.config.clone() };
        let later: Vec<LaterRunup> = self.later.iter().filter(|l| l.time_d <= now_d).cloned().collect();
        let known = &self.record[..=row];
        let tracking = Tracking::begin(self.rotor, known, self.runup, &config).ok()?;
        self.work.refits += 1;
        let (run, joint, follower) = tracking.joint_to_go_on(known, self.runup, &later).ok()?;
        self.claim(&joint.events, &run.flags, now_d);
        let since = joint.events.iter().map(|e| e.time_d).fold(f64::NEG_INFINITY, f64::max);
        let since = (0..=row).find(|k| row_time_d(self.record, *k) >= since).unwrap_or(0);
        let stated = self.stated(now_d);
        self.fit = Some(Fit { follower, row, since, stated, impossible: 0 });
        let estimate = tracking.with_weights(run.estimates).pop().filter(|e| e.row == row)?;
        Some((estimate, *joint.filter_states.last()?))
    }

    /// Claims events that are not known yet, on a day.
    fn claim(&mut self, events: &[Event], flags: &[Flag], time_d: f64) {
        for (event, flag) in events.iter().zip(flags) {
            if !self.events.iter().any(|known| same(known, event)) {
                self.events.push(*event);
                self.flags.push(Flag { time_d, ..*flag });
            }
        }
    }
}

/// Whether two events are the same: with more data its estimated day moves.
fn same(one: &Event, other: &Event) -> bool {
    const NEAR_D: f64 = 3.0;
    one.interval_d.low - NEAR_D <= other.interval_d.high
        && other.interval_d.low - NEAR_D <= one.interval_d.high
}

#[cfg(test)]
pub(in crate::track) mod tests {
    use nalgebra::{Complex, DVector};
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::machine::drawing::Noise;
    use crate::model::Model;
    use crate::testing::sample_rotor;
    use crate::track::answer::Method;
    use crate::units::rad_s;

    const NOISE: Noise =
        Noise { relative: 0.02, floor_um: 0.03, scale: None, correlation: None, between_runs: None };

    /// A run-up of the sample and so many days of it with a drifting unbalance.
    pub fn record(days: usize) -> (Rotor, Vec<Reading>, Vec<Reading>) {
        let rotor = Rotor { noise: Some(NOISE), ..sample_rotor() };
        let model = Model::finite_elements(&rotor);
        let mut random = StdRng::seed_from_u64(7);
        let mut read = |time_d: f64, speed_rpm: f64| {
            let unbalance = DVector::from_vec(vec![
                Complex::from_polar(4e-4 * (1.0 + 0.002 * time_d), 0.3),
                Complex::from_polar(3e-4, -1.0 + 0.003 * time_d),
            ]);
            let shown = model.response(rad_s(speed_rpm)).unwrap().at(&unbalance);
            let mut normal = || random.sample::<f64, _>(StandardNormal);
            let noisy = |y: &Complex<f64>| Some(y + Complex::new(normal(), normal()) * NOISE.sigma_m(*y));
            let probes = shown.iter().map(noisy).collect();
            Reading { time_d: Some(time_d), speed_rpm, probes, ..Reading::default() }
        };
        let runup = (0..20).map(|k| read(0.0, 1500.0 + 500.0 * f64::from(k))).collect();
        let days = (0..days).map(|day| read(day as f64, 11_000.0)).collect();
        (rotor, days, runup)
    }

    #[test]
    fn online_work_of_a_reading_does_not_grow_with_the_record() {
        let (rotor, days, runup) = record(48);
        let config = Config::new(Method::Joint);
        let mut online = Online::new(&rotor, &days, &runup, &[], &config);
        let mut refits = Vec::new();
        for row in 0..days.len() {
            let before = online.work;
            let found = online.take(row).unwrap();
            assert_eq!(found.is_some(), row + 1 >= crate::track::faults::FEWEST, "row {row}");
            let (evaluated, refitted) =
                (online.work.evaluations - before.evaluations, online.work.refits - before.refits);
            if refitted > 0 {
                refits.push(row + 1);
            }
            // the most probable explanation and its estimate, and each of a few rivals
            assert!(refitted <= 1 && evaluated <= 2 + 4, "row {row}: {evaluated} {refitted}");
        }
        // 10, then after each tenth more, rounded up
        let expected: Vec<usize> = [10, 11, 13, 15, 17, 19, 21, 24, 27, 30, 33, 37, 41, 46].into();
        assert!(refits.len() <= expected.len() + 1, "{refits:?}");
        assert!(online.flags.is_empty(), "{:?}", online.flags);
    }
}
