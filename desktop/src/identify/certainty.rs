//! How well phase II knows the unbalance: from the noise that the record shows, and from the bearings it takes as known.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Complex, DMatrix, DVector};

use crate::decomposition::pseudo_inverse;
use crate::error::Error;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;
use crate::model::{Model, Response};
use crate::statistics::scatter::Predecessors;

type C = Complex<f64>;

/// What the estimate of least absolute residuals has more of variance than that of least squares, where the noise is normal
/// (Koenker and Bassett 1978).
const ABSOLUTE: f64 = FRAC_PI_2;
/// Step of a bearing's search coordinate, in standard deviations of its prior.
const STEP: f64 = 0.01;

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
/// size of the noise over the stated one, `bearings` the covariance of the bearings' search coordinates where it is known.
/// Where the reading has fewer numbers than the planes there is none.
///
/// # Errors
/// If the model is singular at the reading's speed.
pub fn unbalance_covariance(
    rotor: &Rotor,
    found: &SolvedReading,
    noise: &Noise,
    scale: f64,
    bearings: Option<&DMatrix<f64>>,
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
    if let Some(of_bearings) = bearings {
        let laws = Bearings::of(rotor);
        let flat: Vec<f64> = found.unbalance_kg_m.iter().flat_map(|u| [u.re, u.im]).collect();
        let flat = DVector::from_vec(flat);
        let mut slopes = DMatrix::zeros(columns.ncols(), laws.count());
        for (i, unknown) in laws.unknowns().iter().enumerate() {
            let step = STEP * unknown.law.prior_sd;
            let moved = |by: f64| {
                let mut x = laws.stated();
                x[i] += by;
                let mut rotor = rotor.clone();
                laws.assign(&mut rotor, &x);
                let (columns, target) = at(&rotor)?;
                // what is left of the reading for the planes, less what they explain of it
                Ok::<_, Error>(target - columns * &flat)
            };
            let slope = (moved(step)? - moved(-step)?) / (2.0 * step);
            slopes.set_column(i, &(&inverse * columns.tr_mul(&slope)));
        }
        covariance += &slopes * of_bearings * slopes.transpose();
    }
    Ok(Some(covariance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::least_residual;
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
        let covariance =
            unbalance_covariance(&rotor, &found, &NOISE, 0.0, Some(&of_bearings)).unwrap().unwrap();
        let expected = &error * error.transpose();
        assert!((&covariance - &expected).norm() < 0.02 * expected.norm(), "{covariance} {expected}");
    }
}
