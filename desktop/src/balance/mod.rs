//! Correction weights: from the identified model, and from the influence coefficients of trial runs alone.
//!
//! | module | holds |
//! |---|---|
//! | [`model`] | weights that make the model's vibration least |
//! | [`influence`] | the same from trial runs, without a model of the machine |
//! | [`weights`] | what can really be screwed in: radii and steps of mass |
//! | [`grade`] | balance quality grade of ISO 21940-11 |
//!
//! All weights are for the machine without any trial weight. Angles are those of the unbalance they
//! make: from the keyphasor mark, in the direction of rotation.

pub mod grade;
pub mod influence;
pub mod model;
#[cfg(test)]
mod tests;
pub mod weights;

use nalgebra::{Complex, DMatrix, DVector};

use crate::error::Error;
use crate::rotor::Rotor;

use grade::Grade;
use weights::{Allowed, Weight};

type C = Complex<f64>;

/// What is to be balanced, and with what.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Numbers of the correction planes among the rotor's.
    pub planes: Vec<usize>,
    /// What fits into each of them.
    pub allowed: Vec<Allowed>,
    /// Speeds at which vibration counts, rpm.
    pub range_rpm: [f64; 2],
    /// Speed at which the grade is stated, rpm.
    pub service_rpm: f64,
}

/// The machine at one speed, with and without the weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtSpeed {
    /// The speed, rpm.
    pub speed_rpm: f64,
    /// Root mean square over the probes of the amplitude, zero to peak, m.
    pub before_m: f64,
    /// The same with the weights, m.
    pub after_m: f64,
    /// How far off that may be: standard deviation of the motion left, root mean square over probes, m.
    pub after_sd_m: f64,
}

/// Weights and what they do.
#[derive(Debug, Clone)]
pub struct Balanced {
    /// The unbalance to add in each plane, kg·m.
    pub wanted_kg_m: Vec<C>,
    /// Standard deviation of its components, kg·m.
    pub sd_kg_m: Vec<f64>,
    /// What comes nearest with the allowed radii and steps.
    pub weights: Vec<Weight>,
    /// Vibration before and after, by speed.
    pub vibration: Vec<AtSpeed>,
    /// Quality grade before and after.
    pub grade: Grade,
    /// χ² per real number of what the weights come from: the model's fit, or trial runs that exceed what the
    /// coefficients need; `None` where nothing is left to judge by.
    pub chi2_per_value: Option<f64>,
}

impl Balanced {
    /// Root mean square over speeds of a quantity, m.
    fn over_speeds(&self, of: impl Fn(&AtSpeed) -> f64) -> f64 {
        (self.vibration.iter().map(|v| of(v).powi(2)).sum::<f64>() / self.vibration.len().max(1) as f64)
            .sqrt()
    }

    /// Vibration before, after, and the standard deviation of the latter, over speeds and probes, m.
    pub fn overall_m(&self) -> [f64; 3] {
        [
            self.over_speeds(|v| v.before_m),
            self.over_speeds(|v| v.after_m),
            self.over_speeds(|v| v.after_sd_m),
        ]
    }

    /// Share of the vibration that the weights take away.
    pub fn reduction(&self) -> f64 {
        let [before, after, _] = self.overall_m();
        1.0 - after / before.max(f64::MIN_POSITIVE)
    }
}

impl Plan {
    /// Positions of the correction planes, m.
    fn positions_m(&self, rotor: &Rotor) -> Vec<f64> {
        self.planes.iter().map(|p| rotor.plane[*p].position_m).collect()
    }

    /// The weights that come nearest to these unbalances.
    fn weights(&self, wanted_kg_m: &[C]) -> Vec<Weight> {
        wanted_kg_m.iter().zip(&self.allowed).map(|(u, allowed)| allowed.nearest(*u)).collect()
    }

    /// The planes of these names, in the order of the file; all if there are none.
    ///
    /// # Errors
    /// One sentence if there is no such plane.
    pub fn planes_named(rotor: &Rotor, names: &[String]) -> Result<Vec<usize>, Error> {
        let known: Vec<String> = rotor.plane.iter().map(|p| format!("\"{}\"", p.name)).collect();
        if let Some(unknown) = names.iter().find(|n| !rotor.plane.iter().any(|p| p.name == **n)) {
            return Err(Error::Unsuitable(format!(
                "there is no plane \"{unknown}\", expected one of {}",
                known.join(", ")
            )));
        }
        let wanted = |p: &usize| names.is_empty() || names.contains(&rotor.plane[*p].name);
        Ok((0..rotor.plane.len()).filter(wanted).collect())
    }
}

/// The weights that make `Σ |before + per_weight · w|²` least, and the inverse of the normal matrix.
fn least_vibration(per_weight: &DMatrix<C>, before: &DVector<C>) -> Result<(DVector<C>, DMatrix<C>), Error> {
    let normal = per_weight.adjoint() * per_weight;
    let size = normal.diagonal().map(|d| d.re.sqrt());
    let scaled =
        DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| normal[(i, j)] / (size[i] * size[j]));
    let condition = scaled.clone().svd(false, false).singular_values;
    if condition.iter().any(|s| !s.is_finite() || *s < ALIKE) {
        return Err(Error::Unsuitable(
            "the correction planes act alike on every probe at these speeds; choose fewer planes, or more speeds".into(),
        ));
    }
    let inverse = normal.try_inverse().ok_or_else(|| Error::Unsuitable("no plane moves any probe".into()))?;
    let weights = -(&inverse * per_weight.adjoint() * before);
    Ok((weights, inverse))
}

/// Planes whose effects differ by less than this, relative, cannot share a correction.
const ALIKE: f64 = 1e-6;

/// Root mean square of amplitudes.
fn rms(sum_of_squares: f64, count: usize) -> f64 {
    (sum_of_squares / count.max(1) as f64).sqrt()
}
