//! Fits held against the finite-element model, against differences, and against synthetic machines.

mod drawing;
mod laws;
mod prediction;
mod sweep;
mod unknown;

use nalgebra::{Complex, DVector};

use super::data::Data;
use super::hypothesis::{Hypothesis, PlacedEffect};
use super::problem::Problem;
use super::{Fitter, ShaftKind};
use crate::effects::{Place, find};
use crate::machine::drawing::{AddedUnbalance, Noise, Rotor, Run, Tolerance};
use crate::machine::span::Span;
use crate::measurement::Reading;
use crate::testing::{sample_rotor, train};
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

const NOISE: Noise =
    Noise { relative: 0.01, floor_um: 0.01, scale: None, correlation: None, between_runs: None };

/// The sample rotor with two runs, one of them with a trial weight, and loose tolerances.
fn machine() -> Rotor {
    let mut rotor = sample_rotor();
    let weight = AddedUnbalance { position_m: 0.3, magnitude_g_mm: 400.0, angle_deg: 40.0 };
    rotor.run = vec![
        Run { name: "as found".into(), added_unbalance: vec![], slow_roll: false },
        Run { name: "trial".into(), added_unbalance: vec![weight], slow_roll: false },
    ];
    for (i, probe) in rotor.probe.iter_mut().enumerate() {
        probe.angle_deg = 30.0 + 90.0 * (i % 2) as f64;
    }
    rotor.noise = Some(NOISE);
    rotor.tolerance = Some(Tolerance {
        modulus_relative: 0.01,
        diameter_relative: 0.003,
        mass_relative: 0.02,
        inertia_relative: 0.03,
        position_m: 0.001,
        ..Tolerance::default()
    });
    rotor
}

/// Readings at these speeds in every run; the values are filled in later.
fn readings(rotor: &Rotor, speeds_rpm: &[f64]) -> Vec<Reading> {
    let blank = vec![Some(C::new(1e-5, 2e-5)); rotor.probe.len()];
    rotor
        .run
        .iter()
        .flat_map(|run| {
            speeds_rpm.iter().map(|rpm| Reading {
                run: Some(run.name.clone()),
                speed_rpm: *rpm,
                probes: blank.clone(),
                ..Reading::default()
            })
        })
        .collect()
}

fn run_up(count: usize) -> Vec<f64> {
    (1..=count).map(|k| 14_000.0 * k as f64 / count as f64).collect()
}

fn planes() -> Vec<C> {
    vec![phasor_kg_m(300.0, 25.0), phasor_kg_m(450.0, -110.0)]
}

/// Every effect with its place and parameters in SI units that are neither large nor at a bound, and the
/// size of its linear unknowns.
fn every_effect() -> Vec<(&'static str, Place, Vec<f64>, Vec<C>)> {
    let (b, d) = (Place::Bearing(1), Place::Disk(0));
    let one = |re, im| vec![C::new(re, im)];
    let runout: Vec<C> = (0..4).map(|p| C::new(1e-6 * f64::from(p), -2e-6)).collect();
    vec![
        ("speed_dependent_stiffness", Place::Machine, vec![0.2], vec![]),
        ("pedestal", b, vec![3e8, 200.0, 2e4], vec![]),
        ("pedestal_by_direction", Place::Bearing(0), vec![3e8, 6e8, 200.0, 2e4], vec![]),
        ("cross_coupled_stiffness", Place::Bearing(0), vec![2e7], vec![]),
        ("seal", d, vec![1e7, -5e6, 4e3], vec![]),
        ("unbalance_plane", Place::Disk(1), vec![], one(1e-4, -2e-4)),
        ("unbalance_of_run", Place::Run(1), vec![], vec![C::new(1e-4, 3e-5), C::new(-5e-5, 2e-4)]),
        ("shaft_bow", Place::Machine, vec![], one(3e-6, 1e-6)),
        ("thermal_bow", Place::Machine, vec![], vec![C::new(2e-6, -1e-6), C::new(1e-6, 3e-6)]),
        ("disk_skew", d, vec![], one(1e-3, 2e-3)),
        ("runout", Place::Machine, vec![], runout),
        ("probe_calibration", Place::Probe(2), vec![1.2, 0.3], vec![]),
        ("probe_reversed", Place::Probe(1), vec![], vec![]),
        ("probes_swapped", b, vec![], vec![]),
        ("keyphasor_offset", Place::Machine, vec![0.4], vec![]),
        ("speed_factor", Place::Machine, vec![1.07], vec![]),
        ("coupling_force", Place::Machine, vec![], one(20.0, -10.0)),
        ("coupling_misaligned", Place::LeftEnd, vec![], vec![C::new(15.0, 5.0), C::new(-3.0, 4.0)]),
        ("bow_kink", Place::Machine, vec![], vec![C::new(2e-6, -3e-6), C::new(1e-6, 1e-6)]),
        ("disk_mass", Place::Disk(1), vec![1.5], vec![]),
        ("magnetic_pull", d, vec![-8e6], vec![]),
        ("nonlinear_stiffness", Place::Machine, vec![2e7], vec![]),
        ("rub", Place::Disk(1), vec![2e7, 1e-5, 0.2], vec![]),
        ("internal_damping", Place::Machine, vec![2e-6], vec![]),
        ("shaft_stiffness", Place::Span(Span::new(0.35, 0.6)), vec![0.4], vec![]),
    ]
}

/// A hypothesis with these effects of [`every_effect`], and its search coordinates with the bearings a
/// little off.
fn hypothesis<'a>(fitter: &'a Fitter, chosen: &[&str]) -> (Hypothesis<'a>, Vec<f64>, Vec<C>) {
    let mut h = Hypothesis::drawn(fitter.rotor, fitter.scales(None));
    let mut x: Vec<f64> =
        h.bearings.stated().iter().enumerate().map(|(i, v)| v + 0.1 * (i as f64).sin()).collect();
    let mut unknowns = planes();
    for (name, place, parameters, values) in every_effect() {
        if chosen.contains(&name) {
            let effect = find(name).unwrap();
            let scaled = effect.parameters(&h.scales);
            x.extend(scaled.iter().zip(&parameters).map(|(p, v)| p.scale.from_si(*v)));
            h = h.with(PlacedEffect { effect, place });
            unknowns.extend(values);
        }
    }
    (h, x, unknowns)
}

/// A fitter whose data are a hypothesis' own response on a drawing, without noise.
fn measured(rotor: &Rotor, speeds_rpm: &[f64], chosen: &[&str], deviation: &DVector<f64>) -> Vec<Reading> {
    let mut blank = readings(rotor, speeds_rpm);
    let fitter = Fitter::new(rotor, Data::new(rotor, &NOISE, &blank));
    let (h, x, unknowns) = hypothesis(&fitter, chosen);
    let plant = fitter.plant(deviation, &ShaftKind::of(&h.terms(&x))).unwrap();
    let model = fitter.problem(&h, plant, None, &fitter.plain).weighted_model(&x, &unknowns).unwrap();
    let sigmas: Vec<f64> = fitter.data.values().map(|v| v.sigma_m).collect();
    for (i, value) in blank.iter_mut().flat_map(|r| r.probes.iter_mut()).enumerate() {
        *value = Some(C::new(model[2 * i], model[2 * i + 1]) * sigmas[i]);
    }
    blank
}

fn as_drawn(rotor: &Rotor) -> ShaftKind {
    ShaftKind { physics: rotor.physics, has_lengths: false }
}

fn no_deviation(fitter: &Fitter) -> DVector<f64> {
    DVector::zeros(fitter.deviations.len())
}

/// The problem of a hypothesis on a drawing, evaluated at `x`.
fn problem<'p>(
    fitter: &'p Fitter<'p>,
    h: &'p Hypothesis<'p>,
    x: &[f64],
    deviation: &DVector<f64>,
) -> Problem<'p> {
    let plant = fitter.plant(deviation, &ShaftKind::of(&h.terms(x))).unwrap();
    let mut p = fitter.problem(h, plant, None, &fitter.plain);
    p.go_to(x);
    p
}
