//! How well phase II knows the unbalance: from the noise that the record shows, and from the bearings and the drawing it takes as known.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Complex, DMatrix, DVector};

use crate::decomposition::pseudo_inverse;
use crate::error::Error;
use crate::machine::bearings::{BearingUnknown, Bearings};
use crate::machine::drawing::{Noise, Rotor};
use crate::machine::tolerance::Deviations;
use crate::measurement::Reading;
use crate::model::{Model, Response};
use crate::statistics::scatter::Predecessors;

type C = Complex<f64>;

/// What the estimate of least absolute residuals has more of variance than that of least squares, where the noise is normal
/// (Koenker and Bassett 1978).
const ABSOLUTE: f64 = FRAC_PI_2;
/// Step of a bearing's search coordinate, in standard deviations of its prior.
const STEP: f64 = 0.01;
/// Step of an error of the drawing, in its standard deviations.
const DRAWING_STEP: f64 = 0.1;

/// How far the model that phase II takes as known can be off.
#[derive(Debug, Clone)]
pub struct ModelUncertainty {
    /// Covariance of the bearings' search coordinates that go with this drawing.
    pub bearings: DMatrix<f64>,
    /// Change of these coordinates by one standard deviation of each error of the drawing, one error a column in the order of
    /// [`Deviations`]; no columns where the drawing is exact.
    pub shifts_by_drawing: DMatrix<f64>,
}

/// A reading, and the planes' unbalance that phase II found in it, kg·m.
pub struct SolvedReading<'a> {
    pub reading: &'a Reading,
    /// One phasor a plane, kg·m.
    pub unbalance_kg_m: DVector<C>,
}

impl SolvedReading<'_> {
    /// What the probes would show per unit of each plane's real and imaginary part, and what they show beyond the known
    /// forces, both in noise units; lost probes left out.
    fn system(&self, response: &Response, noise: &Noise) -> (DMatrix<f64>, DVector<f64>) {
        let shown = self.reading.probes.iter().enumerate().filter_map(|(p, y)| y.map(|y| (p, y)));
        let shown: Vec<(usize, C, f64)> = shown.map(|(p, y)| (p, y, noise.sigma_m(y))).collect();
        let planes = self.unbalance_kg_m.len();
        let columns = DMatrix::from_fn(2 * shown.len(), 2 * planes, |i, j| {
            let (p, _, sigma_m) = shown[i / 2];
            let h = response.per_unbalance[(p, j / 2)] * if j % 2 == 0 { C::from(1.0) } else { C::i() };
            [h.re, h.im][i % 2] / sigma_m
        });
        let target = DVector::from_fn(2 * shown.len(), |i, _| {
            let (p, y, sigma_m) = shown[i / 2];
            let left = y - response.fixed[p];
            [left.re, left.im][i % 2] / sigma_m
        });
        (columns, target)
    }

    fn response(&self, model: &Model) -> Result<Response, Error> {
        model.response_under(self.reading.speed_rad_s(), &self.unbalance_kg_m)
    }
}

/// Size of the noise over the stated one, as the least-squares residuals of readings show it that a model fits. With the
/// stated size as a prior: a few readings do not overrule it.
///
/// # Errors
/// If the model is singular at a reading's speed.
pub fn noise_scale(
    rotor: &Rotor,
    model: &Model,
    noise: &Noise,
    readings: &[SolvedReading],
) -> Result<f64, Error> {
    let (mut residuals, mut free) = (Vec::new(), 0.0);
    for found in readings {
        let (columns, target) = found.system(&found.response(model)?, noise);
        let Some(inverse) = pseudo_inverse(columns.clone(), 1e-12) else { continue };
        residuals.extend_from_slice((&target - &columns * (inverse * &target)).as_slice());
        free += columns.nrows().saturating_sub(columns.ncols()) as f64;
    }
    Ok(Predecessors::new(0..residuals.len() / 2)
        .most_probable(&residuals, free, Noise::log_sd(rotor))
        .0
        .scale)
}

/// Covariance of real and imaginary parts of the planes' unbalance in one reading, plane by plane, (kg·m)²; `scale` is the
/// size of the noise over the stated one, `model` how far bearings and drawing can be off, where it is known. An error of the drawing
/// acts twice: on this reading, and through the bearings that were found with it.
/// Where the reading has fewer numbers than the planes there is none.
///
/// # Errors
/// If the model is singular at the reading's speed.
pub fn unbalance_covariance(
    rotor: &Rotor,
    found: &SolvedReading,
    noise: &Noise,
    scale: f64,
    model: Option<&ModelUncertainty>,
) -> Result<Option<DMatrix<f64>>, Error> {
    let at = |rotor: &Rotor| -> Result<(DMatrix<f64>, DVector<f64>), Error> {
        Ok(found.system(&found.response(&Model::finite_elements(rotor))?, noise))
    };
    let (columns, _) = at(rotor)?;
    let Some(inverse) = columns.tr_mul(&columns).try_inverse().filter(|_| columns.nrows() >= columns.ncols())
    else {
        return Ok(None);
    };
    let mut covariance = &inverse * (ABSOLUTE * scale * scale);
    if let Some(model) = model {
        let flat: Vec<f64> = found.unbalance_kg_m.iter().flat_map(|u| [u.re, u.im]).collect();
        let flat = DVector::from_vec(flat);
        // the unbalance that is found in place of the true one, where the model is a step to either side of the machine
        let slope = |moved: &dyn Fn(f64) -> Rotor, step: f64| {
            let left = |by: f64| at(&moved(by)).map(|(columns, target)| target - columns * &flat);
            let slope = (left(step)? - left(-step)?) / (2.0 * step);
            Ok::<_, Error>(&inverse * columns.tr_mul(&slope))
        };
        let (laws, errors) = (Bearings::of(rotor), Deviations::of(rotor));
        let bearing = |(i, unknown): (usize, &BearingUnknown)| {
            let moved = |by: f64| {
                let (mut x, mut moved) = (laws.stated(), rotor.clone());
                x[i] += by;
                laws.assign(&mut moved, &x);
                moved
            };
            slope(&moved, STEP * unknown.law.prior_sd)
        };
        let by_bearings = joined(columns.ncols(), laws.unknowns().iter().enumerate().map(bearing))?;
        let error = |i: usize| {
            let moved = |by: f64| {
                let mut moved = rotor.clone();
                errors.build_into(
                    &mut moved,
                    &DVector::from_fn(errors.len(), |j, _| if j == i { by } else { 0.0 }),
                );
                moved
            };
            slope(&moved, DRAWING_STEP)
        };
        // the machine is off the drawing here, not the model off the machine
        let by_drawing = -joined(columns.ncols(), (0..model.shifts_by_drawing.ncols()).map(error))?;
        let by_drawing = by_drawing + &by_bearings * &model.shifts_by_drawing;
        covariance += &by_bearings * &model.bearings * by_bearings.transpose();
        covariance += &by_drawing * by_drawing.transpose();
    }
    Ok(Some(covariance))
}

/// A matrix of these columns, of which there may be none.
fn joined(
    rows: usize,
    columns: impl Iterator<Item = Result<DVector<f64>, Error>>,
) -> Result<DMatrix<f64>, Error> {
    let all: Vec<DVector<f64>> = columns.collect::<Result<_, Error>>()?;
    Ok(DMatrix::from_fn(rows, all.len(), |i, j| all[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::least_residual;
    use crate::machine::drawing::Tolerance;
    use crate::testing::sample_rotor;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    const NOISE: Noise =
        Noise { relative: 0.0, floor_um: 0.1, scale: None, correlation: None, between_runs: None };

    fn truth() -> DVector<C> {
        DVector::from_vec(vec![C::new(3e-4, -1e-4), C::new(-2e-4, 2.5e-4)])
    }

    fn reading(rotor: &Rotor, noise_m: f64, random: &mut StdRng) -> Reading {
        let mut reading = Reading { speed_rpm: 8000.0, ..Reading::default() };
        let shown = Model::finite_elements(rotor).response(reading.speed_rad_s()).unwrap().at(&truth());
        let mut part = || noise_m * random.sample::<f64, _>(StandardNormal);
        reading.probes = shown.iter().map(|y| Some(y + C::new(part(), part()))).collect();
        reading
    }

    #[test]
    fn regions_cover_95_percent_and_doubled_noise_is_detected() {
        let rotor = sample_rotor();
        let model = Model::finite_elements(&rotor);
        let mut random = StdRng::seed_from_u64(5);
        let readings: Vec<Reading> =
            (0..300).map(|_| reading(&rotor, 2.0 * NOISE.floor_um * 1e-6, &mut random)).collect();
        let response = model.response(readings[0].speed_rad_s()).unwrap();
        let found: Vec<SolvedReading> = readings
            .iter()
            .map(|reading| {
                let shown = DVector::from_iterator(4, reading.probes.iter().flatten().copied());
                let best = least_residual(&response, &shown, &[f64::INFINITY; 2]).unwrap();
                SolvedReading { reading, unbalance_kg_m: best.unbalance_kg_m }
            })
            .collect();
        let scale = noise_scale(&rotor, &model, &NOISE, &found).unwrap();
        assert!((scale / 2.0 - 1.0).abs() < 0.1, "{scale}");
        let covariance = unbalance_covariance(&rotor, &found[0], &NOISE, scale, None).unwrap().unwrap();
        let inverse = covariance.try_inverse().unwrap();
        // χ² with four degrees of freedom stays below 9.49 with 95 %
        let inside = found.iter().filter(|f| {
            let off = &f.unbalance_kg_m - truth();
            let off = DVector::from_vec(off.iter().flat_map(|u| [u.re, u.im]).collect());
            off.dot(&(&inverse * &off)) < 9.488
        });
        let share = inside.count() as f64 / 300.0;
        // three standard deviations of a share of 300, and what the asymptotic factor leaves open with four spare numbers
        assert!((0.90..=0.99).contains(&share), "{share}");
    }

    #[test]
    fn bearing_error_covariance_equals_direct_estimate_error() {
        let rotor = sample_rotor();
        let laws = Bearings::of(&rotor);
        let mut random = StdRng::seed_from_u64(1);
        let mut wrong = rotor.clone();
        let (mut x, off) = (laws.stated(), 1e-3);
        x[2] += off;
        laws.assign(&mut wrong, &x);
        let reading = reading(&rotor, 0.0, &mut random);
        let shown = DVector::from_iterator(4, reading.probes.iter().flatten().copied());
        let response = Model::finite_elements(&wrong).response(reading.speed_rad_s()).unwrap();
        let estimate =
            pseudo_inverse(response.per_unbalance.clone(), 1e-12).unwrap() * (shown - &response.fixed);
        let error = estimate - truth();
        let error = DVector::from_vec(error.iter().flat_map(|u| [u.re, u.im]).collect());
        let mut of_bearings = DMatrix::zeros(laws.count(), laws.count());
        of_bearings[(2, 2)] = off * off;
        let found = SolvedReading { reading: &reading, unbalance_kg_m: truth() };
        let model = ModelUncertainty {
            shifts_by_drawing: DMatrix::zeros(of_bearings.nrows(), 0),
            bearings: of_bearings,
        };
        let covariance = unbalance_covariance(&rotor, &found, &NOISE, 0.0, Some(&model)).unwrap().unwrap();
        let expected = &error * error.transpose();
        assert!((&covariance - &expected).norm() < 0.02 * expected.norm(), "{covariance} {expected}");
    }

    #[test]
    fn drawing_error_covariance_equals_direct_estimate_error() {
        let modulus = Tolerance { modulus_relative: 1e-3, ..Tolerance::default() };
        let drawn = Rotor { tolerance: Some(modulus), ..sample_rotor() };
        let (errors, laws) = (Deviations::of(&drawn), Bearings::of(&drawn));
        let mut built = drawn.clone();
        errors.build_into(&mut built, &DVector::from_element(1, 1.0));
        // a bearing that was found too stiff by half a percent, as the modulus is off
        let mut shifts_by_drawing = DMatrix::zeros(laws.count(), 1);
        shifts_by_drawing[(2, 0)] = 5e-3;
        let (mut found_with, mut x) = (drawn.clone(), laws.stated());
        x[2] += 5e-3;
        laws.assign(&mut found_with, &x);
        let reading = reading(&built, 0.0, &mut StdRng::seed_from_u64(1));
        let shown = DVector::from_iterator(4, reading.probes.iter().flatten().copied());
        let response = Model::finite_elements(&found_with).response(reading.speed_rad_s()).unwrap();
        let estimate =
            pseudo_inverse(response.per_unbalance.clone(), 1e-12).unwrap() * (shown - &response.fixed);
        let error = &estimate - truth();
        let error = DVector::from_vec(error.iter().flat_map(|u| [u.re, u.im]).collect());
        let found = SolvedReading { reading: &reading, unbalance_kg_m: estimate };
        let bearings = DMatrix::zeros(laws.count(), laws.count());
        let model = ModelUncertainty { bearings, shifts_by_drawing };
        let covariance =
            unbalance_covariance(&found_with, &found, &NOISE, 0.0, Some(&model)).unwrap().unwrap();
        let expected = &error * error.transpose();
        assert!((&covariance - &expected).norm() < 0.02 * expected.norm(), "{covariance} {expected}");
    }
}
