//! The run-up of the real rig RK-4, at 230 rpm a second: too fast for a steady response.

use std::path::Path;

use rotor_edge_desktop::check::critical::critical_speeds;
use rotor_edge_desktop::check::system::System;
use rotor_edge_desktop::diagnose::{TooFast, add, best_fit, diagnose};
use rotor_edge_desktop::identify::{PhaseOneConfig, beside_runup, identify};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::units::{rad_s, rpm};

/// Largest misfit of the transient, of the peak, rms.
const MISFIT_OF_PEAK: f64 = 0.10;
/// The first critical speed that the source states, and how near to it the model's has to be, relative.
const CRITICAL_RPM: f64 = 1648.0;
const NEAR: f64 = 0.01;

fn run_up() -> (Rotor, Vec<Reading>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/rk4");
    let mut rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    // one probe was recorded, and no weights
    rotor.probe.retain(|probe| probe.name == "P1Y");
    rotor.run.clear();
    let readings = measurement::read(&folder.join("runup.csv"), &rotor).unwrap();
    (rotor, readings)
}

/// The model with the runout that the source did not take off, and its rms misfit over the peak.
fn fitted(rotor: &Rotor, readings: &[Reading]) -> (Rotor, f64) {
    let sizes = || readings.iter().map(|r| r.probes[0].unwrap().norm());
    let rms = (sizes().map(|y| y * y).sum::<f64>() / readings.len() as f64).sqrt();
    let better = add(rotor, readings, "runout", None).unwrap();
    (better.rotor, better.error_after * rms / sizes().fold(0.0, f64::max))
}

#[test]
fn rk4_run_up_is_fitted_as_transient_by_its_times() {
    let (rotor, mut readings) = run_up();
    let (found, transient) = fitted(&rotor, &readings);
    assert!(transient < MISFIT_OF_PEAK, "{transient:.3}");
    let criticals = critical_speeds(&System::new(&found).unwrap(), rad_s(2600.0), 0);
    let criticals_rpm: Vec<f64> = criticals.iter().map(|critical| rpm(critical.speed_rad_s)).collect();
    let is_near = |critical_rpm: &f64| (critical_rpm / CRITICAL_RPM - 1.0).abs() < NEAR;
    assert!(criticals_rpm.iter().any(is_near), "{criticals_rpm:?}");
    readings.iter_mut().for_each(|r| r.time_d = None);
    let (_, steady) = fitted(&rotor, &readings);
    assert!(steady > 2.0 * transient, "{steady:.3} against {transient:.3}");
}

/// A fit of the file that `add` writes is as good as the fit that it wrote, though the effect lets free vibration last longer, and noise
/// does not explain the misfit.
#[test]
fn rk4_run_up_with_runout_added_fits_again_as_well() {
    let (rotor, readings) = run_up();
    let better = add(&rotor, &readings, "runout", None).unwrap();
    let again = best_fit(&better.rotor, &readings).unwrap();
    assert!(
        again.remarks.iter().any(|remark| remark.contains("fitted as that of a run-up")),
        "{:?}",
        again.remarks
    );
    let measured = || readings.iter().map(|r| r.probes[0].unwrap());
    let misfit: f64 = measured().zip(&again.predicted_m).map(|(y, p)| (y - p[0]).norm_sqr()).sum();
    let error = (misfit / measured().map(|y| y.norm_sqr()).sum::<f64>()).sqrt();
    assert!(error < 1.05 * better.error_after, "{error} after {}", better.error_after);
}

/// Beside days of a record, which have times of their own.
#[test]
fn phase_one_fits_rk4_run_up_as_transient_beside_days() {
    let (rotor, runup) = run_up();
    let days: Vec<Reading> = (runup.iter().take(3).zip(0..))
        .map(|(reading, day)| Reading { time_d: Some(f64::from(day)), ..reading.clone() })
        .collect();
    let is_transient = |readings: &[Reading]| {
        let found = identify(&rotor, readings, &PhaseOneConfig::default()).unwrap();
        found.remarks.iter().any(|remark| remark.contains("fitted as that of a run-up"))
    };
    assert!(is_transient(&beside_runup(&rotor, &days, &runup)));
    // as one run its times contradict each other
    assert!(!is_transient(&[days, runup].concat()));
}

/// The source states 230 rpm a second.
#[test]
fn rk4_run_up_without_times_is_known_by_its_beats() {
    let (rotor, mut readings) = run_up();
    readings.iter_mut().for_each(|r| r.time_d = None);
    let found = diagnose(&rotor, &readings).unwrap();
    assert_eq!(found.too_fast, Some(TooFast::Beats), "{}", found.summary);
    let (_, rest) = found.summary.split_once("changes by about ").unwrap();
    let rate_rpm_s: f64 = rest.split_once(' ').unwrap().0.parse().unwrap();
    assert!((rate_rpm_s / 230.0 - 1.0).abs() < 0.1, "{}", found.summary);
}
