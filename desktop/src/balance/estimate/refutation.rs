//! Stated weights that cannot be true.
//!
//! Each run is a mixture: its weights are as stated, or anything of the size of weights. The odds are those of the two
//! densities of what was measured, with what is not known of influence and scatter in both. Wrong weights would hide themselves by
//! widening the scatter, so learning begins with the runs that agree best and takes in the others as far as they agree
//! (concentration: Rousseeuw and Van Driessen 1999).

use nalgebra::{Complex, DMatrix};
use rayon::prelude::*;

use super::learning::{InfluenceLearner, LearnedInfluence};
use crate::balance::influence::regression::factor;
use crate::error::Error;

type C = Complex<f64>;

/// Share of the runs that learning begins with.
const AGREEING: f64 = 0.6;
/// Rounds in which these are chosen, and of the mixture.
const ROUNDS: [usize; 2] = [4, 8];
/// Rounds of learning in each.
const LEARNING: usize = 4;
/// Probability below which a stated weight is refuted.
pub const REFUTED: f64 = 0.05;

/// A test of stated weights against the other runs.
#[derive(Debug, Clone, Copy)]
pub struct RefutationTest {
    /// Number of the base run, which is not judged.
    pub base: usize,
    /// Standard deviation of a component of a weight that is anything, g·mm.
    pub anything_g_mm: f64,
    /// Logarithm of the odds for a stated weight before anything is seen: one wrong among all that are tried is expected.
    pub log_odds: f64,
}

impl RefutationTest {
    /// `None` for fewer runs than twice the unknowns of the influence: too few to single out a wrong one.
    pub fn of(learner: &InfluenceLearner, base: usize) -> Option<Self> {
        let stated: Vec<&Vec<C>> = learner.stated.iter().flatten().collect();
        let planes = stated.first()?.len();
        let sizes: Vec<f64> =
            stated.iter().copied().flatten().map(C::norm_sqr).filter(|s| *s > 0.0).collect();
        let anything_g_mm = (sizes.iter().sum::<f64>() / (2 * sizes.len().max(1)) as f64).sqrt();
        let enough = stated.len() >= 2 * (1 + planes) + 2;
        enough.then(|| Self { base, anything_g_mm, log_odds: (stated.len() as f64).ln() })
    }

    /// Log odds that the stated weights of a run are true.
    ///
    /// # Errors
    /// If a covariance is singular.
    pub fn log_odds(
        &self,
        learned: &LearnedInfluence,
        learner: &InfluenceLearner,
        run: usize,
    ) -> Result<f64, Error> {
        let Some(stated) = &learner.stated[run] else { return Ok(f64::INFINITY) };
        let seen = &learner.seen[run];
        let expected = learned.predict(seen, stated, true);
        let left = &seen.y - &expected.mean;
        let freedom = learned.freedom();
        let density = |covariance: DMatrix<f64>| -> Result<f64, Error> {
            let factor = factor(covariance)?;
            let distance = left.dot(&factor.solve(&left));
            let log_det: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
            // Student's t
            Ok(-log_det - 0.5 * (freedom + left.len() as f64) * (distance / freedom).ln_1p())
        };
        let reach = &expected.per_weight * expected.per_weight.transpose() * self.anything_g_mm.powi(2);
        let anything = density(&expected.covariance + reach)?;
        Ok(self.log_odds + density(expected.covariance)? - anything)
    }

    /// Probability that the stated weights of each run are true by what is learned without it; 1 for the base run.
    ///
    /// # Errors
    /// If a covariance is singular.
    pub fn probabilities(
        &self,
        without: &[LearnedInfluence],
        learner: &InfluenceLearner,
    ) -> Result<Vec<f64>, Error> {
        let of_run = |k: usize| match k == self.base {
            true => Ok(1.0),
            false => self.log_odds(&without[k], learner, k).map(probability),
        };
        (0..without.len()).map(of_run).collect()
    }

    fn distance(learned: &LearnedInfluence, learner: &InfluenceLearner, run: usize) -> Result<f64, Error> {
        let Some(stated) = &learner.stated[run] else { return Ok(f64::INFINITY) };
        let expected = learned.predict(&learner.seen[run], stated, true);
        let left = &learner.seen[run].y - &expected.mean;
        let values = left.len() as f64;
        Ok(left.dot(&factor(expected.covariance)?.solve(&left)) / values)
    }

    /// Probability that the stated weights of each run are true; zero for blind runs.
    ///
    /// # Errors
    /// If a covariance is singular.
    pub fn shares(&self, learner: &InfluenceLearner) -> Result<Vec<f64>, Error> {
        let stated = |k: usize| learner.stated[k].is_some();
        let all: Vec<usize> = (0..learner.stated.len()).filter(|k| stated(*k)).collect();
        let mut shares: Vec<f64> =
            (0..learner.stated.len()).map(|k| f64::from(u8::from(stated(k)))).collect();
        let mut learned = learner.learn(&shares, None, LEARNING)?;
        let agreeing = (AGREEING * all.len() as f64).ceil() as usize;
        for _ in 0..ROUNDS[0] {
            let distance = |k: &usize| Ok((Self::distance(&learned, learner, *k)?, *k));
            let mut by_distance = all.iter().map(distance).collect::<Result<Vec<_>, Error>>()?;
            by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
            shares.fill(0.0);
            by_distance.iter().take(agreeing).for_each(|(_, k)| shares[*k] = 1.0);
            shares[self.base] = 1.0;
            learned = learner.learn(&shares, None, LEARNING)?;
        }
        for _ in 0..ROUNDS[1] {
            for k in all.iter().filter(|k| **k != self.base) {
                shares[*k] = probability(self.log_odds(&learned, learner, *k)?);
            }
            learned = learner.learn(&shares, Some(&learned), LEARNING)?;
        }
        Ok(shares)
    }
}

fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// What is learned without each run in turn; for a blind run from all others that are stated.
///
/// # Errors
/// If a covariance is singular.
pub fn without_each(
    learner: &InfluenceLearner,
    learned: &LearnedInfluence,
    shares: &[f64],
    base: usize,
) -> Result<Vec<LearnedInfluence>, Error> {
    let without = |k: usize| {
        if shares[k] == 0.0 || k == base {
            return Ok(learned.clone());
        }
        let mut others = shares.to_vec();
        others[k] = 0.0;
        learner.learn(&others, Some(learned), LEARNING)
    };
    (0..shares.len()).into_par_iter().map(without).collect()
}
