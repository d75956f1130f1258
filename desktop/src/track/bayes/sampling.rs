//! Samples of bearings and unbalance, their intervals and their convergence.

use nalgebra::Complex;

use crate::statistics::convergence::Convergence;
use crate::track::answer::{CredibleIntervals, Interval};
use crate::track::coefficients::Logs;

type C = Complex<f64>;

#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorSample {
    /// Logarithms of the bearing coefficients.
    pub logs: Logs,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
}

impl PosteriorSample {
    /// The same with these weights in the planes, kg·m.
    pub fn with_weights(mut self, weights_kg_m: &[C]) -> Self {
        self.unbalance_kg_m.iter_mut().zip(weights_kg_m).for_each(|(u, weight)| *u += weight);
        self
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SamplerKind {
    /// Proposals from a mixture of Student distributions that covers the posterior of the bearings, the unbalance integrated.
    Independence,
    /// The paper's random walk in bearings and unbalance, of one step size.
    Metropolis,
}

/// Convergence of a day's chains, by the worst quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    pub acceptance: f64,
    /// Potential scale reduction; 1 at convergence.
    pub r_hat: f64,
    /// Effective sample size of a mean, all chains together.
    pub effective_bulk: f64,
    /// Effective sample size of the ends of an interval.
    pub effective_tail: f64,
}

impl Quality {
    /// Of sampled quantities, each with one row a chain.
    pub fn of(acceptance: f64, quantities: &[Vec<Vec<f64>>]) -> Option<Self> {
        let Convergence { r_hat, effective_bulk, effective_tail } = Convergence::worst(quantities)?;
        Some(Self { acceptance, r_hat, effective_bulk, effective_tail })
    }
}

/// Convergence of the sampling over the record.
#[derive(Debug, Clone)]
pub struct Sampling {
    pub sampler: SamplerKind,
    /// Proposals of each chain and round; rounds are added until the chains converge.
    pub proposals: usize,
    pub chains: usize,
    /// Each day, days since the record began.
    pub days: Vec<(f64, Quality)>,
    /// Median over the days on which adaptive Metropolis sampled beside the paper's random walk.
    pub adaptive: Option<Quality>,
    /// Samples of the last day: what the histograms show.
    pub last: Vec<PosteriorSample>,
}

impl Sampling {
    /// Median over days of each figure separately.
    pub fn median(&self) -> Option<Quality> {
        median(self.days.iter().map(|(_, quality)| quality))
    }

    /// Worst day of each figure separately.
    pub fn worst(&self) -> Option<Quality> {
        let all = self.days.iter().map(|(_, quality)| *quality);
        all.reduce(|a, b| Quality {
            acceptance: a.acceptance.min(b.acceptance),
            r_hat: a.r_hat.max(b.r_hat),
            effective_bulk: a.effective_bulk.min(b.effective_bulk),
            effective_tail: a.effective_tail.min(b.effective_tail),
        })
    }
}

/// Median of each figure separately.
pub fn median<'a>(all: impl Iterator<Item = &'a Quality>) -> Option<Quality> {
    let all: Vec<&Quality> = all.collect();
    let of = |figure: fn(&Quality) -> f64| {
        let mut values: Vec<f64> = all.iter().map(|q| figure(q)).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some(Quality {
        acceptance: of(|q| q.acceptance)?,
        r_hat: of(|q| q.r_hat)?,
        effective_bulk: of(|q| q.effective_bulk)?,
        effective_tail: of(|q| q.effective_tail)?,
    })
}

/// 95 % intervals of samples; angles are unwrapped around those of `middle`.
pub fn spread(middle: &PosteriorSample, samples: &[PosteriorSample]) -> CredibleIntervals {
    let interval = |value: &dyn Fn(&PosteriorSample) -> f64| {
        let mut values: Vec<f64> = samples.iter().map(value).collect();
        let mut at = |share: f64| {
            let rank = ((values.len() - 1) as f64 * share).round() as usize;
            *values.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        Interval { low: at(0.025), high: at(0.975) }
    };
    let planes = 0..middle.unbalance_kg_m.len();
    let angle = |j: usize| {
        let middle = middle.unbalance_kg_m[j];
        let turned = interval(&|s| (s.unbalance_kg_m[j] * middle.conj()).arg());
        Interval { low: middle.arg() + turned.low, high: middle.arg() + turned.high }
    };
    CredibleIntervals {
        logs: (0..middle.logs.len()).map(|i| interval(&|s| s.logs[i])).collect(),
        magnitude_kg_m: planes.clone().map(|j| interval(&|s| s.unbalance_kg_m[j].norm())).collect(),
        angle_rad: planes.map(angle).collect(),
    }
}
