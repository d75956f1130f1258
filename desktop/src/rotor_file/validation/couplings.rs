//! What couplings must satisfy: each joins two spans, and nothing else sits where it gives.

use super::Checker;
use crate::bearing::law::STIFFEST_N_M;
use crate::error::Error;
use crate::machine::drawing::{BasisKind, Coupling, Rotor};
use crate::units::same_place;

pub(super) fn check(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    c.unique("[[coupling]] name", rotor.coupling.iter().map(|j| j.name.as_str()))?;
    for (i, coupling) in rotor.coupling.iter().enumerate() {
        let key = |name: &str| format!("[[coupling]] \"{}\" {name}", coupling.name);
        if rotor.schema < 2 {
            return c.fail("schema", format!("{} does not know [[coupling]], expected 2", rotor.schema));
        }
        joins(c, rotor, coupling)?;
        let here = |other: &&Coupling| same_place(other.position_m, coupling.position_m);
        if let Some(other) = rotor.coupling[..i].iter().find(here) {
            return c
                .fail(key("position_m"), format!("the coupling \"{}\" is at the same place", other.name));
        }
        c.within(&key("mass_kg"), coupling.mass_kg, 0.0, 1e6, "kg")?;
        c.within(&key("diametral_inertia_kg_m2"), coupling.diametral_inertia_kg_m2, 0.0, 1e6, "kg·m²")?;
        c.within(&key("polar_inertia_kg_m2"), coupling.polar_inertia_kg_m2, 0.0, 1e6, "kg·m²")?;
        let Some(springs) = coupling.flexibility else { continue };
        c.within(&key("lateral_stiffness_n_m"), springs.lateral_stiffness_n_m, 1.0, STIFFEST_N_M, "N/m")?;
        let angular = springs.angular_stiffness_n_m_rad;
        c.within(&key("angular_stiffness_n_m_rad"), angular, 1e-3, 1e13, "N·m/rad")?;
        if rotor.physics.basis == BasisKind::FreeFree {
            let what = "is flexible, but the shapes of [physics] basis = \"free_free\" have no kink, expected rigid = true";
            return c.fail(key("").trim_end(), what);
        }
        alone(c, rotor, coupling)?;
    }
    Ok(())
}

/// A coupling is where two segments meet.
fn joins(c: &Checker, rotor: &Rotor, coupling: &Coupling) -> Result<(), Error> {
    let ends = rotor.shaft.iter().scan(0.0, |end, s| {
        *end += s.length_m;
        Some(*end)
    });
    let meet_m: Vec<f64> = ends.take(rotor.shaft.len() - 1).collect();
    if meet_m.iter().any(|z| same_place(*z, coupling.position_m)) {
        return Ok(());
    }
    let places = meet_m.iter().map(|z| format!("{:.6}", z)).map(|z| z.trim_end_matches('0').to_string());
    let expected = match meet_m.len() {
        0 => "the shaft is one segment, expected another [[shaft]] where the next span begins".to_string(),
        _ => format!("[[shaft]] segments meet at {} m", places.collect::<Vec<_>>().join(", ")),
    };
    let key = format!("[[coupling]] \"{}\" position_m", coupling.name);
    c.fail(key, format!("{} m joins nothing: {expected}", coupling.position_m))
}

/// Two ends are at a flexible coupling, which move apart: what is said to be there is on neither.
fn alone(c: &Checker, rotor: &Rotor, coupling: &Coupling) -> Result<(), Error> {
    let named = |table: &str, name: &str| format!("[[{table}]] \"{name}\" position_m");
    let bearings = rotor.bearing.iter().map(|b| (named("bearing", &b.name), b.position_m));
    let disks = rotor.disk.iter().map(|d| (named("disk", &d.name), d.position_m));
    let probes = rotor.probe.iter().map(|p| (named("probe", &p.name), p.position_m));
    let planes = rotor.plane.iter().map(|p| (named("plane", &p.name), p.position_m));
    let weights = rotor.run.iter().flat_map(|r| {
        let key = format!("[[run]] \"{}\" added_unbalance position_m", r.name);
        r.added_unbalance.iter().map(move |a| (key.clone(), a.position_m))
    });
    let mut all = bearings.chain(disks).chain(probes).chain(planes).chain(weights);
    match all.find(|(_, z)| same_place(*z, coupling.position_m)) {
        None => Ok(()),
        Some((key, z)) => c.fail(
            key,
            format!(
                "{z} m is where the flexible coupling \"{}\" parts the shaft, expected a place beside it, on the span that it \
                 belongs to",
                coupling.name
            ),
        ),
    }
}
