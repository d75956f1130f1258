//! None of these: an unknown cause that explains the data better than any known effect.

use nalgebra::Complex;
use rayon::prelude::*;

use super::base::{BaseModel, CandidateFit};
use crate::error::Error;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::unknown::{Assumption, UnknownFit};
use crate::fit::{Drawing, Fit, Fitter};
use crate::units::rpm;

/// Assumptions that are fitted to the end after all were screened.
const REFINED: usize = 2;
/// A share above this is "mostly".
const MOSTLY: f64 = 0.75;

/// An unknown cause beside a model.
pub struct UnknownCauseFit {
    pub best: UnknownFit,
    /// Evidence for it over the model alone, as [`CandidateFit::evidence`]; that its place is not known is paid for.
    pub evidence: f64,
    /// Probability of each assumption, if it is one of them.
    pub assumptions: Vec<(Assumption, f64)>,
}

/// How an unknown force depends on speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceGrowth {
    /// About the same at every speed.
    Constant,
    /// About with the square of speed.
    Squared,
    /// Largest at some speed inside the range.
    Peaked,
}

/// Nature of an unknown cause.
#[derive(Debug, Clone, PartialEq)]
pub enum Nature {
    /// A force that depends on speed alone.
    Force(EquivalentForce),
    /// A dynamic stiffness at the bearings: a force that follows their motion.
    Bearings(EquivalentForce),
    /// The same at one place of the shaft.
    Stiffness(EquivalentForce),
    /// A drawing that is off: in what most, and by how much.
    Drawing(String),
}

/// What is said of an unknown cause.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownCause {
    pub nature: Nature,
    /// Where it acts most, m from the left end.
    pub position_m: f64,
    /// Probability that it is of this kind and there, and not another or elsewhere along the shaft.
    pub place_probability: f64,
    /// Probability that something outside the list is missing.
    pub probability: f64,
}

/// The force on the shaft that an unknown cause amounts to.
#[derive(Debug, Clone, PartialEq)]
pub struct EquivalentForce {
    pub growth: ForceGrowth,
    /// Share of its square that turns with the shaft.
    pub forward: f64,
    /// Speed at which it is largest, rpm.
    pub speed_rpm: f64,
    /// Its magnitude at `speed_rpm`, N.
    pub force_n: f64,
}

impl UnknownCauseFit {
    /// Beside the model of a base.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside(base: &BaseModel) -> Result<Self, Error> {
        let (drawing, fit) = &base.search;
        Self::of(base.fitter, &base.hypothesis, fit, drawing, &base.fit)
    }

    /// Beside a candidate.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside_candidate(base: &BaseModel, t: &CandidateFit) -> Result<Self, Error> {
        Self::of(base.fitter, &base.hypothesis.with(t.placed), &t.fit, t.drawing(base), &t.fit)
    }

    fn of(
        fitter: &Fitter,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        own: &Fit,
    ) -> Result<Self, Error> {
        let assumptions = fitter.unknown_causes();
        let screened = fitter.screened(hypothesis, fit, drawing, &assumptions)?;
        let mut order: Vec<usize> = (0..assumptions.len()).collect();
        order.sort_by(|a, b| screened[*a].total_cmp(&screened[*b]));
        let least = screened[order[0]];
        let weights: Vec<f64> = screened.iter().map(|cost| (0.5 * (least - cost)).exp()).collect();
        let total: f64 = weights.iter().sum();
        let fits: Result<Vec<UnknownFit>, Error> = order
            .par_iter()
            .take(REFINED)
            .map(|i| fitter.with_unknown(hypothesis, fit, drawing, &assumptions[*i]))
            .collect();
        let best = fits?.into_iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let best = best.ok_or_else(|| {
            Error::Unsuitable(
                "the shaft has no place for a force, expected at least one bearing, disk or plane".into(),
            )
        })?;
        // its size is the one real number that was chosen for it; its freedom is paid for in its cost
        let price = fitter.sizes.price_of_one(best.determined);
        let averaged = 2.0 * (total / assumptions.len() as f64).ln();
        let evidence = own.cost - best.fit.cost - price + averaged;
        let shares = weights.iter().map(|w| w / total);
        Ok(Self { evidence, best, assumptions: assumptions.into_iter().zip(shares).collect() })
    }

    pub fn cause(&self, fitter: &Fitter, probability: f64) -> UnknownCause {
        let best = &self.best;
        let alike = |a: &Assumption| match (a, &best.assumption) {
            (Assumption::Force { position_m: a, .. }, Assumption::Force { position_m: b, .. }) => a == b,
            (a, b) => a == b,
        };
        let place_probability = self.assumptions.iter().filter(|(a, _)| alike(a)).map(|(_, p)| p).sum();
        let positions_m = best.assumption.positions_m();
        let square = |place: &usize| -> f64 {
            best.forces_n.iter().flat_map(|(_, all)| all[*place]).map(|f| f.norm_sqr()).sum()
        };
        let most = (0..positions_m.len()).max_by(|a, b| square(a).total_cmp(&square(b)));
        let Some(place) = most else {
            let (what, position_m) = fitter.worst_of_drawing(&best.unknowns);
            return UnknownCause {
                nature: Nature::Drawing(what),
                position_m,
                place_probability,
                probability,
            };
        };
        let force = EquivalentForce::of(best.forces_n.iter().map(|(w, all)| (*w, all[place])).collect());
        let nature = match &best.assumption {
            Assumption::Stiffness(all) if all.len() > 1 => Nature::Bearings(force),
            Assumption::Stiffness(_) => Nature::Stiffness(force),
            _ => Nature::Force(force),
        };
        UnknownCause { nature, position_m: positions_m[place], place_probability, probability }
    }
}

impl EquivalentForce {
    /// From its forward and backward part, N, at each speed, rad/s.
    fn of(by_speed: Vec<(f64, [Complex<f64>; 2])>) -> Self {
        let sizes: Vec<(f64, f64)> =
            by_speed.iter().map(|(w, f)| (*w, f[0].norm().hypot(f[1].norm()))).collect();
        let all: f64 = sizes.iter().map(|(_, size)| size * size).sum();
        let forward: f64 = by_speed.iter().map(|(_, f)| f[0].norm_sqr()).sum();
        let (speed_rad_s, force_n) =
            sizes.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        Self {
            growth: growth(&sizes),
            forward: forward / all.max(f64::MIN_POSITIVE),
            speed_rpm: rpm(speed_rad_s),
            force_n,
        }
    }
}

/// The power of speed that sizes follow best, by least squares of their logarithms, if they follow one.
fn growth(by_speed: &[(f64, f64)]) -> ForceGrowth {
    let points: Vec<(f64, f64)> =
        by_speed.iter().filter(|(_, f)| *f > 0.0).map(|(w, f)| (w.ln(), f.ln())).collect();
    let n = points.len().max(1) as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread.max(f64::MIN_POSITIVE);
    let about = |power: f64| points.iter().map(|p| (p.1 - y - power * (p.0 - x)).powi(2)).sum::<f64>() / n;
    // a factor of two either way is what a piecewise force of noisy data scatters by
    let follows = |power: f64| about(power) < std::f64::consts::LN_2.powi(2);
    if slope < 1.0 && follows(0.0) {
        ForceGrowth::Constant
    } else if slope >= 1.0 && follows(2.0) {
        ForceGrowth::Squared
    } else {
        ForceGrowth::Peaked
    }
}

impl EquivalentForce {
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
            ForceGrowth::Constant => "the same at every speed",
            ForceGrowth::Squared => "with the square of speed",
            ForceGrowth::Peaked => "largest at some speed inside the range",
        }
    }

    fn looks_like(&self) -> &'static str {
        match (self.growth, self.forward > MOSTLY) {
            (ForceGrowth::Constant, true) => {
                "a bent or thermally bowed shaft, a misaligned coupling, a force from the driven machine"
            }
            (ForceGrowth::Squared, true) => {
                "unbalance elsewhere or spread along the shaft, a loose part, a disk or plane that is not where the \
                 drawing says"
            }
            (ForceGrowth::Peaked, true) => {
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

impl UnknownCause {
    /// The force that it amounts to, unless it is the drawing that is off.
    pub fn force(&self) -> Option<&EquivalentForce> {
        match &self.nature {
            Nature::Force(force) | Nature::Bearings(force) | Nature::Stiffness(force) => Some(force),
            Nature::Drawing(_) => None,
        }
    }

    /// Kinds of causes that look like that.
    pub fn looks_like(&self) -> &'static str {
        match &self.nature {
            Nature::Force(force) => force.looks_like(),
            Nature::Bearings(_) => {
                "bearings whose coefficients follow speed in a way that constants do not, as oil films and tilting pads do: \
                 state them as a film or a table; supports that resonate"
            }
            Nature::Stiffness(_) => {
                "a further bearing or rest, a seal, a rub or a magnetic pull there that follows no law of the list"
            }
            Nature::Drawing(_) => {
                "a dimension, mass or modulus that was drawn or typed wrong, a part that was changed after the drawing"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_classified_as_constant_squared_or_peaked() {
        let speeds: Vec<f64> = (1..=12).map(|k| 50.0 * f64::from(k)).collect();
        let of =
            |size: &dyn Fn(f64) -> f64| growth(&speeds.iter().map(|w| (*w, size(*w))).collect::<Vec<_>>());
        assert_eq!(of(&|w| 3.0 + 0.5 * (w * 0.1).sin()), ForceGrowth::Constant);
        assert_eq!(of(&|w| 1e-4 * w * w), ForceGrowth::Squared);
        assert_eq!(of(&|w| 1.0 / (1e-3 + (w / 300.0 - 1.0).powi(2))), ForceGrowth::Peaked);
    }
}
