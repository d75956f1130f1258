//! Posterior of bearings and unbalance that the paper's chains sample.
//!
//! Coordinates are the logarithms of the bearings, in units of the daily range, and the deviation of the
//! unbalance from its best for these bearings, in its own standard deviations. The density is the same,
//! and a step of one size fits all of them.

use nalgebra::{Complex, DMatrix, DVector};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;

use super::random_walk::{MarkovChain, MetropolisSampler, mean};
use super::sampling::{PosteriorSample, spread};
use crate::track::answer::CredibleIntervals;
use crate::track::coefficients::Logs;
use crate::track::record::Day;

type C = Complex<f64>;

/// A chain begins inside its bounds, at most at this share of the way to them.
const INSIDE: f64 = 0.9;

/// The posterior of some readings with common bearings and unbalance.
pub struct Posterior<'a> {
    days: &'a [&'a Day],
    centre: &'a [f64],
    /// Size of the bearings' coordinates.
    unit: f64,
    range: [Logs; 2],
    /// Where each plane's unbalance was, and how far from there it may be, kg·m.
    around: Vec<(C, f64)>,
    /// Factor of the unbalance's covariance at the centre, kg·m.
    spread: DMatrix<f64>,
}

impl<'a> Posterior<'a> {
    /// Of these readings; `unit` is the size of the bearings' coordinates around `centre`, `range` the lowest and
    /// highest of their logarithms, `around` where each plane's unbalance was and how far from there it may be
    /// (kg·m). `None` if the machine is singular there.
    pub fn new(
        days: &'a [&'a Day],
        centre: &'a [f64],
        unit: f64,
        range: [Logs; 2],
        around: Vec<(C, f64)>,
    ) -> Option<Self> {
        let mut posterior = Self { days, centre, unit, range, around, spread: DMatrix::zeros(0, 0) };
        let (_, normal) = posterior.best(centre)?;
        posterior.spread = normal.cholesky()?.l().try_inverse()?.transpose();
        Some(posterior)
    }

    /// The best unbalance for these bearings, by weighted least squares, real parts and imaginary parts in
    /// turn, and the normal matrix.
    fn best(&self, logs: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let planes = self.around.len();
        let (mut normal, mut right) = (DMatrix::zeros(2 * planes, 2 * planes), DVector::zeros(2 * planes));
        for day in self.days {
            let motion = day.point.on(logs)?;
            let count = day.measured_m.len();
            for (p, y) in day.measured_m.iter().enumerate() {
                let Some(y) = y else { continue };
                let weight = day.sigma_m[p].powi(-2);
                let left = y - motion.probes[planes * count + p];
                for i in 0..planes {
                    let hi = motion.probes[i * count + p].conj() * weight;
                    let r = hi * left;
                    right[2 * i] += r.re;
                    right[2 * i + 1] += r.im;
                    for j in 0..planes {
                        let n = hi * motion.probes[j * count + p];
                        normal[(2 * i, 2 * j)] += n.re;
                        normal[(2 * i + 1, 2 * j + 1)] += n.re;
                        normal[(2 * i, 2 * j + 1)] -= n.im;
                        normal[(2 * i + 1, 2 * j)] += n.im;
                    }
                }
            }
        }
        let best = normal.clone().cholesky()?.solve(&right);
        Some((best, normal))
    }

    /// Where a chain begins: on these bearings, with the best unbalance for them that is within reach. On the
    /// day of an event the best one is not, and a chain begun there would never find a place that is allowed.
    pub fn start(&self, bearings: &[f64]) -> Option<DVector<f64>> {
        let logs = self.logs(bearings);
        let (best, _) = self.best(&logs)?;
        let mut back = DVector::zeros(best.len());
        for (j, (was, reach)) in self.around.iter().enumerate() {
            let away = C::new(best[2 * j], best[2 * j + 1]) - was;
            let excess = away * (1.0 - INSIDE * reach / away.norm()).max(0.0);
            (back[2 * j], back[2 * j + 1]) = (-excess.re, -excess.im);
        }
        let unbalance = self.spread.clone().lu().solve(&back)?;
        let all = bearings.iter().chain(&unbalance).copied();
        Some(DVector::from_iterator(bearings.len() + best.len(), all))
    }

    /// Logarithms at coordinates of the bearings.
    fn logs(&self, coordinates: &[f64]) -> Logs {
        self.centre.iter().zip(coordinates).map(|(centre, z)| centre + self.unit * z).collect()
    }

    fn sample(&self, x: &DVector<f64>) -> Option<PosteriorSample> {
        let (bearings, unbalance) = x.as_slice().split_at(self.centre.len());
        let logs = self.logs(bearings);
        let [low, high] = &self.range;
        let inside = (0..logs.len()).all(|i| (low[i]..=high[i]).contains(&logs[i]));
        let (best, _) = inside.then(|| self.best(&logs))??;
        let u = best + &self.spread * DVector::from_column_slice(unbalance);
        let unbalance_kg_m: Vec<C> = u.as_slice().chunks(2).map(|p| C::new(p[0], p[1])).collect();
        let near = |(u, (was, reach)): (&C, &(C, f64))| (u - was).norm() <= *reach;
        let allowed = unbalance_kg_m.iter().zip(&self.around).all(near);
        allowed.then_some(PosteriorSample { logs, unbalance_kg_m })
    }

    /// Logarithm of the density up to a constant; minus infinity out of bounds.
    pub fn log_density(&self, x: &DVector<f64>) -> f64 {
        let misfit = |s: PosteriorSample| {
            let mut sum = 0.0;
            for day in self.days {
                let shown = day.point.on(&s.logs)?.at(&s.unbalance_kg_m);
                for ((y, m), sigma_m) in shown.iter().zip(&day.measured_m).zip(&day.sigma_m) {
                    sum += m.map_or(0.0, |m| (y - m).l1_norm()) * std::f64::consts::SQRT_2 / sigma_m;
                }
            }
            Some(-sum)
        };
        self.sample(x).and_then(misfit).unwrap_or(f64::NEG_INFINITY)
    }

    /// A chain from each start, each with random numbers of its own.
    pub fn chains(
        &self,
        sampler: &MetropolisSampler,
        starts: &[DVector<f64>],
        proposals: usize,
        seed: u64,
    ) -> Vec<MarkovChain> {
        let one = |(k, start): (usize, &DVector<f64>)| {
            let mut random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(k as u64));
            sampler.chain(start, proposals, &mut random, &mut |x| self.log_density(x))
        };
        starts.par_iter().enumerate().map(one).collect()
    }

    /// Mean of the samples in their own coordinates, their intervals, and the samples, both with the first day's weights.
    pub fn sum_up(
        &self,
        chains: &[MarkovChain],
    ) -> Option<(PosteriorSample, CredibleIntervals, Vec<PosteriorSample>)> {
        let weights_kg_m = &self.days.first()?.weights_kg_m;
        let own = chains.iter().flat_map(|c| &c.samples).filter_map(|x| self.sample(x));
        let all: Vec<PosteriorSample> = own.map(|s| s.with_weights(weights_kg_m)).collect();
        let centre = self.sample(&mean(chains))?;
        let spread = spread(&centre.clone().with_weights(weights_kg_m), &all);
        Some((centre, spread, all))
    }
}
