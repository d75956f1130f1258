//! Probability that a diagnosis finds an effect.
//!
//! An effect that the model lacks lowers the cost of a fit by a gain whose average is its loss and whose distribution is that of a
//! noncentral χ² with as many degrees of freedom as the effect has unknowns (Sankaran's approximation, Biometrika 1959, 46, 235). A
//! rival gains less by the squared difference that it leaves; the difference of both is normal with four times that variance. Both
//! come from the same noise, so that they are correlated; beside that, rivals are taken as independent of one another. The diagnosis
//! claims something when the odds of everything over nothing but noise exceed those of [`SURE`], and names one effect when no rival
//! has [`RIVAL`] of its probability.

use statrs::function::erf::{erfc, erfc_inv};

use super::imitation::{Candidate, UnknownEvidence};
use super::model::Signal;
use super::planned::PlannedModel;
use crate::diagnose::rank::{OUTSIDE, SHOWN};
use crate::diagnose::{RIVAL, SURE};
use crate::statistics::evidence::Sizes;

/// Halvings in the search of a gain.
const HALVINGS: usize = 32;
/// Gains of equal probability over which the contest with rivals is averaged.
const GAINS: usize = 16;
/// Standard deviations from which on a rival never comes near.
const FAR: f64 = 5.0;
/// Loss of a rival from which on it adds nothing to the odds that something is missing.
const HOPELESS: f64 = 80.0;

/// A rival of the effect that makes a signal.
#[derive(Debug, Clone, Copy)]
pub struct Rival {
    /// Number of the candidate; `None` for an unknown cause.
    pub candidate: Option<usize>,
    /// Length of what it leaves, in noise units, and what that costs on average.
    pub left_sd: f64,
    pub lost: f64,
    /// Probability that the effect has so much more evidence that it is not mentioned.
    pub is_beaten: f64,
}

/// What a rival leaves of a signal when it is fitted, as a share of what it leaves when its directions are taken as linear.
#[derive(Debug, Clone, Copy)]
pub struct FittedRival {
    pub candidate: usize,
    pub share: f64,
}

/// What another candidate leaves of a signal.
#[derive(Debug, Clone, Copy)]
struct Remainder {
    /// Number of the candidate.
    candidate: usize,
    /// Its length, in noise units, and its average cost.
    left_sd: f64,
    lost: f64,
}

/// The signal of an effect as everything else explains it, before rivals are fitted.
#[derive(Debug, Clone)]
pub struct Explained {
    sizes: Sizes,
    /// Average cost of missing the effect, and the squared signal that it comes from.
    loss: f64,
    squared: f64,
    /// Of every other candidate.
    remainders: Vec<Remainder>,
    unknown: UnknownEvidence,
}

impl Explained {
    /// Of the signal of a candidate.
    pub fn of(planned: &PlannedModel, number: usize, signal: &Signal) -> Self {
        let (visible, noise) = (&signal.visible, &*signal.noise);
        let others = planned.candidates.iter().enumerate().filter(|(k, _)| *k != number);
        let remainder = |(candidate, other): (usize, &Candidate)| {
            let [by_fit, linear] = other.left(noise, [visible, &signal.linear]);
            let left = if linear.norm_squared() < by_fit.norm_squared() { linear } else { by_fit };
            Remainder { candidate, left_sd: left.norm(), lost: noise.loss(&left).max(0.0) }
        };
        Self {
            sizes: noise.sizes,
            loss: noise.loss(visible).max(0.0),
            squared: visible.norm_squared(),
            remainders: others.map(remainder).collect(),
            unknown: planned.unknown.evidence(noise, visible),
        }
    }
}

/// How a diagnosis of an effect ends.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Probability that the effect is named, alone or in a group.
    pub found: f64,
    /// Probability that it is named alone.
    pub alone: f64,
    /// All other candidates and an unknown cause, the best imitation first.
    pub rivals: Vec<Rival>,
    /// Information on which effect it is, bits.
    pub bits: f64,
}

/// Probability that a standard normal number is below.
pub fn normal_below(z: f64) -> f64 {
    0.5 * erfc(-z / std::f64::consts::SQRT_2)
}

/// Probability that a noncentral χ² is below `x`.
pub fn noncentral_below(x: f64, degrees: f64, noncentrality: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (mean, spread, third) =
        (degrees + noncentrality, degrees + 2.0 * noncentrality, degrees + 3.0 * noncentrality);
    let h = 1.0 - 2.0 / 3.0 * mean * third / (spread * spread);
    let p = spread / (mean * mean);
    let m = (h - 1.0) * (1.0 - 3.0 * h);
    let centre = 1.0 + h * p * (h - 1.0 - 0.5 * (2.0 - h) * m * p);
    normal_below(((x / mean).powf(h) - centre) / (h * (2.0 * p).sqrt() * (1.0 + 0.5 * m * p)))
}

/// Evidence of a candidate by its gain, its prior included.
#[derive(Clone, Copy)]
struct Weight {
    unknowns: usize,
    ln_prior: f64,
    is_switch: bool,
}

impl Weight {
    fn of(candidate: &Candidate, places: f64) -> Self {
        let is_switch = candidate.is_switch;
        let prior = if is_switch { 1.0 } else { (1.0 - OUTSIDE) / places };
        Self { unknowns: candidate.unknowns, ln_prior: prior.ln(), is_switch }
    }

    /// Twice the logarithm of its odds over nothing but noise.
    fn twice_ln_odds(&self, sizes: &Sizes, gain: f64) -> f64 {
        if self.is_switch && gain.abs() <= SHOWN {
            return f64::NEG_INFINITY;
        }
        sizes.evidence(gain, self.unknowns) + 2.0 * self.ln_prior
    }
}

/// Another explanation beside the effect that makes the signal.
struct Other {
    /// `None` for an unknown cause.
    candidate: Option<usize>,
    left_sd: f64,
    /// What it leaves costs so much on average.
    lost: f64,
    /// By how much its gain, or the evidence of an unknown cause, is smaller: average and variance.
    less: f64,
    variance: f64,
    /// Squared correlation of what it leaves with the signal.
    common: f64,
    weight: Weight,
    /// Differences from which on it is no rival, and up to which it hides the effect.
    beaten_from: f64,
    hides_to: f64,
}

impl Other {
    /// Probabilities that the difference is above both limits, for a gain of the effect so many standard deviations above its average.
    fn probabilities(&self, z: f64) -> [f64; 2] {
        // the part of the difference that follows the gain
        let mean = self.less + 2.0 * z * (self.lost * self.common).sqrt();
        let sd = (self.variance - 4.0 * self.lost * self.common).max(0.0).sqrt();
        [self.beaten_from, self.hides_to].map(|limit| match sd > 1e-9 {
            true => normal_below((mean - limit) / sd),
            false => f64::from(u8::from(mean >= limit)),
        })
    }
}

/// How much one is of another, 0 to 1.
fn share_of(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 }
}

/// What an effect stands against.
struct Contest {
    sizes: Sizes,
    weight: Weight,
    degrees: f64,
    /// Average cost of missing the effect, and the squared signal that it comes from.
    loss: f64,
    squared: f64,
    others: Vec<Other>,
    /// Of an unknown cause; its evidence is twice the logarithm of its odds at the average gain.
    unknown: UnknownEvidence,
}

impl Contest {
    fn new(planned: &PlannedModel, number: usize, explained: &Explained, fitted: &[FittedRival]) -> Self {
        let own = &planned.candidates[number];
        let places = planned.candidates.len().max(1) as f64;
        let degrees = own.unknowns as f64;
        let Explained { sizes, loss, squared, ref remainders, unknown } = *explained;
        let other = |&Remainder { candidate, left_sd, lost }: &Remainder| {
            let other = &planned.candidates[candidate];
            let share = fitted.iter().find(|f| f.candidate == candidate).map_or(1.0, |f| f.share);
            let lost = share * lost;
            let different = degrees + other.unknowns as f64 - 2.0 * own.common(other);
            Other {
                candidate: Some(candidate),
                left_sd: share.sqrt() * left_sd,
                lost,
                less: lost + degrees - other.unknowns as f64,
                variance: 4.0 * lost + 2.0 * different.max(0.0),
                common: share_of(lost, loss),
                weight: Weight::of(other, places),
                beaten_from: f64::NAN,
                hides_to: f64::NAN,
            }
        };
        let others = remainders.iter().map(other).collect();
        let evidence = unknown.evidence + loss - squared + 2.0 * OUTSIDE.ln();
        let unknown = UnknownEvidence { evidence, ..unknown };
        Self { sizes, weight: Weight::of(own, places), degrees, loss, squared, others, unknown }
    }

    fn average(&self) -> f64 {
        self.loss + self.degrees
    }

    /// The gain from which on something is claimed.
    fn claimed_from(&self) -> f64 {
        let of = |twice_ln: f64| (0.5 * twice_ln).min(600.0).exp();
        let near: Vec<&Other> = self.others.iter().filter(|o| o.less < HOPELESS).collect();
        // the unknown cause follows the gain of the effect, as both come from the same readings
        let odds = |gain: f64| {
            let rivals = near.iter().map(|o| of(o.weight.twice_ln_odds(&self.sizes, gain - o.less)));
            let own = of(self.weight.twice_ln_odds(&self.sizes, gain));
            own + rivals.sum::<f64>() + of(self.unknown.evidence + gain - self.average())
        };
        bisect(0.0, 4.0 * self.average() + 400.0, |gain| odds(gain) >= SURE.recip() - 1.0)
    }

    /// Finds out from which difference on each other explanation is beaten, at a typical gain.
    fn set_limits(&mut self, gain: f64) {
        let mine = self.weight.twice_ln_odds(&self.sizes, gain);
        let margin = -2.0 * RIVAL.ln();
        for other in &mut self.others {
            let far = FAR * other.variance.sqrt();
            // evidence falls as the difference grows
            let limit = |least: f64| {
                let leads = |d: f64| mine - other.weight.twice_ln_odds(&self.sizes, gain - d) >= least;
                bisect(other.less - far - 1e-6, other.less + far + 1e-6, leads)
            };
            let beaten_from = limit(margin);
            let is_beaten = beaten_from <= other.less - far;
            (other.beaten_from, other.hides_to) =
                (beaten_from, if is_beaten { beaten_from } else { limit(-margin) });
        }
        let less = mine - (self.unknown.evidence + gain - self.average());
        // what it leaves and what it is free to follow beside the effect; that its evidence is less is mostly its freedom
        let scale = share_of(self.loss, self.squared);
        let (lost, along) = (scale * self.unknown.left, share_of(self.unknown.followed, self.squared));
        let different = self.degrees * (1.0 - 2.0 * along) + self.unknown.freedom;
        self.others.push(Other {
            candidate: None,
            left_sd: lost.sqrt(),
            lost,
            less,
            variance: 4.0 * lost + 2.0 * different.max(0.0),
            common: share_of(
                (self.squared - self.unknown.followed).powi(2),
                self.unknown.left * self.squared,
            ),
            weight: self.weight,
            beaten_from: margin,
            hides_to: 0.0,
        });
    }
}

/// How the diagnosis of a candidate ends whose signal is explained so, where some rivals were fitted.
pub fn outcome(
    planned: &PlannedModel,
    number: usize,
    explained: &Explained,
    fitted: &[FittedRival],
) -> Outcome {
    let mut contest = Contest::new(planned, number, explained, fitted);
    let of_others: f64 = contest.others.iter().map(|o| (-o.lost / 8.0).exp()).sum();
    let alike = 1.0 + (-contest.loss / 8.0).exp() + of_others;
    let claimed = contest.claimed_from();
    let missed = below(claimed, contest.loss, contest.squared, contest.degrees);
    contest.set_limits(contest.average().max(claimed));
    let (mut alone, mut found) = (0.0, 0.0);
    let mut mean_beaten = vec![0.0; contest.others.len()];
    for k in 0..GAINS {
        // of the gains that lead to a claim
        let below = missed + (1.0 - missed) * (k as f64 + 0.5) / GAINS as f64;
        let z = deviate(below);
        let [beats, shows] =
            contest.others.iter().zip(&mut mean_beaten).fold([1.0, 1.0], |[a, b], (other, mean)| {
                let [beaten, shown] = other.probabilities(z);
                *mean += beaten / GAINS as f64;
                [a * beaten, b * shown]
            });
        (alone, found) = (alone + beats / GAINS as f64, found + shows / GAINS as f64);
    }
    let rival = |(o, is_beaten): (&Other, f64)| Rival {
        candidate: o.candidate,
        left_sd: o.left_sd,
        lost: o.lost,
        is_beaten,
    };
    let mut rivals: Vec<Rival> = contest.others.iter().zip(mean_beaten).map(rival).collect();
    rivals.sort_by(|a, b| a.left_sd.total_cmp(&b.left_sd));
    let count = planned.candidates.len() as f64 + 1.0;
    let claims = 1.0 - missed;
    Outcome { found: claims * found, alone: claims * alone, rivals, bits: (count / alike).log2() }
}

/// The standard normal deviate below which a number is with this probability, up to six.
pub fn deviate(probability: f64) -> f64 {
    let p = probability.clamp(1e-9, 1.0 - 1e-9);
    -std::f64::consts::SQRT_2 * erfc_inv(2.0 * p)
}

/// Probability that the gain of an effect is below, its average loss being that share of its squared signal.
fn below(gain: f64, loss: f64, squared: f64, degrees: f64) -> f64 {
    if degrees == 0.0 {
        // nothing is fitted: normal around the squared signal with four times its variance
        return normal_below((gain - loss) / (2.0 * loss.sqrt().max(f64::MIN_POSITIVE)));
    }
    let share = if squared > 0.0 { (loss / squared).clamp(0.05, 1.0) } else { 1.0 };
    noncentral_below(gain / share, degrees, squared)
}

/// The least number between two from which on something holds; the upper one where it nowhere does.
fn bisect(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    if holds(low) {
        return low;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
