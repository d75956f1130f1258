//! Events of instruments that a random walk absorbs.

use super::learn::{Learning, Until};
use super::passes::JointProblem;
use super::scan::{Scan, is_enough};
use super::scope::EventAt;
use super::search::{AssumedEvent, EventHistory, PossibleHistory};

/// Least odds of an instrument event, under a random walk that was learned without the event, at which the walk is learned anew.
/// Noise alone often reaches lower odds.
const WORTH_LEARNING: f64 = 0.05;

impl JointProblem {
    /// Adds the likeliest event of an instrument if the record is that much more probable with it, each with the process
    /// model learned for it: a small one is absorbed by a random walk that was learned without it. Whether one was added.
    ///
    /// Linearised at rest and at the walk the evidence differs, and the smaller one counts. After an event in the machine none is
    /// sought: what the kind of that event leaves unexplained would be laid on a probe.
    pub(super) fn find_absorbed(&self, history: &mut EventHistory, learning: &mut Learning) -> Option<bool> {
        history.possible = None;
        let of_machine = |(_, scope): &EventAt| scope.instrument.is_none() && !scope.restart;
        if history.changes().iter().any(of_machine) {
            return Some(false);
        }
        let mut changes = history.changes();
        let at_rest = self.filter(&history.motion, &changes, &history.linearised_at)?;
        let scan = Scan::new(&self.layout, self.bearings, &at_rest.later(), &(1..self.epochs.len()));
        let scan = scan.only(|scope| scope.instrument.is_some());
        let (epoch, gain) = scan.best()?;
        let scope = scan.best_scope(epoch, |_| true)?;
        let is_taken = history.events.iter().any(|e| e.change.0 == epoch);
        if is_taken || scan.evidence(gain, self.epochs.len()) < WORTH_LEARNING.ln() {
            return Some(false);
        }
        let without = self.likelihoods(&history.motion, &changes, &history.linearised_at)?;
        changes.push((epoch, scope));
        let mut motion = history.motion.clone();
        let mut at = self.begin_with(scope, epoch, &history.linearised_at);
        learning.run(self, &mut motion, &mut at, &changes, Until::Rough)?;
        let with = self.likelihoods(&motion, &changes, &at)?;
        let gained = (with[0] - without[0]).min(with[1] - without[1]);
        let evidence = scan.evidence(gained, self.epochs.len());
        if !is_enough(evidence) {
            let interval = scan.epochs()?;
            let change = (epoch, scope);
            // a small turn of the keyphasor is a turn of every plane, which the walk of the unbalance allows for already
            history.possible = scope.is_gain().then_some(PossibleHistory {
                change,
                evidence,
                interval,
                motion,
                linearised_at: at,
            });
            return Some(false);
        }
        history.events.push(AssumedEvent::new(epoch, scope));
        (history.motion, history.linearised_at) = (motion, at);
        Some(true)
    }
}
