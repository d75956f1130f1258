//! Bearings and unbalance that follow conditions of operation.
//!
//! A covariate's coefficients are constants of the state: on a day `c` of the covariate a bearing's logarithm is `m + β c + w`,
//! and the random walk explains the rest. The prior of `β` is that of [`Covariate::effect_sd`]. Each pair of a covariate and a
//! part of the machine is one trial: one that is taken pays for all of them, as an event does. The process model is learned anew
//! for it, as a random walk that was learned without it has absorbed the covariate.

use nalgebra::DVector;

use super::conclude::RivalHistory;
use super::kalman::{BackwardPass, FilterStep, Gaussian, backward};
use super::learn::{Learning, Until};
use super::motion::ProcessModel;
use super::passes::{JointProblem, Pass};
use super::regressor::{OtherPart, Regressor};
use super::scan::is_enough;
use super::scope::EventAt;
use super::search::{EventHistory, NEGLIGIBLE};
use super::state::{Layout, MarginalState};

/// Part of the machine that a covariate may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Bearing(usize),
    Bearings,
    Unbalance,
}

/// A covariate and a part, with what was reached with them.
struct Trial {
    regressors: Vec<Regressor>,
    evidence: f64,
    motion: ProcessModel,
    linearised_at: Vec<DVector<f64>>,
}

impl Trial {
    fn covariate(&self) -> usize {
        self.regressors[0].covariate
    }
}

impl Layout {
    /// The components of the state that a part has.
    fn components(&self, part: Part) -> Vec<usize> {
        let bearings = |is_meant: &dyn Fn(usize) -> bool| {
            let meant = self.numbers.iter().enumerate().filter(|(_, n)| is_meant(n.bearing));
            meant.map(|(i, _)| self.bearings() + i).collect()
        };
        match part {
            Part::Bearing(b) => bearings(&|of| of == b),
            Part::Bearings => bearings(&|_| true),
            Part::Unbalance => (0..self.flat()).collect(),
        }
    }

    /// Component of the state that a regressor is.
    pub fn component_of(&self, regressor: usize) -> usize {
        self.regression() + regressor
    }

    /// What the regressors add: the regressor's component, the component that it is added to, and the covariate's value.
    pub fn added<'a>(&'a self, conditions: &'a [f64]) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        let value = |r: &Regressor| conditions.get(r.covariate).copied().unwrap_or_default();
        self.regressors.iter().enumerate().map(move |(i, r)| (self.component_of(i), r.onto, value(r)))
    }

    /// The state of a day under its conditions: what they change is in its bearings and its unbalance.
    pub fn under(&self, mut x: DVector<f64>, conditions: &[f64]) -> DVector<f64> {
        for (from, onto, value) in self.added(conditions) {
            x[onto] += value * x[from];
        }
        x
    }

    /// The same of a state with its covariance.
    pub fn known_under(&self, state: &Gaussian, conditions: &[f64]) -> Gaussian {
        let mut covariance = state.covariance.clone();
        for (from, onto, value) in self.added(conditions) {
            let row = covariance.row(from) * value;
            let mut own = covariance.row_mut(onto);
            own += row;
            let column = covariance.column(from) * value;
            let mut own = covariance.column_mut(onto);
            own += column;
        }
        Gaussian { mean: self.under(state.mean.clone(), conditions), covariance }
    }

    /// A state of this layout as one with so many regressors more, which are zero.
    fn widened(&self, x: &DVector<f64>, more: usize) -> DVector<f64> {
        x.clone().insert_rows(self.component_of(self.regressors.len()), more, 0.0)
    }
}

impl JointProblem {
    /// Adds what the covariates change, the most evident first, as long as the record is that much more probable with it.
    /// Whether any was added.
    pub(super) fn find_regressors(
        &mut self,
        history: &mut EventHistory,
        learning: &mut Learning,
    ) -> Option<bool> {
        let mut is_any = false;
        self.evidence = vec![f64::NEG_INFINITY; self.covariates.len()];
        loop {
            let changes = history.changes();
            let trials: Vec<Vec<Regressor>> =
                (0..self.covariates.len()).flat_map(|covariate| self.trials(covariate)).collect();
            let count = trials.len();
            if count == 0 {
                return Some(is_any);
            }
            let without = self.likelihoods(&history.motion, &changes, &history.linearised_at)?;
            let mut all: Vec<Trial> = Vec::new();
            for regressors in trials {
                let mut trial = self.learned_with(regressors, history, &changes, learning)?;
                let with = self.with(&trial.regressors, |problem| {
                    problem.likelihoods(&trial.motion, &changes, &trial.linearised_at)
                })?;
                // linearised at rest and at the walk the evidence differs, and the smaller one counts
                let gained = (with[0] - without[0]).min(with[1] - without[1]);
                trial.evidence = gained - (count as f64).ln();
                all.push(trial);
            }
            all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
            for covariate in 0..self.covariates.len() {
                let is_used = self.layout.regressors.iter().any(|r| r.covariate == covariate);
                let of_it = all.iter().find(|trial| trial.covariate() == covariate);
                if let Some(trial) = of_it.filter(|_| !is_used) {
                    self.evidence[covariate] = trial.evidence;
                }
            }
            let mut all = all.into_iter();
            let Some(best) = all.next().filter(|best| is_enough(best.evidence)) else { return Some(is_any) };
            let next = all.find(|trial| trial.covariate() == best.covariate());
            is_any = true;
            history.other_part = next.and_then(|next| self.other_part(next, best.evidence));
            let more = best.regressors.len();
            for point in self.restarts.iter_mut().flat_map(|r| &mut r.points) {
                *point = self.layout.widened(point, more);
            }
            self.layout.regressors.extend(best.regressors);
            (history.motion, history.linearised_at) = (best.motion, best.linearised_at);
        }
    }

    /// A trial as another explanation, unless it is too improbable beside one of this evidence.
    fn other_part(&self, next: Trial, evidence: f64) -> Option<OtherPart> {
        let log_odds = next.evidence - evidence;
        let is_unbalance = next.regressors.iter().any(|r| r.onto < self.layout.flat());
        (log_odds > NEGLIGIBLE.ln()).then(|| OtherPart {
            covariate: next.covariate(),
            log_odds,
            is_unbalance,
            regressors: [self.layout.regressors.clone(), next.regressors].concat(),
            motion: next.motion,
            linearised_at: next.linearised_at,
        })
    }

    /// Smoothed states of a history whose covariates act on another part, under the conditions of their days.
    pub(super) fn with_other_part(&mut self, changes: &[EventAt], other: &OtherPart) -> Option<RivalHistory> {
        let own = std::mem::replace(&mut self.layout.regressors, other.regressors.clone());
        let found = self.converge(&other.motion, changes, &other.linearised_at, true);
        let weight = other.log_odds.exp();
        let found = found.and_then(|(pass, _)| {
            let states = self.marginals(&pass);
            Some(RivalHistory { weight, states, end: self.branch(weight, &other.motion, &pass, true)? })
        });
        self.layout.regressors = own;
        found
    }

    /// Mean and variance of bearings and unbalance in a smoothed state, under the conditions of its day.
    pub(super) fn marginal(&self, epoch: usize, state: &Gaussian) -> MarginalState {
        let conditions = self.epochs[epoch].own.as_ref().map_or(&[][..], |day| &day.conditions);
        self.layout.marginal(&self.layout.known_under(state, conditions))
    }

    /// The same of all states of a run of the filter.
    pub(super) fn marginals(&self, pass: &Pass) -> Vec<MarginalState> {
        let of = |k: usize, visit: &FilterStep, later: &BackwardPass| {
            self.marginal(k, &visit.predicted.smoothed(later))
        };
        backward(&pass.visits, &pass.steps, of)
    }

    /// The parts that a covariate may change and does not yet, as regressors.
    fn trials(&self, covariate: usize) -> Vec<Vec<Regressor>> {
        let layout = &self.layout;
        let bearings = (0..self.bearings).map(Part::Bearing);
        let parts = bearings.chain([Part::Bearings, Part::Unbalance]);
        let sd = self.covariates[covariate].effect_sd;
        let of = |part: Part| {
            let new =
                |onto: &usize| !layout.regressors.iter().any(|r| (r.covariate, r.onto) == (covariate, *onto));
            let components: Vec<usize> = layout.components(part).into_iter().filter(new).collect();
            components.into_iter().map(|onto| Regressor { covariate, onto, sd }).collect::<Vec<_>>()
        };
        let mut trials: Vec<Vec<Regressor>> = Vec::new();
        for trial in parts.map(of).filter(|regressors| !regressors.is_empty()) {
            // of all bearings only one may be left
            if !trials.contains(&trial) {
                trials.push(trial);
            }
        }
        trials
    }

    /// A trial with the process model learned for it.
    fn learned_with(
        &mut self,
        regressors: Vec<Regressor>,
        history: &EventHistory,
        changes: &[EventAt],
        learning: &mut Learning,
    ) -> Option<Trial> {
        let (mut motion, mut linearised_at) =
            (history.motion.clone(), self.widened(history, regressors.len()));
        self.with(&regressors, |problem| {
            learning.run(problem, &mut motion, &mut linearised_at, changes, Until::Rough)
        })?;
        Some(Trial { regressors, evidence: f64::NEG_INFINITY, motion, linearised_at })
    }

    fn widened(&self, history: &EventHistory, more: usize) -> Vec<DVector<f64>> {
        history.linearised_at.iter().map(|x| self.layout.widened(x, more)).collect()
    }

    /// The same problem with regressors more.
    fn with<T>(&mut self, regressors: &[Regressor], of: impl FnOnce(&Self) -> T) -> T {
        let count = self.layout.regressors.len();
        self.layout.regressors.extend_from_slice(regressors);
        let found = of(self);
        self.layout.regressors.truncate(count);
        found
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex, DMatrix};

    use super::*;
    use crate::machine::drawing::Noise;
    use crate::measurement::Reading;
    use crate::testing::sample_rotor;
    use crate::track::coefficients::{followed, logs_of};
    use crate::track::joint::coordinate::Coordinate;
    use crate::track::record::{Day, days};

    type C = Complex<f64>;

    /// A stiffness, a damping and an angle that follow the first of two covariates, and a stiffness that follows the second.
    fn layout() -> Layout {
        let planes = [C::new(3e-4, -1e-4), C::new(-2e-4, 4e-4)];
        let bearings = 8;
        let regressor = |covariate, onto| Regressor { covariate, onto, sd: 0.3 };
        Layout {
            planes: planes.iter().map(|u| Coordinate::new(*u, &[*u], u.norm())).collect(),
            positions_m: vec![0.12, 0.92],
            numbers: followed(&sample_rotor()).into(),
            regressors: [(0, bearings), (0, bearings + 5), (0, 1), (1, bearings + 2)]
                .map(|(covariate, onto)| regressor(covariate, onto))
                .to_vec(),
            probes: 4,
            has_factors: true,
        }
    }

    fn day() -> Day {
        let noise = Noise { relative: 0.02, floor_um: 0.03, ..Noise::default() };
        let probes = vec![Some(C::new(1e-5, 0.0)); 4];
        let reading = Reading { speed_rpm: 9000.0, probes, ..Reading::default() };
        let day = days(&sample_rotor(), &noise, &[reading]).unwrap().remove(0);
        Day { conditions: vec![0.7, -1.3], ..day }
    }

    fn state(layout: &Layout) -> DVector<f64> {
        let coordinates = [C::new(0.05, 0.1), C::new(-0.1, 0.2)];
        let mut x = layout.at(&logs_of(&sample_rotor()), &coordinates);
        (0..4).for_each(|i| x[layout.component_of(i)] = 0.05 * (i as f64 + 1.0));
        x
    }

    #[test]
    fn covariance_under_conditions_is_that_of_a_linear_map() {
        let layout = layout();
        let size = layout.size();
        let mixed = DMatrix::from_fn(size, size, |i, j| ((5 * i + 3 * j) % 11) as f64 - 5.0);
        let known = Gaussian { mean: state(&layout), covariance: &mixed * mixed.transpose() };
        let mut map = DMatrix::identity(size, size);
        for (from, onto, value) in layout.added(&[0.7, -1.3]) {
            map[(onto, from)] = value;
        }
        let under = layout.known_under(&known, &[0.7, -1.3]);
        assert!((under.mean - &map * &known.mean).amax() < 1e-12);
        assert!((under.covariance - &map * &known.covariance * map.transpose()).amax() < 1e-9);
    }

    #[test]
    fn slopes_by_covariate_coefficients_equal_differences() {
        let (layout, day) = (layout(), day());
        let at = state(&layout);
        let linear = layout.linear(&day, &at, &Noise::default()).unwrap();
        for i in 0..4 {
            let component = layout.component_of(i);
            let beside = |step: f64| {
                let mut x = at.clone();
                x[component] += step;
                layout.shown(&day, &x).unwrap()
            };
            let (up, down) = (beside(1e-5), beside(-1e-5));
            for p in 0..4 {
                let difference = (up[p] - down[p]) / 2e-5 * 1e6;
                let slope = C::new(linear.slope[(2 * p, component)], linear.slope[(2 * p + 1, component)]);
                assert!((difference - slope).norm() < 1e-5 * slope.norm().max(1e-3), "{i} {p}");
            }
        }
    }
}
