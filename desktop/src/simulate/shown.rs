//! Noise-free readings of a machine in each of its runs, on full finite elements.

use nalgebra::{Complex, DVector};

use super::switched;
use crate::effects::Pattern;
use crate::effects::entry::{phasor, resolve, terms_of};
use crate::error::Error;
use crate::machine::drawing::{Plane, Rotor, Run};
use crate::measurement::{LARGEST_UM, Reading, SLOW_ROLL_SHARE, beyond_films};
use crate::model::Model;
use crate::shaft::mesh::Mesh;
use crate::shaft::structure::{Structure, elements_per_segment};
use crate::unbalance::phasor_kg_m;
use crate::units::{rad_s, same_place};

type C = Complex<f64>;

/// Times as many elements in each segment as models are fitted on. Those are cut at every disk, bearing and probe besides, so
/// that a long element there becomes four; its error falls with the fourth power of its length.
const FINER: usize = 8;
/// Nodes that a finer mesh has at most: its matrices are dense before they are solved as a chain.
const MOST_NODES: usize = 1000;
/// Readings of a slow roll, and its speed: no faster than machines are turned.
const SLOW_ROLL_READINGS: usize = 5;
const FASTEST_SLOW_ROLL_RPM: f64 = 300.0;

/// Readings of every run at these speeds, rpm, with this unbalance in the planes, kg·m. A run that is a slow roll is
/// read at one slow speed.
///
/// # Errors
/// If a film cannot be solved at a speed, the machine is singular or does not settle, or a probe would show more than
/// probes can.
pub fn noise_free(machine: &Rotor, unbalance_kg_m: &[C], speeds_rpm: &[f64]) -> Result<Vec<Reading>, Error> {
    let (slowest, fastest) = ends(speeds_rpm);
    if let Some(what) = beyond_films(machine, [slowest, fastest]) {
        return Err(Error::Unsuitable(what));
    }
    let machine = switched(machine);
    let (machine, carried) = with_planes_of_weights(&machine, unbalance_kg_m);
    let mut model = Model::on(fine_structure(&machine), &machine);
    let growing = growing_bows(&machine);
    let unnamed = Run { name: String::new(), added_unbalance: Vec::new(), slow_roll: false };
    let runs = if machine.run.is_empty() { std::slice::from_ref(&unnamed) } else { &machine.run };
    let slow_rpm = (SLOW_ROLL_SHARE * slowest).min(FASTEST_SLOW_ROLL_RPM);
    let mut readings = Vec::new();
    for (run, carried) in runs.iter().zip(&carried) {
        let speeds = if run.slow_roll { &[slow_rpm; SLOW_ROLL_READINGS][..] } else { speeds_rpm };
        for (k, speed_rpm) in speeds.iter().enumerate() {
            for (forcing, amplitude) in &growing {
                model.forcings[*forcing].amplitude = amplitude * share_of_run(k, speeds.len());
            }
            let shown = model.response_under(rad_s(*speed_rpm), carried)?.at(carried);
            within_probes(&machine, *speed_rpm, &shown)?;
            readings.push(Reading {
                run: (!machine.run.is_empty()).then(|| run.name.clone()),
                speed_rpm: *speed_rpm,
                probes: shown.iter().copied().map(Some).collect(),
                ..Reading::default()
            });
        }
    }
    Ok(readings)
}

/// Forcings of a model of the machine that grow over a run, by number, with their amplitudes at its end.
pub fn growing_bows(machine: &Rotor) -> Vec<(usize, C)> {
    // the forcings of a model come in the order of its terms
    (terms_of(machine).forcings.iter().enumerate())
        .filter(|(_, (pattern, _))| *pattern == Pattern::GrowingBow)
        .map(|(k, (_, amplitude))| (k, *amplitude))
        .collect()
}

/// How much of a run has passed at a reading, as fits count it; at the only one all of it.
fn share_of_run(reading: usize, of: usize) -> f64 {
    if of > 1 { reading as f64 / (of - 1) as f64 } else { 1.0 }
}

/// The slowest and the fastest.
pub fn ends(speeds_rpm: &[f64]) -> (f64, f64) {
    speeds_rpm.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), s| (low.min(*s), high.max(*s)))
}

/// The shaft on the finest mesh that is not too large.
fn fine_structure(machine: &Rotor) -> Structure {
    let own = elements_per_segment(machine);
    let fits = |finer: &usize| Mesh::new(machine, finer * own).nodes_m.len() <= MOST_NODES;
    let finer = (1..=FINER).rev().find(fits).unwrap_or(1);
    Structure::finite_elements(machine, &machine.physics, finer * own)
}

/// The machine with a plane wherever a run has a weight, and what each run carries in every plane, kg·m.
pub fn with_planes_of_weights(machine: &Rotor, unbalance_kg_m: &[C]) -> (Rotor, Vec<DVector<C>>) {
    let mut with = machine.clone();
    let weights = || machine.run.iter().flat_map(|run| &run.added_unbalance);
    for weight in weights() {
        if !with.plane.iter().any(|p| same_place(p.position_m, weight.position_m)) {
            let (name, position_m) = (format!("{} m", weight.position_m), weight.position_m);
            with.plane.push(Plane { name, position_m, unbalance_g_mm: None, angle_deg: None });
        }
    }
    let mut own = DVector::from_element(with.plane.len(), C::from(0.0));
    own.iter_mut().zip(unbalance_kg_m).for_each(|(own, u)| *own = *u);
    let mut carried = vec![own; machine.run.len().max(1)];
    for (run, carried) in machine.run.iter().zip(&mut carried) {
        for weight in &run.added_unbalance {
            let is_there = |p: &Plane| same_place(p.position_m, weight.position_m);
            if let Some(plane) = with.plane.iter().position(is_there) {
                carried[plane] += phasor_kg_m(weight.magnitude_g_mm, weight.angle_deg);
            }
        }
    }
    for (run, plane, u) in unbalance_of_runs(machine) {
        carried[run][plane] += u;
    }
    (with, carried)
}

/// What the machine's effects add in single runs: number of the run and of the plane, kg·m.
fn unbalance_of_runs(machine: &Rotor) -> Vec<(usize, usize, C)> {
    let mut added = Vec::new();
    for entry in &machine.effect {
        let Ok((effect, place)) = resolve(machine, &entry.kind, entry.at.as_deref()) else { continue };
        for u in effect.unknowns(machine, place) {
            if let Pattern::RunUnbalance { run, plane } = u.pattern
                && let Some(value) = phasor(entry, u.name, u.pattern)
            {
                added.push((run, plane, value * u.per_unit));
            }
        }
    }
    added
}

fn within_probes(machine: &Rotor, speed_rpm: f64, shown: &DVector<C>) -> Result<(), Error> {
    for (probe, y) in machine.probe.iter().zip(shown.iter()) {
        let um = 1e6 * y.norm();
        if um.is_nan() || um > 0.5 * LARGEST_UM {
            return Err(Error::Unsuitable(format!(
                "probe {} would show {um:.0} µm 0-pk at {speed_rpm:.0} rpm, expected at most {:.0} µm 0-pk; simulate less unbalance \
                 or a smaller effect, or leave out the resonance",
                probe.name,
                0.5 * LARGEST_UM
            )));
        }
    }
    Ok(())
}
