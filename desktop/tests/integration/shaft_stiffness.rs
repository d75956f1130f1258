//! A shaft that is softer over a length: against a shaft drawn so, and found in readings of one that is really thinner.

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, add, diagnose};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::machine::span::Span;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::shaft::structure::Structure;
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_desktop::units::rad_s;

use crate::effects::{MACHINE, is_found, measured, own_unbalance, run_up, shown_with, with};

const FACTOR: f64 = 0.41;
/// Of shaft that differs from its drawing, m.
const LENGTH_M: f64 = 0.2;

fn effect(at: &str, factor: f64) -> String {
    format!("[[effect]]\nkind = \"shaft_stiffness\"\nat = \"{at}\"\nparameters = {{ factor = {factor} }}")
}

/// The machine with its shaft drawn in three pieces, of which the middle one has this modulus and diameter, relative.
fn drawn(from_m: f64, to_m: f64, modulus: f64, diameter: f64) -> Rotor {
    let mut rotor = with("");
    let whole = rotor.shaft[0];
    let piece = |length_m: f64| {
        let mut piece = whole;
        piece.length_m = length_m;
        piece
    };
    rotor.shaft = vec![piece(from_m), piece(to_m - from_m), piece(whole.length_m - to_m)];
    rotor.shaft[1].youngs_modulus_pa *= modulus;
    rotor.shaft[1].outer_diameter_m *= diameter;
    rotor
}

/// Readings of a machine in both runs, with noise.
fn readings(machine: &Rotor, seed: u64) -> Vec<Reading> {
    let own = own_unbalance();
    let trial = [own[0] + phasor_kg_m(500.0, 70.0), own[1]];
    let shown: Vec<_> = [own, trial].into_iter().flat_map(|u| shown_with(machine, u, run_up())).collect();
    measured(&shown, seed)
}

fn response(rotor: &Rotor, rpm: f64) -> DVector<Complex<f64>> {
    let unbalance = DVector::from_column_slice(&own_unbalance());
    let model = Model::on(Structure::finite_elements(rotor, &rotor.physics, 12), rotor);
    model.response(rad_s(rpm)).unwrap().at(&unbalance)
}

#[test]
fn stated_length_equals_shaft_drawn_softer_there() {
    for (from_m, to_m) in [(0.5, 0.7), (0.05, 0.45), (0.3, 0.9)] {
        let one_segment = with(&effect(&format!("{from_m} to {to_m} m"), FACTOR));
        let same_mesh = Rotor { effect: one_segment.effect.clone(), ..drawn(from_m, to_m, 1.0, 1.0) };
        let softer = drawn(from_m, to_m, FACTOR, 1.0);
        for rpm in run_up() {
            let (stated, expected) = (response(&same_mesh, rpm), response(&softer, rpm));
            assert!(
                (stated - &expected).norm() < 1e-7 * expected.norm(),
                "{from_m} to {to_m} m at {rpm} rpm"
            );
        }
        // cut elsewhere, below the critical speeds, where what a mesh leaves is small
        let (stated, expected) = (response(&one_segment, 2000.0), response(&softer, 2000.0));
        assert!((stated - &expected).norm() < 1e-4 * expected.norm(), "{from_m} to {to_m} m in one segment");
    }
}

#[test]
fn softer_or_stiffer_length_is_found() {
    is_found("shaft_stiffness", Some("0.45 to 0.75 m"), "factor = 0.7");
    is_found("shaft_stiffness", Some("0.1 to 0.45 m"), "factor = 1.5");
}

/// Whether a length that effects are named at has something in common with this one.
fn is_there(at: Option<&str>, span: Span) -> bool {
    at.and_then(Span::parse).is_some_and(|at| at.overlaps(span))
}

/// What is said of the machine as drawn where this one was measured, whose shaft differs from there on; the leading candidate is this
/// length.
fn said_of(measured: &Rotor, seed: u64, from_m: f64) -> Diagnosis {
    let found = diagnose(&with(""), &readings(measured, seed)).unwrap();
    let first = &found.candidates[0];
    let is_there = is_there(first.at.as_deref(), Span::new(from_m, from_m + LENGTH_M));
    assert!(first.effect == "shaft_stiffness" && is_there, "{from_m} m: {}", found.summary);
    found
}

#[test]
fn shaft_drawn_too_stiff_over_a_length_is_named_there() {
    for (seed, from_m) in [(1, 0.5), (2, 0.2)] {
        let found = said_of(&drawn(from_m, from_m + LENGTH_M, FACTOR, 1.0), seed, from_m);
        assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{from_m} m: {}", found.summary);
    }
}

/// These readings are so exact that they hold where within the length the soft place is, which another effect makes up for.
#[test]
fn soft_place_far_off_the_middle_is_named_at_least_with_another() {
    for (seed, from_m) in [(3, 0.85), (4, 0.53)] {
        let found = said_of(&drawn(from_m, from_m + LENGTH_M, FACTOR, 1.0), seed, from_m);
        let is_open = matches!(found.verdict, DiagnosisVerdict::Missing | DiagnosisVerdict::Undecided);
        assert!(is_open, "{from_m} m: {}", found.summary);
        assert!(found.summary.contains(&found.candidates[0].label()), "{from_m} m: {}", found.summary);
    }
}

/// What mass a thinner shaft lacks goes unseen near a bearing; in the middle it is no effect of the list.
#[test]
fn thinner_shaft_is_named_or_leads_an_unknown_cause() {
    let near_bearing = said_of(&drawn(0.2, 0.2 + LENGTH_M, 1.0, 0.8), 6, 0.2);
    assert_eq!(near_bearing.verdict, DiagnosisVerdict::Missing, "{}", near_bearing.summary);
    let between_wheels = said_of(&drawn(0.5, 0.5 + LENGTH_M, 1.0, 0.8), 5, 0.5);
    assert_ne!(between_wheels.verdict, DiagnosisVerdict::Adequate, "{}", between_wheels.summary);
}

#[test]
fn added_length_is_fitted_and_described_by_the_written_file() {
    let at = "0.5 to 0.7 m";
    let measured = readings(&with(&effect(at, FACTOR)), 7);
    let added = add(&with(""), &measured, "shaft_stiffness", Some(at)).unwrap();
    let written = toml::to_string(&added.rotor).unwrap();
    let again = diagnose(&rotor_file::parse("written.toml", &written).unwrap(), &measured).unwrap();
    assert_eq!(again.verdict, DiagnosisVerdict::Adequate, "{}", again.summary);
}

#[test]
fn length_that_is_none_or_beyond_the_shaft_is_refused() {
    for at in ["wheel 1", "0.5 to 9 m", "0.7 to 0.5 m", "-0.1 to 0.5 m"] {
        let said =
            rotor_file::parse("r.toml", &format!("{MACHINE}{}", effect(at, FACTOR))).unwrap_err().to_string();
        assert!(
            said.contains(&format!("cannot sit at \"{at}\"")) && said.contains("0.1 to 0.45 m"),
            "{said}"
        );
    }
    let twice = format!("{MACHINE}{}\n{}", effect("0.2 to 0.4 m", 0.3), effect("0.3 to 0.5 m", 0.3));
    let said = rotor_file::parse("r.toml", &twice).unwrap_err().to_string();
    assert!(said.contains("the shaft at 0.3 m is left with"), "{said}");
}
