//! When events took place, what they changed, and how everything moves: what makes the record most
//! probable.

use std::ops::Range;

use nalgebra::DVector;

use super::answer::Event;
use super::kalman::{Gaussian, smooth};
use super::passes::{Change, Pass, Problem};
use super::state::{Motion, Scope};
use crate::track::daily::Tracking;
use crate::track::record::Day;
use crate::track::step::Steps;

/// Rounds of learning before and after the events are settled, and between two events.
const ROUNDS: [usize; 3] = [12, 20, 6];
/// An event has to make the record this much more probable: events are as rare as one in a thousand
/// readings.
const EVIDENCE: f64 = 6.907_755;
/// More events than this that the features' steps do not show are no events but another machine.
const MOST_EVENTS: usize = 6;
/// Impossible readings in a row that are an event.
const IN_A_ROW: usize = 3;

/// The most probable history.
pub struct Found {
    pub motion: Motion,
    pub pass: Pass,
    pub smoothed: Vec<Gaussian>,
    pub events: Vec<Event>,
    /// Their epochs.
    pub at: Vec<usize>,
}

/// A step of the features: the epochs in which it may have taken place, and the likeliest.
#[derive(Debug, Clone)]
pub struct Window {
    pub epochs: Range<usize>,
    pub likely: usize,
}

impl Tracking<'_> {
    /// Steps of the features.
    pub(super) fn steps(&self, problem: &Problem) -> Vec<Window> {
        let complete: Vec<(usize, &Day)> = problem.own().filter(|(_, d)| d.is_complete()).collect();
        let days: Vec<&Day> = complete.iter().map(|(_, d)| *d).collect();
        let persistence = self.config.thresholds.persistence.max(1);
        let mut steps = Steps::default();
        let mut windows: Vec<(Range<usize>, f64, usize)> = Vec::new();
        for k in 0..days.len() {
            if steps.stepped(&days[..=k], persistence) == Some(true) {
                let from = (k + 2).saturating_sub(2 * persistence).max(1);
                let excess = |i: &usize| steps.excess(days[i - 1], days[*i]);
                let sharpest = (from..=k).max_by(|a, b| excess(a).total_cmp(&excess(b))).unwrap_or(k);
                let (window, sharp) = (complete[from].0..complete[k].0 + 1, excess(&sharpest));
                match windows.last_mut() {
                    Some((last, best, likely)) if window.start < last.end => {
                        last.end = window.end;
                        if sharp > *best {
                            (*best, *likely) = (sharp, complete[sharpest].0);
                        }
                    }
                    _ => windows.push((window, sharp, complete[sharpest].0)),
                }
            }
            steps.learn(days[k]);
        }
        windows.into_iter().map(|(epochs, _, likely)| Window { epochs, likely }).collect()
    }
}

impl Problem {
    /// The most probable history, from windows in which an event may have taken place and states to
    /// linearise around.
    pub(super) fn search(
        &self,
        windows: Vec<Window>,
        mut linearised_at: Vec<DVector<f64>>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Option<Found> {
        let whole = Scope { bearings: [true; 2], unbalance: true };
        let mut changes: Vec<Change> = windows.iter().map(|w| (w.likely, whole)).collect();
        let mut windows = windows;
        let mut motion = Motion::default();
        let mut evidence = vec![0.0; changes.len()];
        let mut rounds = 0;
        let total = ROUNDS.iter().sum::<usize>();
        let mut learn =
            |motion: &mut Motion, linearised_at: &mut Vec<DVector<f64>>, changes: &[Change], times: usize| {
                for _ in 0..times {
                    (*motion, *linearised_at) = self.learn(motion, changes, linearised_at)?;
                    rounds += 1;
                    progress(rounds.min(total), total);
                }
                Some(())
            };
        learn(&mut motion, &mut linearised_at, &changes, ROUNDS[0])?;
        let mut tried: Vec<Range<usize>> = Vec::new();
        loop {
            self.settle_events(&motion, &mut linearised_at, &mut windows, &mut changes, &mut evidence)?;
            learn(&mut motion, &mut linearised_at, &changes, ROUNDS[2])?;
            let pass = self.filter(&motion, &changes, Some(&linearised_at))?;
            let missed = (1..pass.impossible.len().saturating_sub(IN_A_ROW - 1)).find(|k| {
                pass.impossible[*k..*k + IN_A_ROW].iter().all(|i| *i)
                    && !windows.iter().any(|w| w.epochs.contains(k))
                    && !tried.iter().any(|t| t.contains(k))
            });
            let Some(missed) = missed.filter(|_| tried.len() < MOST_EVENTS) else { break };
            let end = (missed..pass.impossible.len()).find(|k| !pass.impossible[*k]);
            tried.push(missed..end.unwrap_or(pass.impossible.len()));
            windows.push(Window { epochs: missed..missed + 1, likely: missed });
            changes.push((missed, whole));
            evidence.push(0.0);
            linearised_at = self.settle(&motion, &changes, &linearised_at, false)?.1;
        }
        learn(&mut motion, &mut linearised_at, &changes, ROUNDS[1])?;
        let (pass, _) = self.settle(&motion, &changes, &linearised_at, true)?;
        let (mut smoothed, _) = smooth(&pass.filtered, &pass.steps);
        self.wander_again(&motion, &pass, &mut smoothed)?;
        let mut order: Vec<usize> = (0..changes.len()).collect();
        order.sort_by_key(|i| changes[*i].0);
        let event = |i: &usize| Event {
            time_d: self.epochs[changes[*i].0].time_d,
            scope: changes[*i].1,
            evidence: evidence[*i],
        };
        let at = order.iter().map(|i| changes[*i].0).collect();
        Some(Found { events: order.iter().map(event).collect(), at, motion, pass, smoothed })
    }

    /// The most probable epoch and scope of each event in turn; those that are no event are dropped.
    fn settle_events(
        &self,
        motion: &Motion,
        linearised_at: &mut Vec<DVector<f64>>,
        windows: &mut Vec<Window>,
        changes: &mut Vec<Change>,
        evidence: &mut Vec<f64>,
    ) -> Option<()> {
        let mut i = 0;
        while i < changes.len() {
            let others: Vec<Change> = (0..changes.len()).filter(|j| *j != i).map(|j| changes[j]).collect();
            let with = |change: Option<Change>| {
                let all: Vec<Change> = others.iter().copied().chain(change).collect();
                // how probable a history is does depend on what the wander does to the features
                let (pass, states) = self.settle(motion, &all, linearised_at, false)?;
                Some((pass.log_likelihood, change, states))
            };
            let best = |candidates: &mut dyn Iterator<Item = Change>| {
                candidates.filter_map(|c| with(Some(c))).max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let whole = Scope { bearings: [true; 2], unbalance: true };
            let when = best(&mut windows[i].epochs.clone().filter(|k| *k > 0).map(|k| (k, whole)))?;
            let epoch = when.1?.0;
            let chosen = best(&mut Scope::ALL.into_iter().map(|scope| (epoch, scope)))?;
            let without = with(None)?;
            let gain = chosen.0 - without.0;
            if gain < EVIDENCE {
                *linearised_at = without.2;
                windows.remove(i);
                changes.remove(i);
                evidence.remove(i);
                continue;
            }
            *linearised_at = chosen.2;
            changes[i] = chosen.1?;
            evidence[i] = gain;
            i += 1;
        }
        Some(())
    }
}
