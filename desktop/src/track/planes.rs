//! Check that one reading determines the unbalance of every plane.

use nalgebra::{Complex, DMatrix, DVector};

use super::daily::Tracking;
use super::record::Day;
use crate::decomposition::singular_values;
use crate::error::{Error, TrackError};
use crate::statistics::interval::HALF_95;
use crate::unbalance::G_MM;

type C = Complex<f64>;

/// Largest noise relative to the least unbalance that explains a reading. Above it, one day determines the unbalance
/// to no better than a half.
const MOST_NOISE: f64 = 0.5;

impl Tracking<'_> {
    /// Checks that a reading can tell the planes apart: the noise must be equivalent to much less unbalance than
    /// explains the reading.
    ///
    /// # Errors
    /// If it is not, with both values.
    pub(super) fn check_planes(&self) -> Result<(), Error> {
        let least = |day| {
            let told = PlanesTold::new(day, &self.logs, self.rotor.plane.len())?;
            Some((told.noise_kg_m / told.explains_kg_m, told))
        };
        let best = self.complete().filter_map(least).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, told)) = best.filter(|(ratio, _)| *ratio > MOST_NOISE) else { return Ok(()) };
        let planes = self.rotor.plane.iter().map(|p| p.name.clone()).collect();
        let [noise_g_mm, explains_g_mm] = [told.noise_kg_m, told.explains_kg_m].map(|u| u * G_MM);
        Err(match noise_g_mm.is_finite() {
            true => TrackError::PlanesInNoise { planes, noise_g_mm, explains_g_mm }.into(),
            false => TrackError::MorePlanesThanProbes { planes, probes: self.rotor.probe.len() }.into(),
        })
    }
}

/// Resolution of the unbalance of all planes by one reading, on given bearings.
struct PlanesTold {
    /// Unbalance equivalent to the noise (95 %) in the worst-determined direction; infinite if there are more planes
    /// than probes.
    noise_kg_m: f64,
    /// Least unbalance that can explain the reading.
    explains_kg_m: f64,
}

impl PlanesTold {
    fn new(day: &Day, logs: &[f64], planes: usize) -> Option<Self> {
        let response = day.point.on(logs)?.influence();
        let weigh = |p: usize| C::from(day.sigma_m[p].recip());
        let slope = &response.per_unbalance;
        let weighed = DMatrix::from_fn(slope.nrows(), planes, |p, j| slope[(p, j)] * weigh(p));
        let left = DVector::from_vec(day.all_m()) - &response.fixed;
        let read = DVector::from_fn(left.len(), |p, _| left[p] * weigh(p)).norm();
        let told = singular_values(weighed);
        let least = if slope.nrows() < planes { 0.0 } else { told.min() };
        Some(Self { noise_kg_m: HALF_95 / least, explains_kg_m: read / told.max() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::{Noise, Plane};
    use crate::measurement::Reading;
    use crate::model::Model;
    use crate::testing::sample_rotor;
    use crate::track::coefficients::logs_of;
    use crate::track::record::days;

    /// What a reading of the sample with further planes tells.
    fn told(further_m: &[f64]) -> PlanesTold {
        let mut rotor = sample_rotor();
        for z in further_m {
            let name = format!("at {z}");
            rotor.plane.push(Plane { name, position_m: *z, ..rotor.plane[0].clone() });
        }
        let planes = rotor.plane.len();
        let unbalance = DVector::from_fn(planes, |j, _| C::from(if j < 2 { 4e-4 } else { 0.0 }));
        let shown = Model::finite_elements(&rotor).response(1100.0).unwrap().at(&unbalance);
        let reading = Reading {
            speed_rpm: 1100.0 * 30.0 / std::f64::consts::PI,
            probes: shown.iter().copied().map(Some).collect(),
            ..Reading::default()
        };
        let noise = Noise { relative: 0.02, floor_um: 0.03, ..Noise::default() };
        let day = days(&rotor, &noise, &[reading]).unwrap().remove(0);
        PlanesTold::new(&day, &logs_of(&rotor), planes).unwrap()
    }

    #[test]
    fn separate_planes_are_told_apart_and_coincident_ones_are_not() {
        let two = told(&[]);
        assert!(two.noise_kg_m < 0.3 * two.explains_kg_m, "{} {}", two.noise_kg_m, two.explains_kg_m);
        // no unbalance smaller than what was there by more than both planes can help each other
        assert!(two.explains_kg_m > 1e-4 && two.explains_kg_m < 6e-4, "{}", two.explains_kg_m);
        let same_place = told(&[sample_rotor().plane[0].position_m + 1e-3]);
        assert!(same_place.noise_kg_m > same_place.explains_kg_m);
        assert!(told(&[0.3, 0.5, 0.7]).noise_kg_m.is_infinite());
    }
}
