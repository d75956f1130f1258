//! What the probes show by the model of a file as it stands: nothing is fitted, so that somebody can move its numbers and see the
//! curves follow.

use nalgebra::{Complex, DVector};

use super::shown::{growing_bows, with_planes_of_weights};
use super::switched;
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::measurement::{Reading, beyond_films, run_shares};
use crate::model::Response;
use crate::reduction::basis;
use crate::reduction::sizes::FIT;
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

/// The model of a file at the readings of somebody.
#[derive(Debug, Clone)]
pub struct FilePrediction {
    /// Phasor of every probe of every reading, m.
    pub predicted_m: Vec<Vec<C>>,
    /// Evaluations of the model: one a speed where its supports do not depend on amplitudes, one a reading where they do.
    pub evaluations: usize,
}

/// Predicts readings by the numbers of a file: bearings, effects and unbalance as they stand there; a plane without an unbalance has none.
///
/// # Errors
/// If a film cannot be solved at a speed, or the machine is singular or does not settle.
pub fn predicted(file: &Rotor, readings: &[Reading]) -> Result<FilePrediction, Error> {
    let speeds = || readings.iter().map(|r| r.speed_rpm);
    let ends = [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)];
    if let Some(what) = beyond_films(file, ends) {
        return Err(Error::Unsuitable(what));
    }
    let own: Vec<C> = file
        .plane
        .iter()
        .map(|p| phasor_kg_m(p.unbalance_g_mm.unwrap_or(0.0), p.angle_deg.unwrap_or(0.0)))
        .collect();
    let machine = switched(file);
    let (machine, carried) = with_planes_of_weights(&machine, &own);
    let mut model = basis::reduced(&machine, FIT);
    let growing = growing_bows(&machine);
    let follows_amplitude = model.supports.iter().any(|s| s.law.depends_on_amplitude());
    let mut without = DVector::from_element(machine.plane.len(), C::from(0.0));
    without.iter_mut().zip(&own).for_each(|(all, own)| *all = *own);
    let mut solved: Vec<(u64, Response)> = Vec::new();
    let (mut predicted_m, mut evaluations) = (Vec::new(), 0);
    for (reading, share) in readings.iter().zip(run_shares(readings)) {
        let run = machine.run.iter().position(|run| Some(&run.name) == reading.run.as_ref());
        let unbalance = run.map_or(&without, |run| &carried[run]);
        for (forcing, amplitude) in &growing {
            model.forcings[*forcing].amplitude = amplitude * share;
        }
        let alone = follows_amplitude || !growing.is_empty();
        let key = reading.speed_rpm.to_bits();
        let at = solved.iter().position(|(speed, _)| *speed == key).filter(|_| !alone);
        let at = match at {
            Some(at) => at,
            None => {
                evaluations += 1;
                solved.push((key, model.response_under(reading.speed_rad_s(), unbalance)?));
                solved.len() - 1
            }
        };
        predicted_m.push(solved[at].1.at(unbalance).iter().copied().collect());
    }
    Ok(FilePrediction { predicted_m, evaluations })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::best_fit;
    use crate::testing::sample_rotor;

    fn run_up(rotor: &Rotor) -> Vec<Reading> {
        let speeds_rpm: Vec<f64> = (0..40).map(|k| 2000.0 + 230.0 * f64::from(k)).collect();
        let request = crate::simulate::SimulationRequest { speeds_rpm, ..Default::default() };
        crate::simulate::simulate(rotor, &request).unwrap().readings
    }

    #[test]
    fn prediction_of_a_fitted_file_equals_its_fit() {
        let rotor = sample_rotor();
        let readings = run_up(&rotor);
        let best = best_fit(&rotor, &readings).unwrap();
        let found = predicted(&best.rotor, &readings).unwrap();
        let size = |rows: &[Vec<C>]| rows.iter().flatten().map(|y| y.norm_sqr()).sum::<f64>().sqrt();
        let off: Vec<Vec<C>> = found
            .predicted_m
            .iter()
            .zip(&best.predicted_m)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
            .collect();
        let share = size(&off) / size(&best.predicted_m);
        assert!(share < 5e-3, "{share}: no more than what a fit takes as linear in the drawing's errors");
        assert_eq!(found.evaluations, readings.len());
    }

    #[test]
    fn speeds_of_two_runs_are_evaluated_once() {
        let rotor = sample_rotor();
        let twice: Vec<Reading> = run_up(&rotor).into_iter().flat_map(|r| [r.clone(), r]).collect();
        assert_eq!(predicted(&rotor, &twice).unwrap().evaluations, twice.len() / 2);
    }
}
