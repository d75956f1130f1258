//! When events took place, what they changed, and how everything moves: what makes the record most
//! probable.

use std::ops::Range;

use nalgebra::{Complex, DVector};
use rayon::prelude::*;

use super::answer::Event;
use super::kalman::Gaussian;
use super::learn::{Learning, Until};
use super::motion::Motion;
use super::passes::{Pass, Problem, Settled};
use super::scan::{Scan, days, is_enough};
use super::scope::{Change, Scope};
use crate::track::daily::Tracking;
use crate::track::record::Day;
use crate::track::step::Steps;

type C = Complex<f64>;

/// More events than this are no events but another machine.
const MOST_EVENTS: usize = 6;
/// Impossible readings in a row that are an event.
const IN_A_ROW: usize = 3;
/// An explanation that is less probable than this beside the best counts for nothing.
const NEGLIGIBLE: f64 = 1e-3;
/// Times that an event is put elsewhere before its place is taken as it is.
const MOVES: usize = 5;
/// Everything that bearings and unbalance can be may have changed: enough to follow any event while its own scope is
/// not known.
const WHOLE: Scope = Scope { bearings: [true; 2], unbalance: true, elsewhere: false };

pub struct Found {
    pub motion: Motion,
    pub pass: Pass,
    pub smoothed: Vec<Gaussian>,
    /// The same under other explanations of an event, each with how probable it is beside this one.
    pub rivals: Vec<(f64, Vec<Gaussian>)>,
    pub events: Vec<Event>,
    /// Epoch of each event.
    pub at: Vec<usize>,
    /// The likelihood had stopped rising when the learning ended.
    pub settled: bool,
}

/// A step of the features: the epochs in which an event may have taken place, and the likeliest.
#[derive(Debug, Clone)]
pub struct Window {
    pub epochs: Range<usize>,
    pub likely: usize,
}

/// What is taken to have happened while the search goes on.
pub struct History {
    motion: Motion,
    pub linearised_at: Vec<DVector<f64>>,
    events: Vec<Taken>,
    /// Epochs in which an event was looked for closely.
    tried: Vec<Range<usize>>,
}

/// An event, and what is known of it.
struct Taken {
    change: Change,
    held: bool,
    evidence: f64,
    interval: (usize, usize),
    /// Other explanations, and the logarithm of how probable each is beside the one taken.
    rivals: Vec<(Rival, f64)>,
}

/// Another explanation of an event.
#[derive(Debug, Clone, Copy)]
enum Rival {
    Scope(Scope),
    /// It changed something that the model lacks, so that no reading since tells of the unbalance: that went on as it
    /// may have.
    Unexplained,
}

impl Taken {
    fn new(epoch: usize) -> Self {
        let change = (epoch, WHOLE);
        Self { change, held: false, evidence: 0.0, interval: (epoch, epoch), rivals: Vec::new() }
    }

    /// What it may be: what a later run-up showed is described by the machine itself.
    fn scopes(&self) -> Vec<Scope> {
        Scope::ALL.into_iter().filter(|scope| !(self.held && scope.elsewhere)).collect()
    }

    /// Where it may be, in a record of so many epochs: between the events beside it.
    fn epochs(&self, others: &[Change], count: usize) -> Range<usize> {
        let own = self.change.0;
        if self.held {
            return own..own + 1;
        }
        let before = others.iter().map(|o| o.0).filter(|o| *o < own).max().unwrap_or(0);
        let after = others.iter().map(|o| o.0).filter(|o| *o > own).min().unwrap_or(count);
        before + 1..after
    }
}

impl History {
    /// Nothing learned but a motion to begin with, and an event of everything in each of these windows.
    pub fn new(motion: Motion, windows: Vec<Window>, linearised_at: Vec<DVector<f64>>) -> Self {
        Self {
            motion,
            linearised_at,
            events: windows.iter().map(|w| Taken::new(w.likely)).collect(),
            tried: windows.into_iter().map(|w| w.epochs).collect(),
        }
    }

    /// The last event that may have been before a time stays where it is from now on, or at the last epoch before that
    /// time; that epoch.
    pub fn hold(&mut self, is_before: impl Fn(usize) -> bool) -> Option<usize> {
        let event = self.events.iter_mut().filter(|e| is_before(e.interval.0)).max_by_key(|e| e.change.0)?;
        (event.held, event.change.1) = (true, WHOLE);
        event.change.0 = (event.interval.0..=event.change.0).rev().find(|k| is_before(*k))?;
        Some(event.change.0)
    }

    fn changes(&self) -> Vec<Change> {
        self.events.iter().map(|e| e.change).collect()
    }

    fn changes_without(&self, i: usize) -> Vec<Change> {
        self.events.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, e)| e.change).collect()
    }
}

impl Tracking<'_> {
    pub(super) fn steps(&self, epochs: impl Iterator<Item = usize>) -> Vec<Window> {
        let all: Vec<(usize, &Day)> = epochs.zip(&self.days).filter(|(_, d)| d.is_complete()).collect();
        let days: Vec<&Day> = all.iter().map(|(_, d)| *d).collect();
        let persistence = self.config.thresholds.persistence.max(1);
        let mut steps = Steps::default();
        let mut windows: Vec<(Range<usize>, f64, usize)> = Vec::new();
        for k in 0..days.len() {
            if steps.stepped(&days[..=k], persistence) == Some(true) {
                let from = (k + 2).saturating_sub(2 * persistence).max(1);
                let excess = |i: &usize| steps.excess(days[i - 1], days[*i]);
                let sharpest = (from..=k).max_by(|a, b| excess(a).total_cmp(&excess(b))).unwrap_or(k);
                let (window, sharp) = (all[from].0..all[k].0 + 1, excess(&sharpest));
                match windows.last_mut() {
                    Some((last, best, likely)) if window.start < last.end => {
                        last.end = window.end;
                        if sharp > *best {
                            (*best, *likely) = (sharp, all[sharpest].0);
                        }
                    }
                    _ => windows.push((window, sharp, all[sharpest].0)),
                }
            }
            steps.learn(days[k]);
        }
        windows.into_iter().map(|(epochs, _, likely)| Window { epochs, likely }).collect()
    }
}

impl Problem {
    /// Looks for events and learns roughly how everything moves, until no more is found.
    pub fn find_events(&self, history: &mut History, learning: &mut Learning) -> Option<()> {
        self.learn_from(history, learning, Until::Rough)?;
        let most = history.events.len() + MOST_EVENTS;
        loop {
            self.settle_events(history)?;
            self.learn_from(history, learning, Until::Rough)?;
            let missed = self.missed(history)?;
            let Some((missed, epochs)) = missed.filter(|_| history.events.len() < most) else {
                return Some(());
            };
            history.tried.push(epochs);
            history.events.push(Taken::new(missed));
            // a wander that had to take the event in was learned too large to tell it
            self.learn_from(history, learning, Until::Rough)?;
        }
    }

    /// The most probable history, learned to the end.
    pub fn conclude(&self, mut history: History, learning: &mut Learning) -> Option<Found> {
        self.learn_from(&mut history, learning, Until::Settled)?;
        let changes = history.changes();
        let (pass, _) = self.settle(&history.motion, &changes, &history.linearised_at, true)?;
        let mut smoothed = pass.smoothed(&pass.later());
        self.wander_again(&history.motion, &pass, &mut smoothed)?;
        let rivals = self.rivals(&history, &pass.impossible)?;
        history.events.sort_by_key(|e| e.change.0);
        let time_d = |k: usize| self.epochs[k].time_d;
        let event = |e: &Taken| Event {
            time_d: time_d(e.change.0),
            interval_d: days(time_d, e.interval),
            scope: e.change.1,
            evidence: e.evidence,
        };
        Some(Found {
            events: history.events.iter().map(event).collect(),
            at: history.events.iter().map(|e| e.change.0).collect(),
            settled: !learning.gave_up,
            motion: history.motion,
            pass,
            smoothed,
            rivals,
        })
    }

    /// The smoothed states under each other explanation of an event, and how probable that is beside the best.
    fn rivals(&self, history: &History, impossible: &[bool]) -> Option<Vec<(f64, Vec<Gaussian>)>> {
        let of = |i: usize| history.events[i].rivals.iter().map(move |(rival, log)| (i, *rival, log.exp()));
        let all: Vec<(usize, Rival, f64)> = (0..history.events.len()).flat_map(of).collect();
        let one = |(i, rival, weight): (usize, Rival, f64)| {
            let mut changes = history.changes();
            let epoch = changes[i].0;
            let pass = match rival {
                Rival::Scope(scope) => {
                    changes[i].1 = scope;
                    let from = self.begin_with(scope, epoch, &history.linearised_at);
                    self.settle(&history.motion, &changes, &from, true)?.0
                }
                Rival::Unexplained => {
                    changes.retain(|(at, _)| *at < epoch);
                    let unread: Vec<bool> =
                        (0..).zip(impossible).map(|(k, out)| k >= epoch || *out).collect();
                    let at = &history.linearised_at;
                    self.filter_of(&self.layout, &history.motion, &changes, at, Some(&unread))?
                }
            };
            Some((weight, pass.smoothed(&pass.later())))
        };
        all.into_par_iter().map(one).collect()
    }

    /// The most probable epoch and scope of each event in turn; those that are no event are dropped.
    fn settle_events(&self, history: &mut History) -> Option<()> {
        let mut i = 0;
        while i < history.events.len() {
            let others = history.changes_without(i);
            let mut with = self.settle(&history.motion, &history.changes(), &history.linearised_at, false)?;
            let epochs = history.events[i].epochs(&others, self.epochs.len());
            let mut scan = self.scan(&history.motion, &others, &with, &epochs)?;
            for _ in 0..MOVES {
                let (epoch, _) = scan.best()?;
                if history.events[i].change.0 == epoch {
                    break;
                }
                history.events[i].change.0 = epoch;
                with = self.settle(&history.motion, &history.changes(), &with.1, false)?;
                scan = self.scan(&history.motion, &others, &with, &epochs)?;
            }
            // explanations lie too far apart for readings that are linearised around one of them to judge the others
            let epoch = history.events[i].change.0;
            let explained = |scope: Scope| {
                let changes: Vec<Change> = others.iter().copied().chain([(epoch, scope)]).collect();
                let from = self.begin_with(scope, epoch, &with.1);
                Some((scope, self.settle(&history.motion, &changes, &from, false)?))
            };
            let scopes = history.events[i].scopes().into_par_iter();
            let all: Vec<(Scope, Settled)> = scopes.map(explained).collect::<Option<_>>()?;
            let likelihoods: Vec<(Scope, f64)> = all.iter().map(|(s, w)| (*s, w.0.log_likelihood)).collect();
            let (scope, with) =
                all.into_iter().max_by(|a, b| a.1.0.log_likelihood.total_cmp(&b.1.0.log_likelihood))?;
            let without = self.settle(&history.motion, &others, &history.linearised_at, false)?;
            let reached = with.0.log_likelihood;
            let evidence = scan.evidence(reached - without.0.log_likelihood, self.epochs.len());
            if !is_enough(evidence) {
                history.linearised_at = without.1;
                history.events.remove(i);
                continue;
            }
            history.linearised_at = with.1;
            // what is free in as many numbers as one speed shows could not have failed: that it fits speaks no more for
            // its unbalance than for one of which nothing has been seen since
            let fits_anything =
                scope.unbalance && scope.freedom(self.layout.planes.len()) >= 2 * self.layout.probes;
            let event = &mut history.events[i];
            event.change.1 = scope;
            event.evidence = evidence;
            event.interval = scan.epochs()?;
            let others = likelihoods.into_iter().filter(|(s, _)| *s != scope);
            let likely = others.filter(|(_, l)| l - reached > NEGLIGIBLE.ln());
            event.rivals = likely.map(|(s, l)| (Rival::Scope(s), l - reached)).collect();
            if fits_anything && !event.held {
                event.rivals.push((Rival::Unexplained, 0.0));
            }
            i += 1;
        }
        Some(())
    }

    /// States to linearise around at first where an event of this scope is at an epoch. One elsewhere leaves bearings and
    /// unbalance as they were: what another explanation made of them is too far off to begin from.
    fn begin_with(&self, scope: Scope, epoch: usize, linearised_at: &[DVector<f64>]) -> Vec<DVector<f64>> {
        let mut points = linearised_at.to_vec();
        if !scope.elsewhere {
            return points;
        }
        let before =
            self.layout.with_factor(points[epoch - 1].clone(), &vec![1.0.into(); self.layout.probes]);
        for (point, day) in points.iter_mut().zip(&self.epochs).skip(epoch) {
            let shown = day.own.as_ref().and_then(|d| self.layout.shown(d, &before));
            let factors = day.own.iter().zip(shown).flat_map(|(d, shown)| d.measured_m.iter().zip(shown));
            let factors: Vec<C> = factors.map(|(y, shown)| y.map_or(1.0.into(), |y| y / shown)).collect();
            *point = self.layout.with_factor(before.clone(), &factors);
        }
        points
    }

    /// What an event beside these would explain, of the readings that a history with such an event takes, linearised
    /// as there.
    fn scan(
        &self,
        motion: &Motion,
        changes: &[Change],
        (with, linearised_at): &Settled,
        epochs: &Range<usize>,
    ) -> Option<Scan> {
        let pass = self.filter_of(&self.layout, motion, changes, linearised_at, Some(&with.impossible))?;
        Some(Scan::new(&self.layout, &pass.later(), epochs))
    }

    /// An epoch of an event that is not among these, and where it may be: impossible readings in a row, or a shock
    /// that would explain much.
    fn missed(&self, history: &History) -> Option<Option<(usize, Range<usize>)>> {
        let changes = history.changes();
        let pass = self.filter(&history.motion, &changes, &history.linearised_at)?;
        let impossible = &pass.impossible;
        let untried = |k: &usize| !history.tried.iter().any(|t| t.contains(k));
        let in_a_row = |k: &usize| impossible[*k..].iter().take_while(|i| **i).count() >= IN_A_ROW;
        if let Some(k) = (1..impossible.len()).filter(untried).find(in_a_row) {
            let end = (k..impossible.len()).find(|k| !impossible[*k]).unwrap_or(impossible.len());
            return Some(Some((k, k..end)));
        }
        let scan = Scan::new(&self.layout, &pass.later(), &(1..self.epochs.len()));
        let likely = scan.best().filter(|best| is_enough(scan.evidence(best.1, self.epochs.len())));
        let Some((epoch, _)) = likely.filter(|best| untried(&best.0)) else { return Some(None) };
        let (from, to) = scan.epochs()?;
        Some(Some((epoch, from.min(epoch)..to.max(epoch) + 1)))
    }

    fn learn_from(&self, history: &mut History, learning: &mut Learning, until: Until) -> Option<()> {
        let changes = history.changes();
        learning.run(self, &mut history.motion, &mut history.linearised_at, &changes, until)
    }
}
