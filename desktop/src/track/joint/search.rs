//! Search for the events, their scopes and the process model of highest likelihood.

use std::ops::Range;

use nalgebra::{Complex, DVector};
use rayon::prelude::*;

use super::learn::{Learning, Until};
use super::motion::ProcessModel;
use super::passes::{ConvergedPass, JointProblem};
use super::regressor::OtherPart;
use super::scan::{Scan, is_enough};
use super::scope::{EventAt, Instrument, Scope};
use crate::track::daily::Tracking;
use crate::track::record::Day;
use crate::track::step::Steps;

type C = Complex<f64>;

/// Most events in a record.
const MOST_EVENTS: usize = 6;
/// Outliers in a row that indicate an event.
const IN_A_ROW: usize = 3;
/// Scopes, and parts that may follow a covariate, less probable than this relative to the best are ignored.
pub(super) const NEGLIGIBLE: f64 = 1e-3;
/// Most selections of all events in turn.
const SELECTIONS: usize = 3;
/// Most relocations of an event.
const MOVES: usize = 5;

/// A step of the features: the epochs in which an event may have taken place, and the likeliest.
#[derive(Debug, Clone)]
pub struct StepWindow {
    pub epochs: Range<usize>,
    pub likely: usize,
}

/// Present hypothesis of the search.
pub struct EventHistory {
    pub(super) motion: ProcessModel,
    pub linearised_at: Vec<DVector<f64>>,
    pub(super) events: Vec<AssumedEvent>,
    /// Epochs that were already searched.
    tried: Vec<Range<usize>>,
    /// The same with one event more, which has too little evidence to be claimed.
    pub(super) possible: Option<PossibleHistory>,
    /// Another part of the machine that may follow a covariate instead.
    pub other_part: Option<OtherPart>,
}

/// A hypothesis with one event more, which has too little evidence to be claimed.
pub struct PossibleHistory {
    pub change: EventAt,
    pub evidence: f64,
    pub interval: (usize, usize),
    pub motion: ProcessModel,
    pub linearised_at: Vec<DVector<f64>>,
}

/// An event of the hypothesis.
pub(super) struct AssumedEvent {
    pub(super) change: EventAt,
    /// A later run-up shows it, so that its epoch is known.
    pub(super) held: bool,
    /// An outage that is stated: its epoch and its scope are known.
    pub(super) stated: bool,
    /// More probable than not, with too little evidence to be claimed.
    pub(super) unclaimed: bool,
    pub(super) evidence: f64,
    pub(super) interval: (usize, usize),
    /// Other explanations, with the logarithm of their probability relative to the selected one.
    pub(super) rivals: Vec<(Rival, f64)>,
}

/// Another explanation of an event.
#[derive(Debug, Clone, Copy)]
pub(super) enum Rival {
    Scope(Scope),
    /// There was none.
    Absent,
    /// It changed something outside the model, so later readings say nothing of the unbalance, which may have drifted on.
    Unexplained,
}

impl AssumedEvent {
    pub(super) fn new(epoch: usize, scope: Scope) -> Self {
        Self {
            change: (epoch, scope),
            held: false,
            stated: false,
            unclaimed: false,
            evidence: 0.0,
            interval: (epoch, epoch),
            rivals: Vec::new(),
        }
    }

    /// Possible scopes, of the instruments' only those that are promising by this scan, and of the probes' gains the likeliest; an
    /// event with a later run-up is described by the model itself.
    fn scopes(&self, problem: &JointProblem, scan: &Scan) -> Vec<Scope> {
        let epoch = self.change.0;
        let likeliest = scan.best_scope(epoch, Scope::is_gain);
        let is_likeliest = |scope: &Scope| !scope.is_gain() || Some(*scope) == likeliest;
        let is_tried = |s: &Scope| s.instrument.is_none() || is_likeliest(s) && scan.is_promising(epoch, *s);
        let all = Scope::all(problem.bearings, problem.layout.probes).into_iter().filter(is_tried);
        let new = Scope::restart(problem.bearings);
        let restart = problem.restart_at(epoch, new).map(|_| new);
        all.filter(|scope| !(self.held && scope.has_factors())).chain(restart).collect()
    }

    /// Possible epochs, of `count`: between the neighbouring events.
    fn epochs(&self, others: &[EventAt], count: usize) -> Range<usize> {
        let own = self.change.0;
        if self.held || self.stated {
            return own..own + 1;
        }
        let before = others.iter().map(|o| o.0).filter(|o| *o < own).max().unwrap_or(0);
        let after = others.iter().map(|o| o.0).filter(|o| *o > own).min().unwrap_or(count);
        before + 1..after
    }
}

impl EventHistory {
    /// Initial hypothesis: an event of unknown scope in each window, but a restart in those and at those epochs where it is
    /// `stated` to be.
    pub fn new(
        problem: &JointProblem,
        windows: Vec<StepWindow>,
        stated: &[usize],
        linearised_at: Vec<DVector<f64>>,
    ) -> Self {
        let restart =
            |w: &StepWindow| problem.restarts.iter().map(|r| r.epoch).find(|epoch| w.epochs.contains(epoch));
        let unstated = windows.iter().filter(|w| restart(w).is_none_or(|epoch| !stated.contains(&epoch)));
        let found = unstated.map(|w| match restart(w) {
            Some(epoch) => AssumedEvent::new(epoch, Scope::restart(problem.bearings)),
            None => AssumedEvent::new(w.likely, Scope::whole(problem.bearings)),
        });
        let known = stated.iter().map(|epoch| AssumedEvent {
            stated: true,
            ..AssumedEvent::new(*epoch, Scope::restart(problem.bearings))
        });
        let mut events: Vec<AssumedEvent> = known.chain(found).collect();
        // two windows may hold one restart
        events.sort_by_key(|e| (e.change.0, !e.stated));
        events.dedup_by_key(|e| e.change.0);
        Self {
            motion: ProcessModel::first(&problem.layout.numbers, problem.pace_d),
            linearised_at,
            events,
            tried: windows.into_iter().map(|w| w.epochs).collect(),
            possible: None,
            other_part: None,
        }
    }

    /// Fixes the last event that may precede a time, at an epoch before that time; returns the epoch.
    pub fn hold(&mut self, bearings: usize, is_before: impl Fn(usize) -> bool) -> Option<usize> {
        let event = self.events.iter_mut().filter(|e| is_before(e.interval.0)).max_by_key(|e| e.change.0)?;
        event.held = true;
        if !event.change.1.restart {
            event.change.1 = Scope::whole(bearings);
            event.change.0 = (event.interval.0..=event.change.0).rev().find(|k| is_before(*k))?;
        }
        Some(event.change.0)
    }

    pub(super) fn changes(&self) -> Vec<EventAt> {
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
            if history.events.len() >= most {
                return Some(());
            }
            if let Some((missed, epochs)) = self.missed(history)? {
                history.tried.push(epochs);
                history.events.push(AssumedEvent::new(missed, Scope::whole(self.bearings)));
                // the random walk was learned too large, as it had to absorb the event
                self.learn_from(history, learning, Until::Rough)?;
            } else if !self.find_absorbed(history, learning)? {
                return Some(());
            }
        }
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
            if history.events[i].stated {
                i += 1;
                continue;
            }
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
            // scopes lie too far apart for one linearisation to compare them; the passes themselves would be most of the memory
            let with = with.1;
            let epoch = history.events[i].change.0;
            let assumed = history.events[i].change.1;
            let explained = |scope: Scope| {
                let changes: Vec<EventAt> = others.iter().copied().chain([(epoch, scope)]).collect();
                // what begins at a restart already is near its optimum
                let from = match scope.restart && assumed.restart {
                    true => with.clone(),
                    false => self.begin_with(scope, epoch, &with),
                };
                let (pass, points) = self.converge(&history.motion, &changes, &from, false)?;
                Some((scope, pass.log_likelihood, points))
            };
            let scopes = history.events[i].scopes(self, &scan).into_par_iter();
            let all: Vec<(Scope, f64, Vec<DVector<f64>>)> = scopes.map(explained).collect::<Option<_>>()?;
            let likelihoods: Vec<(Scope, f64)> = all.iter().map(|(scope, l, _)| (*scope, *l)).collect();
            let (scope, reached, linearised_at) = all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
            let without = self.without_event(history, &others, &linearised_at)?;
            let evidence = scan.evidence(reached - without.0.log_likelihood, self.epochs.len());
            if !is_enough(evidence) {
                history.linearised_at = without.1;
                history.events.remove(i);
                continue;
            }
            history.linearised_at = linearised_at;
            // with as many free parameters as one speed has features, any event fits: its unbalance is then no more credible
            // than one that drifts on unseen
            let fits_anything = scope.unbalance
                && !scope.restart
                && scope.freedom(&self.layout.numbers, self.layout.planes.len()) >= 2 * self.layout.probes;
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

    /// First linearisation points for an event of this scope at an epoch. An event elsewhere or of an instrument starts
    /// from the bearings and unbalance before it; those of other scopes are too far off.
    pub(super) fn begin_with(
        &self,
        scope: Scope,
        epoch: usize,
        linearised_at: &[DVector<f64>],
    ) -> Vec<DVector<f64>> {
        let mut points = linearised_at.to_vec();
        if let Some(restart) = self.restart_at(epoch, scope) {
            points.iter_mut().skip(epoch).zip(&restart.points).for_each(|(old, new)| old.clone_from(new));
            return points;
        }
        if !scope.has_factors() {
            return points;
        }
        let before =
            self.layout.with_factor(points[epoch - 1].clone(), &vec![1.0.into(); self.layout.probes]);
        for (point, day) in points.iter_mut().zip(&self.epochs).skip(epoch) {
            let shown = day.own.as_ref().and_then(|d| self.layout.shown(d, &before));
            let factors = day.own.iter().zip(shown).flat_map(|(d, shown)| d.measured_m.iter().zip(shown));
            let factors: Vec<C> = factors.map(|(y, shown)| y.map_or(1.0.into(), |y| y / shown)).collect();
            *point = self.layout.with_factor(before.clone(), &restricted(scope, factors));
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
        Some(Scan::new(&self.layout, self.bearings, &pass.later(), epochs))
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
        let scan = Scan::new(&self.layout, self.bearings, &pass.later(), &(1..self.epochs.len()));
        let likely = scan.best().filter(|best| is_enough(scan.evidence(best.1, self.epochs.len())));
        let Some((epoch, _)) = likely.filter(|best| untried(&best.0)) else { return Some(None) };
        let (from, to) = scan.epochs()?;
        Some(Some((epoch, from.min(epoch)..to.max(epoch) + 1)))
    }

    pub(super) fn learn_from(
        &self,
        history: &mut EventHistory,
        learning: &mut Learning,
        until: Until,
    ) -> Option<()> {
        let changes = history.changes();
        learning.run(self, &mut history.motion, &mut history.linearised_at, &changes, until)
    }
}

/// Factors that an event of this scope allows, nearest to these.
fn restricted(scope: Scope, factors: Vec<C>) -> Vec<C> {
    let count = factors.len() as f64;
    match scope.instrument {
        None => factors,
        Some(Instrument::Gain(only)) => {
            let gain = |(p, f): (usize, &C)| if p == only { C::from(f.norm()) } else { C::from(1.0) };
            factors.iter().enumerate().map(gain).collect()
        }
        Some(Instrument::PhaseReference) => {
            let turn = factors.iter().map(|f| f / f.norm()).sum::<C>() / count;
            vec![C::from_polar(1.0, turn.arg()); factors.len()]
        }
    }
}
