//! The run-up of the real rig RK-4, at 230 rpm a second: too fast for a steady response.

use std::path::Path;

use rotor_edge_desktop::diagnose::add;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

/// Largest misfit of the transient, of the peak, rms.
const MISFIT_OF_PEAK: f64 = 0.10;

fn run_up() -> (Rotor, Vec<Reading>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/rk4");
    let rotor = rotor_file::read(&folder.join("one_disk.toml")).unwrap();
    let readings = measurement::read(&folder.join("runup.csv"), &rotor).unwrap();
    (rotor, readings)
}

/// Rms misfit over the peak, with the runout that the source did not take off.
fn misfit_of_peak(rotor: &Rotor, readings: &[Reading]) -> f64 {
    let sizes = || readings.iter().map(|r| r.probes[0].unwrap().norm());
    let rms = (sizes().map(|y| y * y).sum::<f64>() / readings.len() as f64).sqrt();
    add(rotor, readings, "runout", None).unwrap().error_after * rms / sizes().fold(0.0, f64::max)
}

#[test]
fn rk4_run_up_is_fitted_as_transient_by_its_times() {
    let (rotor, mut readings) = run_up();
    let transient = misfit_of_peak(&rotor, &readings);
    assert!(transient < MISFIT_OF_PEAK, "{transient:.3}");
    readings.iter_mut().for_each(|r| r.time_d = None);
    let steady = misfit_of_peak(&rotor, &readings);
    assert!(steady > 2.0 * transient, "{steady:.3} against {transient:.3}");
}
