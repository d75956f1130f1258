//! Influence of the planes learned from runs with stated weights.
//!
//! At every row `Y = Y₀ + H (U + δ) + ε`, plus the [`shift`](super::shift) of a session: U the stated weights, δ how far they are
//! off in proportion to their size, ε what differs between mountings. Y₀ and H are Gaussian, their prior that of the model; sizes of
//! δ and ε, and of the model's discrepancy, are those that make the runs most probable (expectation and maximisation: Dempster, Laird
//! and Rubin 1977).

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::mounting::{Mounting, Mountings};
use super::prior::LinearInfluence;
use super::scatter::{GUESS_WEIGHT, ScatterStructure, circular, real};
use super::sessions::Sessions;
use super::shift::{SessionEffect, SessionRuns, SessionScatter, shift_design};
use crate::balance::influence::regression::{InfluencePosterior, Regression, design, factor};
use crate::error::Error;

type C = Complex<f64>;

/// Prior standard deviation of a weight, relative: mass, radius and angle of a screw.
const PLACEMENT: f64 = 0.02;
/// Weight of that guess, in weights.
const PLACEMENT_WEIGHT: f64 = 2.0;
/// Weight of the guessed size of the discrepancy, in real numbers.
const DISCREPANCY_WEIGHT: f64 = 8.0;
/// The response of the base run may be this many times the largest level: as good as unknown.
const BASE_SD: f64 = 100.0;

/// One mounting as real numbers: real parts of its rows, then imaginary parts.
#[derive(Debug, Clone)]
pub struct MountingComponents {
    /// Numbers of the components that were measured.
    pub at: Vec<usize>,
    /// Measured components in the order of `at`, µm.
    pub y: DVector<f64>,
    /// Variance of the mean of the repeats.
    repeat: DVector<f64>,
    /// Number of its session among those with stated weights; `None` for another.
    pub session: Option<usize>,
}

impl MountingComponents {
    /// A mounting in this session of which everything is measured without end, and nothing moves.
    pub fn complete(rows: usize, session: Option<usize>) -> Self {
        let none = DVector::zeros(2 * rows);
        Self { at: (0..2 * rows).collect(), y: none.clone(), repeat: none, session }
    }

    /// The same mounting as if it were of this session.
    pub fn of_session(self, session: Option<usize>) -> Self {
        Self { session, ..self }
    }

    fn of(m: &Mounting, repeat_variance: &DVector<f64>, session: Option<usize>) -> Self {
        let rows = m.phasors.len();
        let at: Vec<usize> = (0..2 * rows).filter(|i| m.phasors[i % rows].is_some()).collect();
        let value = |i: usize| {
            let y = m.phasors[i % rows].unwrap_or_default();
            if i < rows { y.re } else { y.im }
        };
        let repeat = |i: usize| repeat_variance[i % rows] / m.repeats[i % rows].max(1) as f64;
        Self {
            y: DVector::from_iterator(at.len(), at.iter().map(|i| value(*i))),
            repeat: DVector::from_iterator(at.len(), at.iter().map(|i| repeat(*i))),
            at,
            session,
        }
    }
}

/// Mountings to learn from, and the prior of the model.
pub struct InfluenceLearner {
    pub seen: Vec<MountingComponents>,
    /// Stated weights by mounting and plane, g·mm; `None` for a blind run.
    pub stated: Vec<Option<Vec<C>>>,
    linear: LinearInfluence,
    structure: ScatterStructure,
    largest_um: f64,
    sessions: usize,
    /// How far sessions differ where that is not learned.
    pub between_sessions: Option<SessionScatter>,
}

#[derive(Debug, Clone)]
pub struct LearnedInfluence {
    /// Response of the base run and influence of each plane, µm and µm per g·mm.
    pub posterior: InfluencePosterior,
    /// Covariance between mountings, in real form, µm².
    pub scatter: DMatrix<f64>,
    /// Parameters of the model, in standard deviations.
    pub parameters: DVector<f64>,
    /// Standard deviation of a weight, relative.
    pub placement: f64,
    /// How far sessions differ.
    pub between_sessions: SessionScatter,
    /// Shift of each session.
    effects: Vec<SessionEffect>,
    /// Shift of a session without a run with stated weights.
    of_another: SessionEffect,
    sizes: DVector<f64>,
    discrepancy: f64,
    mountings: f64,
}

impl LearnedInfluence {
    /// Number of complex rows.
    pub fn rows(&self) -> usize {
        self.posterior.rows()
    }

    /// Degrees of freedom of the size of the scatter: two of each mounting that the response of the base run and the
    /// influence do not need, and two of each that the guess counts for.
    pub fn freedom(&self) -> f64 {
        2.0 * (GUESS_WEIGHT + (self.mountings - (1 + self.posterior.planes()) as f64).max(0.0))
    }

    /// Influence of each plane, complex rows × planes, µm per g·mm.
    pub fn influence(&self) -> DMatrix<C> {
        self.posterior.per_weight()
    }

    fn effect(&self, session: Option<usize>) -> &SessionEffect {
        session.map_or(&self.of_another, |s| &self.effects[s])
    }

    /// What these weights do by the learned influence, and the covariance of a mounting's difference from it; `placed`
    /// whether the weights may be off by what stated weights are.
    pub fn predict(&self, seen: &MountingComponents, weights: &[C], placed: bool) -> MountingPrediction {
        let influence = self.influence();
        let effect = self.effect(seen.session);
        let shift = shift_design(&influence, weights).select_rows(&seen.at);
        let design = design(weights, self.rows()).select_rows(&seen.at);
        let followed = effect.followed(&design, &shift);
        let between_sessions = &shift * &effect.covariance * shift.transpose();
        let mut covariance = picked(&self.scatter, &seen.at)
            + &followed * &self.posterior.covariance * followed.transpose()
            + &between_sessions;
        covariance += DMatrix::from_diagonal(&seen.repeat);
        let shifted = effect.mean(&self.posterior);
        let (n, planes) = (2 * self.rows(), weights.len());
        let scale = |j: usize| C::new(1.0 + shifted[n + j], shifted[n + planes + j]);
        let scaled = DMatrix::from_fn(n / 2, planes, |row, j| influence[(row, j)] * scale(j));
        let per_weight = real(&scaled).select_rows(&seen.at);
        if placed {
            covariance += &per_weight * placement(weights, self.placement) * per_weight.transpose();
        }
        let mean = design * &self.posterior.mean + shift * shifted;
        MountingPrediction { mean, covariance, between_sessions, per_weight }
    }
}

/// Predicted mean and covariance of a mounting.
pub struct MountingPrediction {
    /// Expected components of the mounting, µm.
    pub mean: DVector<f64>,
    /// Covariance of the measurement minus `mean`, µm².
    pub covariance: DMatrix<f64>,
    /// The part of it that the shift of the session adds, µm².
    pub between_sessions: DMatrix<f64>,
    /// Components × real parts, then imaginary parts of the weights, µm per g·mm.
    pub per_weight: DMatrix<f64>,
}

/// Covariance of weights that are off in proportion to their size: real parts, then imaginary parts.
pub fn placement(weights: &[C], relative: f64) -> DMatrix<f64> {
    let p = weights.len();
    DMatrix::from_diagonal(&DVector::from_fn(2 * p, |i, _| (relative * weights[i % p].norm()).powi(2)))
}

fn picked(matrix: &DMatrix<f64>, at: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(at).select_columns(at)
}

/// Sums over mountings, for the sizes.
struct ExpectedSums {
    /// Residuals' products, real form.
    residuals: DMatrix<f64>,
    /// Squared relative deviations of weights, and how many weights.
    placed: [f64; 2],
}

impl InfluenceLearner {
    /// Mountings of a machine near a point of its model.
    pub fn new(
        mountings: &Mountings,
        sessions: &Sessions,
        linear: LinearInfluence,
        structure: ScatterStructure,
    ) -> Self {
        let components = |(m, session): (&Mounting, &Option<usize>)| {
            MountingComponents::of(m, &mountings.repeat_variance, *session)
        };
        Self {
            seen: mountings.runs.iter().zip(&sessions.of).map(components).collect(),
            sessions: sessions.count,
            between_sessions: (sessions.count < 2).then_some(SessionScatter::GUESSED),
            stated: mountings.runs.iter().map(|m| m.stated.clone()).collect(),
            largest_um: mountings.levels_um().into_iter().fold(0.0, f64::max),
            linear,
            structure,
        }
    }

    /// Rounds of expectation and maximisation, each mounting with a share between 0 and 1; they start from `before` where given.
    ///
    /// # Errors
    /// If a covariance is singular.
    pub fn learn(
        &self,
        shares: &[f64],
        before: Option<&LearnedInfluence>,
        rounds: usize,
    ) -> Result<LearnedInfluence, Error> {
        let sizes = before.map_or_else(|| self.structure.guessed(), |b| b.sizes.clone());
        let posterior = InfluencePosterior::known(&self.linear.influence);
        let scatter = before.map_or_else(|| real(&self.structure.covariance(&sizes)), |b| b.scatter.clone());
        let started = before.map_or(SessionScatter::GUESSED, |b| b.between_sessions);
        let between_sessions = self.between_sessions.unwrap_or(started);
        let another = self.no_runs(&between_sessions, &scatter, &posterior)?.effect(None)?;
        let mut learned = LearnedInfluence {
            posterior,
            scatter,
            between_sessions,
            effects: vec![another.clone(); self.sessions],
            of_another: another,
            parameters: self.linear.parameters.clone(),
            placement: before.map_or(PLACEMENT, |b| b.placement),
            sizes,
            discrepancy: before.map_or(1.0, |b| b.discrepancy),
            mountings: shares.iter().sum(),
        };
        for _ in 0..rounds {
            self.round(&mut learned, shares)?;
        }
        Ok(learned)
    }

    fn no_runs(
        &self,
        sizes: &SessionScatter,
        scatter: &DMatrix<f64>,
        posterior: &InfluencePosterior,
    ) -> Result<SessionRuns, Error> {
        SessionRuns::none(sizes, scatter, posterior.planes(), posterior.mean.len())
    }

    /// Prior covariance of the influence.
    fn spread(&self, discrepancy: f64) -> DMatrix<f64> {
        &self.linear.slopes * self.linear.slopes.transpose() + &self.linear.discrepancy * discrepancy
    }

    fn round(&self, learned: &mut LearnedInfluence, shares: &[f64]) -> Result<(), Error> {
        let n = 2 * learned.rows();
        let spread = factor(self.spread(learned.discrepancy))?;
        let mut regression = Regression::new(learned.rows(), learned.posterior.planes());
        let free = 1.0 / (BASE_SD * self.largest_um).powi(2);
        regression.add_prior(free, &self.linear.mean, &spread);
        let influence = learned.influence();
        let per_weight = real(&influence);
        let no_runs = self.no_runs(&learned.between_sessions, &learned.scatter, &learned.posterior)?;
        let mut sessions = vec![no_runs.clone(); self.sessions];
        let mut used = Vec::new();
        for (k, stated) in self.stated.iter().enumerate() {
            let (Some(weights), true) = (stated, shares[k] > 0.0) else { continue };
            let seen = &self.seen[k];
            let design = design(weights, n / 2).select_rows(&seen.at);
            let per_weight = per_weight.select_rows(&seen.at);
            let placed = placement(weights, learned.placement);
            let mut covariance = picked(&learned.scatter, &seen.at) + DMatrix::from_diagonal(&seen.repeat);
            covariance += &per_weight * &placed * per_weight.transpose();
            let inverse = factor(covariance)?.inverse();
            regression.add(&design, &inverse, &seen.y, shares[k]);
            let shift = shift_design(&influence, weights).select_rows(&seen.at);
            if let Some(session) = seen.session {
                sessions[session].add([&shift, &design], &inverse, &seen.y, shares[k]);
            }
            used.push((k, [design, shift], per_weight, placed, inverse));
        }
        learned.effects =
            sessions.into_iter().map(|s| s.effect(Some(&mut regression))).collect::<Result<_, _>>()?;
        learned.of_another = no_runs.effect(None)?;
        learned.posterior = regression.solve()?;
        let mut sums = ExpectedSums { residuals: DMatrix::zeros(n, n), placed: [0.0; 2] };
        for (k, [design, shift], per_weight, placed, inverse) in used {
            let effect = learned.effect(self.seen[k].session);
            let followed = effect.followed(&design, &shift);
            let expected = &design * &learned.posterior.mean + &shift * effect.mean(&learned.posterior);
            let left = &self.seen[k].y - expected;
            let seen = &left * left.transpose()
                + &followed * &learned.posterior.covariance * followed.transpose()
                + &shift * &effect.covariance * shift.transpose();
            // of each cause the mean and the covariance, given what was seen
            let cause = |prior: DMatrix<f64>, reads: DMatrix<f64>| {
                let gain = reads.transpose() * &inverse;
                &gain * &seen * gain.transpose() + prior - gain * reads
            };
            let whole = learned.scatter.clone();
            let columns = whole.select_rows(&self.seen[k].at);
            sums.residuals += cause(whole, columns) * shares[k];
            let weights = self.stated[k].as_deref().unwrap_or_default();
            let moved = cause(placed.clone(), &per_weight * &placed);
            for (j, u) in weights.iter().enumerate().filter(|(_, u)| u.norm() > 0.0) {
                let squares = moved[(j, j)] + moved[(weights.len() + j, weights.len() + j)];
                sums.placed[0] += shares[k] * squares / u.norm_sqr();
                sums.placed[1] += shares[k] * 2.0;
            }
        }
        if self.between_sessions.is_none() {
            learned.between_sessions =
                SessionScatter::of(&learned.effects, &learned.scatter, &learned.posterior)?;
        }
        self.resize(learned, &spread, &sums);
        Ok(())
    }

    /// Maximisation: sizes of scatter, placement errors and discrepancy from the expected squares of the last round.
    fn resize(&self, learned: &mut LearnedInfluence, spread: &Cholesky<f64, Dyn>, sums: &ExpectedSums) {
        let guess = 2.0 * PLACEMENT_WEIGHT;
        let placed = (sums.placed[0] + guess * PLACEMENT * PLACEMENT) / (sums.placed[1] + guess);
        learned.placement = placed.sqrt();
        let scatter = circular(&sums.residuals);
        learned.sizes = self.structure.sizes(&learned.sizes, &scatter, learned.mountings);
        learned.scatter = real(&self.structure.with_residuals(&learned.sizes, &scatter, learned.mountings));
        let n = 2 * learned.rows();
        let inner = n * learned.posterior.planes();
        let off = spread.solve(&(learned.posterior.mean.rows(n, inner) - &self.linear.mean));
        let posterior = learned.posterior.covariance.view((n, n), (inner, inner));
        let unit = &self.linear.discrepancy;
        let own = unit * learned.discrepancy;
        // of the discrepancy, in units of its guess: mean and covariance given the influence, and that of the influence
        let mean_square = off.dot(&(unit * &off)) * learned.discrepancy.powi(2);
        let narrowed = spread.solve(&own).trace();
        let through = spread.solve(&(posterior * spread.solve(&own))).trace() * learned.discrepancy;
        let squares = mean_square + (inner as f64 - narrowed) * learned.discrepancy + through;
        learned.discrepancy = (DISCREPANCY_WEIGHT + squares) / (DISCREPANCY_WEIGHT + inner as f64);
        let moved = self.linear.slopes.tr_mul(&off);
        learned.parameters = moved;
    }
}
