//! Correction weights of a machine that has no file: trial runs and their weights, or earlier coefficients and one run.
//!
//! | module | holds |
//! |---|---|
//! | [`sets`] | trial weights in fixed proportions over planes, as in modal balancing |
//! | [`stated`], [`weight_unit`] | the trial weights and their unit |
//! | [`runs`] | trial runs as equations, and the noise from their repeats |
//! | [`amplitudes`] | runs whose phase was not measured |
//! | [`library`] | influence coefficients as they are kept for a machine |
//! | [`doubts`] | reasons not to rely on the weights |
//!
//! Weights are in g·mm, angles from the keyphasor mark with the rotation; vibration is in the unit of the data, zero to peak.

pub mod amplitudes;
#[cfg(test)]
mod contradicting_runs;
pub mod doubts;
pub mod library;
pub mod runs;
pub mod sets;
pub mod stated;
#[cfg(test)]
mod tests;
pub mod weight_unit;

use nalgebra::Complex;

use super::choice::candidates;
use super::influence::{InfluenceCoefficients, normal_equations, stacked};
use super::places::Filling;
use super::scatter::of_coefficients;
use super::wanted::{Wanted, no_plane};
use crate::error::Error;
use crate::statistics::interval::size_and_angle_95;
use crate::unbalance::region::{KNOWN_NOISE, component_95, vector_95};
use sets::WeightSets;
use weight_unit::WeightUnit;

type C = Complex<f64>;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct CorrectionRequest {
    /// Planes to put weights into, by name; all if none are named.
    pub planes: Vec<String>,
    /// Criterion and limits of the weights.
    pub wanted: Wanted,
    /// Speeds at which vibration counts, rpm; all if not stated.
    pub range_rpm: Option<[f64; 2]>,
    /// Speeds that differ by no more than this, relative, are one.
    pub same_speed: f64,
    /// Whether runs at unlike speeds are interpolated.
    pub interpolate: bool,
    /// Standard deviation of a reading's components, if it is stated: relative to its size, and in its unit.
    pub noise: Option<[f64; 2]>,
    /// Run that the weights are to be added to, as it is; none for the machine without any weight.
    pub onto: Option<String>,
}

impl CorrectionRequest {
    /// Masses have no radius, so nothing can be stated of them in g·mm or at radii.
    fn check_unit(&self, unit: WeightUnit) -> Result<(), Error> {
        let option = match &self.wanted {
            wanted if !wanted.allowed.radii_mm.is_empty() => "--radii-mm",
            wanted if !wanted.limits.is_empty() => "--largest-g-mm",
            _ => return Ok(()),
        };
        match unit.is_mass() {
            true => Err(Error::Unsuitable(format!(
                "the trial weights are masses in {} without a radius, expected unbalances such as magnitude_g_mm with {option}",
                unit.symbol
            ))),
            false => Ok(()),
        }
    }

    /// Numbers of the planes to use among those that are known.
    fn planes_of(&self, known: &[String]) -> Result<Vec<usize>, Error> {
        if let Some(unknown) = self.planes.iter().find(|name| !known.contains(name)) {
            return Err(no_plane(unknown, known));
        }
        self.wanted.check(known)?;
        let wanted = |j: &usize| self.planes.is_empty() || self.planes.contains(&known[*j]);
        Ok((0..known.len()).filter(wanted).collect())
    }
}

/// How the noise is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Basis {
    Stated,
    /// From the residuals of the runs, with so many degrees of freedom.
    Runs(usize),
    /// From repeated readings of one run at one speed, with so many degrees of freedom; scatter between runs is not in it.
    Readings(usize),
    Unknown,
}

impl Basis {
    /// Real values that the noise scale is estimated from; `None` where it is not estimated.
    fn values(self) -> Option<usize> {
        match self {
            Self::Runs(values) | Self::Readings(values) => Some(values),
            Self::Stated | Self::Unknown => None,
        }
    }

    /// Degrees of freedom of the noise scale.
    fn freedom(self) -> f64 {
        self.values().map_or(KNOWN_NOISE, |values| values as f64)
    }
}

/// A machine as its influence coefficients describe it.
#[derive(Debug, Clone)]
pub struct MachineInfluence {
    /// By speed and probe, of the planes in use.
    pub coefficients: Vec<InfluenceCoefficients>,
    pub probes: Vec<String>,
    /// Names of the planes in use.
    pub planes: Vec<String>,
    /// Sets of weights over the planes, if the coefficients are theirs and not the planes'.
    pub sets: Option<WeightSets>,
    /// Unit of the vibration, as the columns have it.
    pub unit: String,
    /// Unit in which weights are stated; where it is one of mass, numbers in g·mm here are in it.
    pub weight_unit: WeightUnit,
    /// How the noise is known; the covariances are zero if it is not.
    pub basis: Basis,
    /// What the runs miss each other by, relative to the vibration.
    pub scatter: f64,
    /// Doubts raised while they were fitted.
    pub doubts: Vec<String>,
}

impl MachineInfluence {
    /// What hides the effect of trial weights: noise, or runs that contradict each other.
    fn blamed(&self, why: Error) -> Error {
        match why {
            Error::EffectBelowNoise { .. } | Error::DifferenceBelowNoise { .. }
                if self.scatter > doubts::CONTRADICT =>
            {
                Error::ContradictingRuns { percent: 100.0 * self.scatter }
            }
            other => other,
        }
    }
}

/// The weight of one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneWeight {
    pub plane: String,
    /// Optimal unbalance, before it is split into pieces, g·mm.
    pub wanted_g_mm: C,
    /// Interval of its magnitude with 95 %, g·mm, and half that of its angle, degrees, 180 for any angle; `None` if the noise is
    /// not known.
    pub interval_95: Option<([f64; 2], f64)>,
    pub filling: Filling,
}

/// One probe at one speed, with and without the weights that are put there.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeVibration {
    pub probe: String,
    pub speed_rpm: f64,
    /// Amplitude without the weights, zero to peak, in the unit of the data.
    pub before: f64,
    pub after: f64,
    /// With them with 95 %; `None` if the noise is not known.
    pub after_at_most: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    pub weights: Vec<PlaneWeight>,
    pub left: Vec<ProbeVibration>,
    /// Unit of the vibration, as the columns have it.
    pub unit: String,
    /// Unit in which weights are stated; where it is one of mass, numbers in g·mm here are in it.
    pub weight_unit: WeightUnit,
    /// How the noise is known.
    pub basis: Basis,
    /// Reasons not to rely on it, one sentence each.
    pub doubts: Vec<String>,
}

/// The best weights of a machine.
///
/// # Errors
/// One sentence if planes act alike, or noise hides what they do.
pub fn correct(machine: &MachineInfluence, request: &CorrectionRequest) -> Result<Correction, Error> {
    let all = &machine.coefficients;
    request.check_unit(machine.weight_unit)?;
    let limits: Vec<f64> = machine.planes.iter().map(|p| request.wanted.limit_g_mm(p)).collect();
    let sets = machine.sets.as_ref();
    let names = sets.map_or_else(|| machine.planes.clone(), WeightSets::names);
    let unknown_limits = sets.map_or_else(|| limits.clone(), |sets| sets.limits(&limits));
    let of_planes = |w: &[C]| sets.map_or_else(|| w.to_vec(), |sets| sets.of_planes(w));
    let to_planes = |w: &[C]| sets.map_or_else(|| w.to_vec(), |sets| sets.to_planes(w));
    let (per_weight, before) = stacked(all);
    let equations = normal_equations(all);
    let inverse = equations.inverse(&names).map_err(|why| machine.blamed(why))?;
    let criterion = request.wanted.criterion;
    let found = candidates(criterion, &equations, (&per_weight, &before), &unknown_limits)?;
    let cost = |weights: &[C]| criterion.cost(&per_weight, &before, &of_planes(weights));
    let in_planes: Vec<Vec<C>> = found.iter().map(|w| to_planes(w)).collect();
    let choice = request.wanted.chosen(&machine.planes, &in_planes, cost);
    let (wanted, placed) = (&choice.wanted_g_mm, of_planes(&choice.sums_g_mm()));
    let sd = match machine.basis {
        Basis::Unknown => None,
        _ => {
            let best = of_planes(wanted);
            let sd = of_coefficients(all, criterion, &unknown_limits, &inverse, &best)?;
            Some(sets.map_or_else(|| sd.clone(), |sets| sets.sd_of_planes(&sd)))
        }
    };
    let left: Vec<ProbeVibration> = all
        .iter()
        .map(|c| {
            let after = c.under(&placed).norm();
            let bound = c.variance(&placed).sqrt() * vector_95(machine.basis.freedom());
            ProbeVibration {
                probe: machine.probes[c.probe].clone(),
                speed_rpm: c.speed_rpm,
                before: c.before.norm(),
                after,
                after_at_most: (machine.basis != Basis::Unknown).then_some(after + bound),
            }
        })
        .collect();
    let quantile = component_95(machine.basis.freedom());
    let interval = |w: C, sd: f64| size_and_angle_95(w.norm(), quantile * sd);
    let weights: Vec<PlaneWeight> = (0..machine.planes.len())
        .map(|j| PlaneWeight {
            plane: machine.planes[j].clone(),
            wanted_g_mm: wanted[j],
            interval_95: sd.as_ref().map(|sd| interval(wanted[j], sd[j])),
            filling: choice.fillings[j].clone(),
        })
        .collect();
    let mut doubts = machine.doubts.clone();
    doubts.extend(doubts::alike(&equations, &names));
    doubts.extend(doubts::at_limit(&weights, &limits));
    doubts.extend(choice.doubt());
    doubts.extend(doubts::unproven(all, &placed));
    doubts.extend(doubts::worse(&left, &machine.unit));
    Ok(Correction {
        weights,
        left,
        unit: machine.unit.clone(),
        weight_unit: machine.weight_unit,
        basis: machine.basis,
        doubts,
    })
}
