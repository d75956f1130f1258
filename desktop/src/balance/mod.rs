//! Correction weights: from the identified model, and from the influence coefficients of trial runs alone.
//!
//! | module | holds |
//! |---|---|
//! | [`model`] | weights that make the model's vibration least |
//! | [`influence`] | influence coefficients of trial runs, without a model of the machine |
//! | [`trial_runs`] | weights from them, for a rotor's file |
//! | [`speeds`], `interpolated`, [`sense`] | which readings are of one speed; runs at unlike speeds; whether phases have the right sign |
//! | [`optimum`] | least squares, least largest vibration, and limits |
//! | `choice` | which weights are put in: none that is worse than none |
//! | [`alone`] | weights of a machine that has no file |
//! | [`estimate`](mod@estimate) | the unbalance of single runs from others with stated weights |
//! | [`places`] | fixed holes or blades |
//! | [`wanted`], `scatter` | criterion and limits of the weights; their standard deviations |
//! | [`weights`] | available weights: radii and steps of mass |
//!
//! All weights are for the machine without any trial weight. Angles are those of the unbalance they
//! make: from the keyphasor mark, in the direction of rotation.

pub mod alone;
mod choice;
pub mod estimate;
pub mod influence;
mod interpolated;
pub mod model;
pub mod optimum;
pub mod places;
mod scatter;
pub mod sense;
pub mod speeds;
#[cfg(test)]
mod tests;
pub mod trial_runs;
pub mod wanted;
pub mod weights;

use nalgebra::{Complex, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::decomposition::hermitian;
use crate::error::Error;
use crate::grade::Grade;
use crate::machine::drawing::Rotor;
use crate::unbalance::G_MM;

use choice::Choice;
use places::Filling;
use wanted::{Wanted, no_plane};

type C = Complex<f64>;

/// Correction planes, criterion and speeds of a balancing job.
#[derive(Debug, Clone, PartialEq)]
pub struct BalancePlan {
    /// Numbers of the correction planes among the rotor's.
    pub planes: Vec<usize>,
    /// Criterion and limits of the weights.
    pub wanted: Wanted,
    /// Speeds at which vibration counts, rpm.
    pub range_rpm: [f64; 2],
    /// Speed at which the grade is stated, rpm.
    pub service_rpm: f64,
    /// Speeds of runs that differ by no more than this, relative, are one.
    pub same_speed: f64,
    /// Whether trial runs at unlike speeds are interpolated.
    pub interpolate: bool,
}

/// The machine at one speed, with and without the weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedVibration {
    pub speed_rpm: f64,
    /// Root mean square over the probes of the amplitude, zero to peak, m.
    pub before_m: f64,
    /// The same with the weights, m.
    pub after_m: f64,
    /// How far off that may be: standard deviation of the motion left, root mean square over probes, m.
    pub after_sd_m: f64,
}

/// Correction weights and the vibration with them.
#[derive(Debug, Clone)]
pub struct Balanced {
    /// The unbalance to add in each plane, kg·m.
    pub wanted_kg_m: Vec<C>,
    /// Standard deviation of its components, kg·m.
    pub sd_kg_m: Vec<f64>,
    pub placed: Vec<Filling>,
    /// Vibration before and after, by speed.
    pub vibration: Vec<SpeedVibration>,
    /// The same over all speeds.
    pub overall: Overall,
    /// Quality grade before and after.
    pub grade: Grade,
    /// Misfit of the model, or of the trial runs beyond the unknowns of their coefficients;
    /// `None` where no degrees of freedom are left.
    pub misfit: Option<ReducedChiSquare>,
    /// Changes made to the readings, one sentence each.
    pub remarks: Vec<String>,
}

/// χ² with its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReducedChiSquare {
    /// χ² per degree of freedom: one if all of it is noise.
    pub chi2_per_value: f64,
    /// Degrees of freedom.
    pub freedom: usize,
}

impl ReducedChiSquare {
    /// Chance of at least so much from noise alone.
    pub fn chance(&self) -> f64 {
        let freedom = self.freedom as f64;
        ChiSquared::new(freedom).map_or(1.0, |c| c.sf(self.chi2_per_value * freedom))
    }
}

/// Vibration over all speeds and probes, root mean square of amplitudes, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overall {
    pub before_m: f64,
    pub after_m: f64,
    /// How far off that may be: standard deviation of the motion left.
    pub after_sd_m: f64,
}

impl Overall {
    /// Share of the vibration that the weights take away.
    pub fn reduction(&self) -> f64 {
        1.0 - self.after_m / self.before_m.max(f64::MIN_POSITIVE)
    }
}

/// Sums of squared amplitudes: before, after, and the variance of the residual.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    m2: [f64; 3],
    count: usize,
}

impl Squares {
    fn add(&mut self, m2: [f64; 3], count: usize) {
        (0..3).for_each(|i| self.m2[i] += m2[i]);
        self.count += count;
    }

    /// Root mean squares; sums that are negative after the noise is subtracted count as zero.
    fn rms_m(&self) -> [f64; 3] {
        self.m2.map(|sum| (sum.max(0.0) / self.count.max(1) as f64).sqrt())
    }

    fn at_speed(&self, speed_rpm: f64) -> SpeedVibration {
        let [before_m, after_m, after_sd_m] = self.rms_m();
        SpeedVibration { speed_rpm, before_m, after_m, after_sd_m }
    }

    fn overall(&self) -> Overall {
        let [before_m, after_m, after_sd_m] = self.rms_m();
        Overall { before_m, after_m, after_sd_m }
    }
}

impl BalancePlan {
    /// Positions of the correction planes, m.
    fn positions_m(&self, rotor: &Rotor) -> Vec<f64> {
        self.planes.iter().map(|p| rotor.plane[*p].position_m).collect()
    }

    /// Names of the correction planes.
    fn names<'a>(&self, rotor: &'a Rotor) -> Vec<&'a str> {
        self.planes.iter().map(|p| rotor.plane[*p].name.as_str()).collect()
    }

    /// Largest unbalance of each plane, kg·m.
    fn limits_kg_m(&self, names: &[&str]) -> Vec<f64> {
        names.iter().map(|name| self.wanted.limit_g_mm(name) / G_MM).collect()
    }

    /// What is put into the planes, of the weights to choose from, kg·m, preferred first; the vibration is
    /// `before + per_weight · unbalance`.
    fn chosen(
        &self,
        names: &[&str],
        candidates_kg_m: &[Vec<C>],
        per_weight: &DMatrix<C>,
        before: &DVector<C>,
    ) -> Choice {
        let all: Vec<Vec<C>> =
            candidates_kg_m.iter().map(|all| all.iter().map(|u| u * G_MM).collect()).collect();
        let cost = |g_mm: &[C]| {
            let kg_m: Vec<C> = g_mm.iter().map(|u| u / G_MM).collect();
            self.wanted.criterion.cost(per_weight, before, &kg_m)
        };
        self.wanted.chosen(names, &all, cost)
    }

    /// The planes of these names, in the order of the file; all if there are none.
    ///
    /// # Errors
    /// One sentence if there is no such plane.
    pub fn planes_named(rotor: &Rotor, names: &[String]) -> Result<Vec<usize>, Error> {
        let known: Vec<String> = rotor.plane.iter().map(|p| p.name.clone()).collect();
        if let Some(unknown) = names.iter().find(|name| !known.contains(name)) {
            return Err(no_plane(unknown, &known));
        }
        let wanted = |p: &usize| names.is_empty() || names.contains(&rotor.plane[*p].name);
        Ok((0..rotor.plane.len()).filter(wanted).collect())
    }
}

/// Normal equations of the weights that make `Σ |before + per_weight · w|²` least.
struct NormalEquations {
    matrix: DMatrix<C>,
    right: DVector<C>,
    /// The contribution of noise that was subtracted from the matrix.
    noise: DMatrix<C>,
}

impl NormalEquations {
    fn of(per_weight: &DMatrix<C>, before: &DVector<C>) -> Self {
        let planes = per_weight.ncols();
        Self {
            matrix: per_weight.adjoint() * per_weight,
            right: per_weight.adjoint() * before,
            noise: DMatrix::zeros(planes, planes),
        }
    }

    /// Subtracts the contribution of noise.
    fn less(mut self, matrix: DMatrix<C>, right: &DVector<C>) -> Self {
        self.matrix -= &matrix;
        self.right -= right;
        self.noise += matrix;
        self
    }

    /// The inverse of the matrix; `planes` are their names.
    ///
    /// # Errors
    /// If a plane moves no probe, planes act alike, or noise hides their effect.
    fn inverse(&self, planes: &[impl AsRef<str>]) -> Result<DMatrix<C>, Error> {
        let name = |j: usize| planes[j].as_ref().to_string();
        let shown = &self.matrix + &self.noise;
        let size = shown.diagonal().map(|d| d.re.max(0.0).sqrt());
        if let Some(j) = (0..size.len()).find(|j| size[*j].is_nan() || size[*j] <= 0.0) {
            return Err(Error::PlaneWithoutEffect { plane: name(j) });
        }
        let scaled = |m: &DMatrix<C>| m.map_with_location(|i, j, n| n / (size[i] * size[j]));
        if hermitian(scaled(&shown)).eigenvalues.min() < ALIKE {
            return Err(Error::PlanesActAlike);
        }
        let without_noise = hermitian(scaled(&self.matrix));
        if without_noise.eigenvalues.min() < ALIKE {
            let hidden = (0..size.len()).find(|j| self.matrix[(*j, *j)].re < 0.5 * shown[(*j, *j)].re);
            if let Some(j) = hidden {
                return Err(Error::EffectBelowNoise { plane: name(j) });
            }
            let least = without_noise.eigenvectors.column(without_noise.eigenvalues.imin());
            let planes = (0..size.len()).filter(|j| least[*j].norm() > 0.3).map(name).collect();
            return Err(Error::DifferenceBelowNoise { planes });
        }
        self.matrix.clone().try_inverse().ok_or_else(|| {
            Error::Unsuitable(
                "weights in the correction planes change no probe's reading; choose other planes".into(),
            )
        })
    }
}

/// Planes whose effects differ by less than this, relative, cannot share a correction.
const ALIKE: f64 = 1e-6;
