//! None of these: an unknown force that explains the data better than any known effect.

use nalgebra::Complex;

use super::base::{Base, Tried};
use crate::error::Error;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::unknown_force::UnknownForce;
use crate::fit::{Drawing, Fit, Fitter};
use crate::measurement::rpm;

/// Assumptions that are fitted to the end after all were screened.
const REFINED: usize = 2;
/// A share above this is "mostly".
const MOSTLY: f64 = 0.75;

/// An unknown force beside a model.
pub struct Unknown {
    /// The best of all.
    pub force: UnknownForce,
    /// Evidence for it over the model alone, as [`Tried::delta_bic`]; that its place is not known is paid for.
    pub delta_bic: f64,
    /// Probability of each place, m from the left end, if it is one.
    pub places: Vec<(f64, f64)>,
}

/// How an unknown force depends on speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Growth {
    /// About the same at every speed.
    Constant,
    /// About with the square of speed.
    Squared,
    /// Largest at some speed inside the range.
    Peaked,
}

/// What is said of an unknown force.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownCause {
    /// Where it acts most probably, m from the left end.
    pub position_m: f64,
    /// Probability that it is there and not elsewhere along the shaft.
    pub place_probability: f64,
    /// Probability that something outside the list is missing.
    pub probability: f64,
    /// Its dependence on speed.
    pub growth: Growth,
    /// Share of its square that turns with the shaft.
    pub forward: f64,
    /// Speed at which it is largest, rpm.
    pub speed_rpm: f64,
    /// Its size there, N.
    pub force_n: f64,
}

impl Unknown {
    /// Beside the model of a base.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside(base: &Base) -> Result<Self, Error> {
        let (drawing, fit) = &base.search;
        Self::of(base.fitter, &base.hypothesis, fit, drawing, base.fit.bic())
    }

    /// Beside a candidate.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside_candidate(base: &Base, t: &Tried) -> Result<Self, Error> {
        Self::of(base.fitter, &base.hypothesis.with(t.assumed), &t.fit, t.drawing(base), t.fit.bic())
    }

    fn of(
        fitter: &Fitter,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        own_bic: f64,
    ) -> Result<Self, Error> {
        let assumptions = fitter.unknown_forces();
        let screened = fitter.screened(hypothesis, fit, drawing, &assumptions)?;
        let mut order: Vec<usize> = (0..assumptions.len()).collect();
        order.sort_by(|a, b| screened[*a].total_cmp(&screened[*b]));
        let least = screened[order[0]];
        let weights: Vec<f64> = screened.iter().map(|cost| (0.5 * (least - cost)).exp()).collect();
        let total: f64 = weights.iter().sum();
        let fits: Result<Vec<UnknownForce>, Error> = order
            .iter()
            .take(REFINED)
            .map(|i| fitter.with_unknown_force(hypothesis, fit, drawing, assumptions[*i]))
            .collect();
        let force = fits?.into_iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let force = force.ok_or_else(|| Error::Unsuitable("the shaft has no place for a force".into()))?;
        // its size is the one real number that was chosen for it; its freedom is paid for in its cost
        let occam = (force.fit.values as f64).ln();
        let averaged = 2.0 * (total / assumptions.len() as f64).ln();
        let mut places: Vec<(f64, f64)> = Vec::new();
        for (a, w) in assumptions.iter().zip(&weights) {
            match places.iter_mut().find(|(z, _)| *z == a.position_m) {
                Some((_, share)) => *share += w / total,
                None => places.push((a.position_m, w / total)),
            }
        }
        Ok(Self { delta_bic: own_bic - force.fit.bic() - occam + averaged, force, places })
    }

    /// In words and numbers.
    pub fn cause(&self, probability: f64) -> UnknownCause {
        let sizes: Vec<f64> = self.force.force_n.iter().map(size).collect();
        let largest = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b])).unwrap_or(0);
        let all: f64 = self.force.force_n.iter().flatten().map(|f| f.norm_sqr()).sum();
        let forward: f64 = self.force.force_n.iter().map(|f| f[0].norm_sqr()).sum();
        let position_m = self.force.assumption.position_m;
        UnknownCause {
            position_m,
            place_probability: self.places.iter().find(|(z, _)| *z == position_m).map_or(0.0, |(_, p)| *p),
            probability,
            growth: growth(&self.force.knots_rad_s, &sizes),
            forward: forward / all.max(f64::MIN_POSITIVE),
            speed_rpm: rpm(self.force.knots_rad_s[largest]),
            force_n: sizes[largest],
        }
    }
}

fn size(force: &[Complex<f64>; 2]) -> f64 {
    force[0].norm().hypot(force[1].norm())
}

/// The power of speed that sizes follow best, by least squares of their logarithms, if they follow one.
fn growth(speeds_rad_s: &[f64], sizes: &[f64]) -> Growth {
    let points: Vec<(f64, f64)> =
        speeds_rad_s.iter().zip(sizes).filter(|(_, f)| **f > 0.0).map(|(w, f)| (w.ln(), f.ln())).collect();
    let n = points.len().max(1) as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread.max(f64::MIN_POSITIVE);
    let about = |power: f64| points.iter().map(|p| (p.1 - y - power * (p.0 - x)).powi(2)).sum::<f64>() / n;
    // a factor of two either way is what a piecewise force of noisy data scatters by
    let follows = |power: f64| about(power) < std::f64::consts::LN_2.powi(2);
    if slope < 1.0 && follows(0.0) {
        Growth::Constant
    } else if slope >= 1.0 && follows(2.0) {
        Growth::Squared
    } else {
        Growth::Peaked
    }
}

impl UnknownCause {
    /// How it turns, in a word or two.
    pub fn whirl(&self) -> &'static str {
        match self.forward {
            f if f > MOSTLY => "forward",
            f if f < 1.0 - MOSTLY => "backward",
            _ => "forward and backward",
        }
    }

    /// How it grows, in words.
    pub fn growth_in_words(&self) -> &'static str {
        match self.growth {
            Growth::Constant => "the same at every speed",
            Growth::Squared => "with the square of speed",
            Growth::Peaked => "largest at some speed inside the range",
        }
    }

    /// Kinds of causes that look like that.
    pub fn looks_like(&self) -> &'static str {
        match (self.growth, self.forward > MOSTLY) {
            (Growth::Constant, true) => {
                "a bent or thermally bowed shaft, a misaligned coupling, a force from the driven machine"
            }
            (Growth::Squared, true) => {
                "unbalance elsewhere or spread along the shaft, a loose part, a disk or plane that is not where the \
                 drawing says"
            }
            (Growth::Peaked, true) => {
                "a stiffness, mass or damping that the model lacks: a rub, a seal, a changed bearing, a wrong mass or \
                 modulus; a bow that grows while it runs"
            }
            (_, false) => {
                "a support or foundation that differs by direction, a cracked or anisotropic shaft, a rub, probes that \
                 are turned, swapped or off in phase"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_told_by_the_power_of_speed_and_a_peak_by_following_none() {
        let speeds: Vec<f64> = (1..=12).map(|k| 50.0 * f64::from(k)).collect();
        let of =
            |size: &dyn Fn(f64) -> f64| growth(&speeds, &speeds.iter().map(|w| size(*w)).collect::<Vec<_>>());
        assert_eq!(of(&|w| 3.0 + 0.5 * (w * 0.1).sin()), Growth::Constant);
        assert_eq!(of(&|w| 1e-4 * w * w), Growth::Squared);
        assert_eq!(of(&|w| 1.0 / (1e-3 + (w / 300.0 - 1.0).powi(2))), Growth::Peaked);
    }
}
