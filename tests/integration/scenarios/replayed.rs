//! The sample's record with an instrument that fails from day 60 on, identified and played as `replay` does.

use std::sync::OnceLock;

use rotor_edge::edge::Deployment;
use rotor_edge::replay::check::equivalence;
use rotor_edge::replay::{self, Replay, ReplayConfig};
use rotor_edge::sample;
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::measurement::Reading;

use super::dice::Dice;
use super::machine::C;
use super::monitor::claims_health;

/// The fault begins, is to be told at the latest, and the record ends, days.
const BEGINS_D: f64 = 60.0;
const TOLD_D: f64 = 62.0;
const ENDS_D: f64 = 122.0;

/// The sample as identified from its first three days and its run-up, and its record to the end of the faulty one.
fn sample_machine() -> &'static (Deployment, Vec<Reading>) {
    static MACHINE: OnceLock<(Deployment, Vec<Reading>)> = OnceLock::new();
    MACHINE.get_or_init(|| {
        let (rotor, record, runup) = sample::load().unwrap();
        let readings: Vec<Reading> = record[..3].iter().chain(&runup).cloned().collect();
        let identified = identify(&rotor, &readings, &PhaseOneConfig::default()).unwrap().rotor;
        let record = record.into_iter().filter(|r| r.time_d <= Some(ENDS_D)).collect();
        (Deployment::new(&identified, 11_500.0).unwrap(), record)
    })
}

/// The record with its faulty readings changed; `change` gets all readings and the place of one of them.
fn played(change: impl Fn(&mut [Reading], usize)) -> Replay {
    let (deployment, record) = sample_machine();
    let mut record = record.clone();
    for row in 0..record.len() {
        if record[row].time_d >= Some(BEGINS_D) {
            change(&mut record, row);
        }
    }
    replay::run(deployment, &record, &ReplayConfig::default(), |_| ()).unwrap()
}

/// Days from which and to which the controller claimed health, after the day on which it should have told.
fn claims(played: &Replay) -> Vec<[f64; 2]> {
    // a reading and its answer take less than this, days
    const TRAVEL_D: f64 = 1e-3;
    let ends = played.states.iter().skip(1).map(|change| change.time_d).chain([ENDS_D]);
    let spans = played.states.iter().zip(ends).filter(|(change, _)| claims_health(&change.status));
    spans
        .map(|(change, end_d)| [change.time_d, end_d])
        .filter(|[_, end_d]| *end_d > TOLD_D + TRAVEL_D)
        .collect()
}

#[test]
fn sample_without_fault_is_tracked_to_the_end() {
    let played = played(|_, _| ());
    assert!(played.states.iter().all(|change| change.status.cause == Default::default()));
    assert!(claims(&played).last().is_some_and(|[_, end_d]| *end_d == ENDS_D), "{:?}", played.states);
}

fn turn(reading: &mut Reading, factor: C) {
    reading.probes.iter_mut().flatten().for_each(|y| *y *= factor);
}

#[test]
fn replayed_record_without_phase_reference_is_told() {
    for seed in 0..5 {
        let mut dice = Dice::new(seed);
        let angles: Vec<f64> = (0..200).map(|_| dice.angle()).collect();
        let played = played(|record, row| turn(&mut record[row], C::from_polar(1.0, angles[row])));
        assert_eq!(claims(&played), Vec::<[f64; 2]>::new(), "seed {seed}");
    }
}

#[test]
fn replayed_record_of_one_repeated_row_is_told() {
    let played = played(|record, row| {
        let repeated = record.iter().position(|r| r.time_d >= Some(BEGINS_D)).unwrap();
        record[row] = Reading { time_d: record[row].time_d, ..record[repeated].clone() };
    });
    // of sixty days that moved it is known that a repeat is rare, but not yet how rare
    assert_eq!(claims(&played), [[9.0, 66.0]]);
}

#[test]
fn replayed_record_of_a_tenth_of_the_vibration_is_told() {
    let played = played(|record, row| turn(&mut record[row], C::from(0.1)));
    assert_eq!(claims(&played), Vec::<[f64; 2]>::new());
}

#[test]
fn replayed_rows_of_zeros_are_no_error_of_the_core() {
    let (deployment, record) = sample_machine();
    let mut record = record[..8].to_vec();
    record[5..].iter_mut().for_each(|reading| turn(reading, C::from(0.0)));
    let config = ReplayConfig::default();
    let played = replay::run(deployment, &record, &config, |_| ()).unwrap();
    equivalence(deployment, &config, &record, &played.answers).unwrap().verdict().unwrap();
}
