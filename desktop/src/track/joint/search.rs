//! Search for the events, their scopes and the process model of highest likelihood.

use std::ops::Range;

use nalgebra::{Complex, DVector};
use rayon::prelude::*;

use super::answer::Event;
use super::kalman::Gaussian;
use super::learn::{Learning, Until};
use super::motion::ProcessModel;
use super::passes::{ConvergedPass, JointProblem, Pass};
use super::scan::{Scan, days, is_enough};
use super::scope::{EventAt, Scope};
use crate::track::daily::Tracking;
use crate::track::record::Day;
use crate::track::step::Steps;

type C = Complex<f64>;

/// Most events in a record.
const MOST_EVENTS: usize = 6;
/// Outliers in a row that indicate an event.
const IN_A_ROW: usize = 3;
/// Scopes less probable than this relative to the best are ignored.
const NEGLIGIBLE: f64 = 1e-3;
/// Most selections of all events in turn.
const SELECTIONS: usize = 3;
/// Most relocations of an event.
const MOVES: usize = 5;
/// All bearings and the unbalance may have changed: covers any event whose scope is not yet known.
const WHOLE: Scope = Scope { bearings: [true; 2], unbalance: true, elsewhere: false };

pub struct SmoothedHistory {
    pub motion: ProcessModel,
    pub pass: Pass,
    pub smoothed: Vec<Gaussian>,
    /// Smoothed states under other scopes of an event, each with its probability relative to this one.
    pub rivals: Vec<(f64, Vec<Gaussian>)>,
    pub events: Vec<Event>,
    /// Epoch of each event.
    pub at: Vec<usize>,
    /// Whether expectation and maximisation converged.
    pub settled: bool,
}

/// A step of the features: the epochs in which an event may have taken place, and the likeliest.
#[derive(Debug, Clone)]
pub struct StepWindow {
    pub epochs: Range<usize>,
    pub likely: usize,
}

/// Present hypothesis of the search.
pub struct EventHistory {
    motion: ProcessModel,
    pub linearised_at: Vec<DVector<f64>>,
    events: Vec<AssumedEvent>,
    /// Epochs that were already searched.
    tried: Vec<Range<usize>>,
}

/// An event of the hypothesis.
struct AssumedEvent {
    change: EventAt,
    held: bool,
    evidence: f64,
    interval: (usize, usize),
    /// Other explanations, with the logarithm of their probability relative to the selected one.
    rivals: Vec<(Rival, f64)>,
}

/// Another explanation of an event.
#[derive(Debug, Clone, Copy)]
enum Rival {
    Scope(Scope),
    /// It changed something outside the model, so later readings say nothing of the unbalance, which may have drifted on.
    Unexplained,
}

impl AssumedEvent {
    fn new(epoch: usize) -> Self {
        let change = (epoch, WHOLE);
        Self { change, held: false, evidence: 0.0, interval: (epoch, epoch), rivals: Vec::new() }
    }

    /// Possible scopes; an event with a later run-up is described by the model itself.
    fn scopes(&self) -> Vec<Scope> {
        Scope::ALL.into_iter().filter(|scope| !(self.held && scope.elsewhere)).collect()
    }

    /// Possible epochs, of `count`: between the neighbouring events.
    fn epochs(&self, others: &[EventAt], count: usize) -> Range<usize> {
        let own = self.change.0;
        if self.held {
            return own..own + 1;
        }
        let before = others.iter().map(|o| o.0).filter(|o| *o < own).max().unwrap_or(0);
        let after = others.iter().map(|o| o.0).filter(|o| *o > own).min().unwrap_or(count);
        before + 1..after
    }
}

impl EventHistory {
    /// Initial hypothesis: an event of unknown scope in each window.
    pub fn new(motion: ProcessModel, windows: Vec<StepWindow>, linearised_at: Vec<DVector<f64>>) -> Self {
        Self {
            motion,
            linearised_at,
            events: windows.iter().map(|w| AssumedEvent::new(w.likely)).collect(),
            tried: windows.into_iter().map(|w| w.epochs).collect(),
        }
    }

    /// Fixes the last event that may precede a time, at an epoch before that time; returns the epoch.
    pub fn hold(&mut self, is_before: impl Fn(usize) -> bool) -> Option<usize> {
        let event = self.events.iter_mut().filter(|e| is_before(e.interval.0)).max_by_key(|e| e.change.0)?;
        (event.held, event.change.1) = (true, WHOLE);
        event.change.0 = (event.interval.0..=event.change.0).rev().find(|k| is_before(*k))?;
        Some(event.change.0)
    }

    fn changes(&self) -> Vec<EventAt> {
        self.events.iter().map(|e| e.change).collect()
    }

    fn changes_without(&self, i: usize) -> Vec<EventAt> {
        self.events.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, e)| e.change).collect()
    }
}

impl Tracking<'_> {
    pub(super) fn steps(&self, epochs: impl Iterator<Item = usize>) -> Vec<StepWindow> {
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
        windows.into_iter().map(|(epochs, _, likely)| StepWindow { epochs, likely }).collect()
    }
}

impl JointProblem {
    /// Alternates event search and rough learning of the process model, until no event is missed.
    pub fn find_events(&self, history: &mut EventHistory, learning: &mut Learning) -> Option<()> {
        self.learn_from(history, learning, Until::Rough)?;
        let most = history.events.len() + MOST_EVENTS;
        loop {
            self.settle_selection(history)?;
            self.learn_from(history, learning, Until::Rough)?;
            let missed = self.missed(history)?;
            let Some((missed, epochs)) = missed.filter(|_| history.events.len() < most) else {
                return Some(());
            };
            history.tried.push(epochs);
            history.events.push(AssumedEvent::new(missed));
            // the random walk was learned too large, as it had to absorb the event
            self.learn_from(history, learning, Until::Rough)?;
        }
    }

    /// The most probable history with the converged process model.
    pub fn conclude(&self, mut history: EventHistory, learning: &mut Learning) -> Option<SmoothedHistory> {
        self.learn_from(&mut history, learning, Until::Settled)?;
        let changes = history.changes();
        let (pass, _) = self.converge(&history.motion, &changes, &history.linearised_at, true)?;
        let mut smoothed = pass.smoothed(&pass.later());
        self.smooth_walk_again(&history.motion, &pass, &mut smoothed)?;
        let rivals = self.rivals(&history, &pass.impossible)?;
        history.events.sort_by_key(|e| e.change.0);
        let time_d = |k: usize| self.epochs[k].time_d;
        let event = |e: &AssumedEvent| Event {
            time_d: time_d(e.change.0),
            interval_d: days(time_d, e.interval),
            scope: e.change.1,
            evidence: e.evidence,
        };
        Some(SmoothedHistory {
            events: history.events.iter().map(event).collect(),
            at: history.events.iter().map(|e| e.change.0).collect(),
            settled: !learning.gave_up,
            motion: history.motion,
            pass,
            smoothed,
            rivals,
        })
    }

    /// Smoothed states under each other explanation of an event, with its relative probability.
    fn rivals(&self, history: &EventHistory, impossible: &[bool]) -> Option<Vec<(f64, Vec<Gaussian>)>> {
        let of = |i: usize| history.events[i].rivals.iter().map(move |(rival, log)| (i, *rival, log.exp()));
        let all: Vec<(usize, Rival, f64)> = (0..history.events.len()).flat_map(of).collect();
        let one = |(i, rival, weight): (usize, Rival, f64)| {
            let mut changes = history.changes();
            let epoch = changes[i].0;
            let pass = match rival {
                Rival::Scope(scope) => {
                    changes[i].1 = scope;
                    let from = self.begin_with(scope, epoch, &history.linearised_at);
                    self.converge(&history.motion, &changes, &from, true)?.0
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

    /// Selects events until each is selected beside all the others: one that was selected beside an event now moved or
    /// dropped may have stood for that.
    fn settle_selection(&self, history: &mut EventHistory) -> Option<()> {
        for _ in 0..SELECTIONS {
            let before = history.changes();
            self.select_events(history)?;
            if history.events.len() < 2 || history.changes() == before {
                break;
            }
        }
        Some(())
    }

    /// Selects epoch and scope of each event in turn; drops events with too little evidence.
    fn select_events(&self, history: &mut EventHistory) -> Option<()> {
        let mut i = 0;
        while i < history.events.len() {
            let others = history.changes_without(i);
            let mut with =
                self.converge(&history.motion, &history.changes(), &history.linearised_at, false)?;
            let epochs = history.events[i].epochs(&others, self.epochs.len());
            let mut scan = self.scan(&history.motion, &others, &with, &epochs)?;
            for _ in 0..MOVES {
                let (epoch, _) = scan.best()?;
                if history.events[i].change.0 == epoch {
                    break;
                }
                history.events[i].change.0 = epoch;
                with = self.converge(&history.motion, &history.changes(), &with.1, false)?;
                scan = self.scan(&history.motion, &others, &with, &epochs)?;
            }
            // scopes lie too far apart for one linearisation to compare them
            let epoch = history.events[i].change.0;
            let explained = |scope: Scope| {
                let changes: Vec<EventAt> = others.iter().copied().chain([(epoch, scope)]).collect();
                let from = self.begin_with(scope, epoch, &with.1);
                Some((scope, self.converge(&history.motion, &changes, &from, false)?))
            };
            let scopes = history.events[i].scopes().into_par_iter();
            let all: Vec<(Scope, ConvergedPass)> = scopes.map(explained).collect::<Option<_>>()?;
            let likelihoods: Vec<(Scope, f64)> = all.iter().map(|(s, w)| (*s, w.0.log_likelihood)).collect();
            let (scope, with) =
                all.into_iter().max_by(|a, b| a.1.0.log_likelihood.total_cmp(&b.1.0.log_likelihood))?;
            let without = self.without_event(history, &others, &with.1)?;
            let reached = with.0.log_likelihood;
            let evidence = scan.evidence(reached - without.0.log_likelihood, self.epochs.len());
            if !is_enough(evidence) {
                history.linearised_at = without.1;
                history.events.remove(i);
                continue;
            }
            history.linearised_at = with.1;
            // with as many free parameters as one speed has features, any event fits: its unbalance is then no more credible
            // than one that drifts on unseen
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

    /// The record without an event, of two starts: as it is now, and as the event leaves it. A worse optimum would count
    /// for the event.
    fn without_event(
        &self,
        history: &EventHistory,
        others: &[EventAt],
        with: &[DVector<f64>],
    ) -> Option<ConvergedPass> {
        let starts = [&history.linearised_at[..], with].into_par_iter();
        let all: Vec<ConvergedPass> =
            starts.map(|from| self.converge(&history.motion, others, from, false)).collect::<Option<_>>()?;
        all.into_iter().max_by(|a, b| a.0.log_likelihood.total_cmp(&b.0.log_likelihood))
    }

    /// First linearisation points for an event of this scope at an epoch. An event elsewhere starts from the bearings and
    /// unbalance before it; those of other scopes are too far off.
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

    /// Scan for an event beside these, with the outliers and the linearisation of a history that has such an event.
    fn scan(
        &self,
        motion: &ProcessModel,
        changes: &[EventAt],
        (with, linearised_at): &ConvergedPass,
        epochs: &Range<usize>,
    ) -> Option<Scan> {
        let pass = self.filter_of(&self.layout, motion, changes, linearised_at, Some(&with.impossible))?;
        Some(Scan::new(&self.layout, &pass.later(), epochs))
    }

    /// Epoch and window of a missing event: outliers in a row, or a shock with enough evidence.
    fn missed(&self, history: &EventHistory) -> Option<Option<(usize, Range<usize>)>> {
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

    fn learn_from(&self, history: &mut EventHistory, learning: &mut Learning, until: Until) -> Option<()> {
        let changes = history.changes();
        learning.run(self, &mut history.motion, &mut history.linearised_at, &changes, until)
    }
}
