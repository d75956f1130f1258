//! Mistakes that are often made in files, made on sound machines with ordinary drawings: each is named, and no effect of the
//! machine is claimed for it.

use crate::machines::machine::{Machine, machines};
use rotor_edge_desktop::diagnose::{Diagnosis, diagnose};
use rotor_edge_tests::sampled;

/// What is said of a mistake.
type Named = fn(&Diagnosis) -> bool;

fn says(answer: &Diagnosis, words: &str) -> bool {
    answer.mistake.as_ref().is_some_and(|mistake| mistake.words.contains(words))
}

/// Makes a mistake on every sound machine, and counts those on which it is named.
fn named(make: impl Fn(&mut Machine), named: Named) -> (usize, usize) {
    let sound: Vec<Machine> = machines("ordinary").into_iter().filter(|m| m.truth.is_empty()).collect();
    let sound: Vec<Machine> = sampled(2, sound).collect();
    let many = sound.len();
    let count = sound.into_iter().filter_map(|mut machine| {
        make(&mut machine);
        let answer = diagnose(&machine.rotor, &machine.readings).unwrap();
        let of_probe = |effect: &str| effect.starts_with("probe");
        for c in answer.candidates.iter().filter(|c| !of_probe(c.effect)) {
            assert!(c.probability < 0.5, "{}: {}, {}", machine.name, c.label(), answer.summary);
        }
        named(&answer).then_some(())
    });
    (count.count(), many)
}

#[test]
fn exchanged_bearings_are_named() {
    let exchange = |m: &mut Machine| {
        m.readings.iter_mut().for_each(|r| r.probes.rotate_left(2));
    };
    let (count, many) = named(exchange, |answer| says(answer, "A and B look exchanged"));
    assert!(many - count <= many / 5, "{count} of {many}");
}

#[test]
fn negated_sine_of_probe_is_named() {
    let negate =
        |m: &mut Machine| m.readings.iter_mut().for_each(|r| r.probes[2] = r.probes[2].map(|y| y.conj()));
    let (count, many) = named(negate, |answer| says(answer, "The sine of probe BX looks negated"));
    assert_eq!(count, many);
}

#[test]
fn angles_in_radians_are_named() {
    let state =
        |m: &mut Machine| m.rotor.probe.iter_mut().for_each(|p| p.angle_deg = p.angle_deg.to_radians());
    let (count, many) = named(state, |answer| says(answer, "look like radians"));
    assert_eq!(count, many);
}

#[test]
fn speeds_in_radians_a_second_are_named() {
    let state =
        |m: &mut Machine| m.readings.iter_mut().for_each(|r| r.speed_rpm *= std::f64::consts::PI / 30.0);
    let (count, many) = named(state, |answer| says(answer, "rad/s in place of rpm"));
    assert!(many - count <= many / 5, "{count} of {many}");
}

#[test]
fn radii_for_diameters_are_named() {
    let state = |m: &mut Machine| m.rotor.shaft.iter_mut().for_each(|s| s.outer_diameter_m *= 0.5);
    let (count, many) = named(state, |answer| says(answer, "look like radii"));
    assert_eq!(count, many);
}

#[test]
fn turned_probe_is_named_as_its_angle() {
    let turn = |m: &mut Machine| m.rotor.probe[0].angle_deg += 45.0;
    let is_named: Named = |answer| says(answer, "The angle of probe AX looks wrong: -4");
    let (count, many) = named(turn, is_named);
    assert!(many - count <= many / 5, "{count} of {many}");
}
