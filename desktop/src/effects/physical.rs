//! What a file may state of its effects: what physics lets a machine of this size have.
//!
//! The bounds are those that fits keep to ([`super::Parameter::bounds`]), on scales of the drawing alone. A fit may end a little
//! beyond a bound, by chance, and says so; a file may therefore do as much, and no more.

use nalgebra::{Complex, Matrix2, Vector2};

use super::limits::{BEYOND, SLACK, allowed};
use super::{Place, Scales, Unknown, entry};
use crate::bearing::support::SupportLaw;
use crate::effects::terms::{Terms, position_m};
use crate::machine::drawing::Rotor;
use crate::machine::span;
use crate::shaft::statics::{GRAVITY_M_S2, mass_and_centre};
use crate::units::rad_s;

/// Speed, relative to the fastest, at which a stiffness that changes with speed is stated: in the middle of a run-up,
/// slope and stiffness are well apart.
const REFERENCE_SPEED: f64 = 0.7;
/// A support that gives more than this share of the shaft's length is not one that a machine is lined up on.
const SAG: f64 = 0.01;

/// Sizes of a machine that runs up to this speed and vibrates this much.
pub fn scales(rotor: &Rotor, drawn: &Terms, fastest_rad_s: f64, amplitude_m: f64) -> Scales {
    let count = rotor.bearing.len() as f64;
    let rotor_kg = mass_and_centre(rotor).0;
    let direct = drawn.supports[..rotor.bearing.len()].iter().map(|(_, law)| law.typical_stiffness_n_m());
    Scales {
        stiffness_n_m: direct.map(|k| 0.5 * k.trace()).sum::<f64>() / count,
        sagging_n_m: GRAVITY_M_S2 * rotor_kg / (count * SAG * rotor.length_m()),
        rotor_kg,
        fastest_rad_s,
        reference_rad_s: entry::reference_rad_s(rotor).unwrap_or(REFERENCE_SPEED * fastest_rad_s),
        amplitude_m,
    }
}

/// The same of a file, without data: as fast as it says, else as its reference speed lets suppose.
fn scales_of_file(rotor: &Rotor, drawn: &Terms) -> Scales {
    const USUAL_RPM: f64 = 3000.0;
    const USUAL_AMPLITUDE_M: f64 = 1e-5;
    let fastest_rad_s = rotor.fastest_rpm.map(rad_s);
    let by_reference = || entry::reference_rad_s(rotor).map(|reference| reference / REFERENCE_SPEED);
    let fastest_rad_s = fastest_rad_s.or_else(by_reference).unwrap_or(rad_s(USUAL_RPM));
    scales(rotor, drawn, fastest_rad_s, USUAL_AMPLITUDE_M)
}

/// Checks the numbers of every effect of a file, and the machine that they make.
///
/// # Errors
/// The kind of the effect, or nothing for the machine, and one clause on what physics does not allow.
pub fn check(rotor: &Rotor) -> Result<(), (Option<String>, String)> {
    if rotor.effect.is_empty() {
        return Ok(());
    }
    let drawn = Terms::drawn(rotor);
    let scales = scales_of_file(rotor, &drawn);
    for e in &rotor.effect {
        let own = |what: String| (Some(e.kind.clone()), what);
        let (effect, place) = entry::resolve(rotor, &e.kind, e.at.as_deref()).map_err(own)?;
        let values = entry::real_parameters(effect, e, &scales);
        for (p, value) in effect.parameters(&scales).iter().zip(values) {
            allowed(p, value).map_err(own)?;
        }
        for u in effect.unknowns(rotor, place) {
            let size = entry::phasor(e, u.name, u.pattern).map_or(0.0, Complex::norm);
            carried(rotor, &u, size).map_err(own)?;
        }
    }
    let terms = entry::terms_of(rotor);
    let masses_and_shaft = masses(rotor, &terms).and_then(|()| shaft_stiffness(rotor));
    masses_and_shaft.and_then(|()| holds(rotor, &drawn, &terms)).map_err(|what| (None, what))
}

/// A linear unknown stays below what its effect allows, or below what this machine could carry: a force so many times its
/// weight, an unbalance of all its mass a shaft's length off the axis.
fn carried(rotor: &Rotor, unknown: &Unknown, size: f64) -> Result<(), String> {
    let (mass_kg, length_m) = (mass_and_centre(rotor).0, rotor.length_m());
    let by_machine = match unknown.unit {
        "kg·m" => mass_kg * length_m,
        "N" => BEYOND * GRAVITY_M_S2 * mass_kg,
        "N·m" => BEYOND * GRAVITY_M_S2 * mass_kg * length_m,
        _ => f64::INFINITY,
    };
    let largest = unknown.largest.min(by_machine);
    if size <= largest * (1.0 + SLACK) {
        return Ok(());
    }
    let (name, unit) = (unknown.name, unknown.unit);
    Err(format!("the parameter {name} is {size:e}, expected at most {largest:.3e} {unit}"))
}

/// No disk is lighter than nothing.
fn masses(rotor: &Rotor, terms: &Terms) -> Result<(), String> {
    let largest_kg = BEYOND * mass_and_centre(rotor).0;
    for (i, disk) in rotor.disk.iter().enumerate() {
        let here = terms.supports.iter().filter(|(place, _)| *place == Place::Disk(i));
        let mass_kg = disk.mass_kg + here.map(|(_, law)| law.mass_kg).sum::<f64>();
        if !(0.0..=largest_kg).contains(&mass_kg) {
            return Err(format!("disk \"{}\" of {} kg is left with {mass_kg} kg", disk.name, disk.mass_kg));
        }
    }
    Ok(())
}

/// Lengths that overlap leave the shaft some stiffness: their least is at the start of one of them.
fn shaft_stiffness(rotor: &Rotor) -> Result<(), String> {
    for (span, _) in span::stated(rotor) {
        let left = span::stiffness_factor(rotor, span.from_m());
        if left <= 0.0 {
            let from_m = span.from_m();
            return Err(format!("the shaft at {from_m} m is left with {left:.2} of its stiffness"));
        }
    }
    Ok(())
}

/// The shaft, taken as rigid, stays where its supports hold it: the stiffness against lift and tilt is positive definite
/// along x and along y. A shaft that bends is held less still.
fn holds(rotor: &Rotor, drawn: &Terms, terms: &Terms) -> Result<(), String> {
    let against = |terms: &Terms, axis: usize| {
        let one = |(place, law): &(Place, SupportLaw)| {
            let arm = Vector2::new(1.0, position_m(rotor, *place)?);
            Some(arm * arm.transpose() * law.typical_stiffness_n_m()[(axis, axis)])
        };
        terms.supports.iter().filter_map(one).sum::<Matrix2<f64>>()
    };
    for axis in 0..2 {
        // what a film cannot hold at its typical speed is no matter of effects
        let is_held = |terms: &Terms| against(terms, axis).cholesky().is_some();
        if is_held(drawn) && !is_held(terms) {
            let along = ["x", "y"][axis];
            return Err(format!(
                "with its effects nothing holds the shaft along {along}: the stiffness is negative"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::rotor_file;
    use crate::testing::sample_rotor;

    fn refusal(effect: &str) -> String {
        let text = toml::to_string(&sample_rotor()).unwrap() + "\n[[effect]]\n" + effect;
        rotor_file::parse("r.toml", &text).err().map_or_else(String::new, |e| e.to_string())
    }

    #[test]
    fn unphysical_parameters_are_refused_with_expected_range() {
        let disk = &sample_rotor().disk[0].name;
        let (bearing, probe) = (&sample_rotor().bearing[0].name, &sample_rotor().probe[0].name);
        for (effect, says) in [
            (
                format!("kind = \"seal\"\nat = \"{disk}\"\nparameters = {{ k = -1e12, q = 0.0, c = 0.0 }}"),
                "k is -1e12",
            ),
            (
                format!("kind = \"seal\"\nat = \"{disk}\"\nparameters = {{ k = 0.0, q = 1e14, c = 0.0 }}"),
                "q is 1e14",
            ),
            (
                format!("kind = \"disk_mass\"\nat = \"{disk}\"\nparameters = {{ kg = -1000.0 }}"),
                "is left with -",
            ),
            (
                format!(
                    "kind = \"pedestal\"\nat = \"{bearing}\"\nparameters = {{ k = -1e8, c = 1e3, m = 9.0 }}"
                ),
                "k is -1e8",
            ),
            (
                format!(
                    "kind = \"pedestal\"\nat = \"{bearing}\"\nparameters = {{ k = 1e-6, c = 1e3, m = 9.0 }}"
                ),
                "k is 1e-6",
            ),
            (
                format!(
                    "kind = \"pedestal\"\nat = \"{bearing}\"\nparameters = {{ k = 1e8, c = 1e3, m = 42000.0 }}"
                ),
                "m is 4.2e4, expected 0.000e0 to",
            ),
            (
                format!(
                    "kind = \"probe_calibration\"\nat = \"{probe}\"\nparameters = {{ gain = 0.0, phase = 0.0 }}"
                ),
                "gain is 0e0",
            ),
            (
                format!("kind = \"magnetic_pull\"\nat = \"{disk}\"\nparameters = {{ k = -1e10 }}"),
                "nothing holds the shaft",
            ),
            ("kind = \"speed_dependent_stiffness\"\nparameters = { slope = 0.3 }".into(), "ref is missing"),
        ] {
            let said = refusal(&effect);
            assert!(said.contains(says), "{effect}: {said}");
        }
    }

    #[test]
    fn plausible_parameters_and_small_excesses_are_accepted() {
        let disk = &sample_rotor().disk[0].name;
        let probe = &sample_rotor().probe[0].name;
        for effect in [
            format!("kind = \"seal\"\nat = \"{disk}\"\nparameters = {{ k = -1e5, q = 2e6, c = 300.0 }}"),
            format!("kind = \"disk_mass\"\nat = \"{disk}\"\nparameters = {{ kg = -0.5 }}"),
            format!(
                "kind = \"probe_calibration\"\nat = \"{probe}\"\nparameters = {{ gain = 0.9, phase = -0.1 }}"
            ),
            "kind = \"speed_dependent_stiffness\"\nparameters = { slope = 0.3, ref = 800.0 }".into(),
        ] {
            assert_eq!(refusal(&effect), "", "{effect}");
        }
    }
}
