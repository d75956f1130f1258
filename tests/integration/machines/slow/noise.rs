//! Noise that is not as stated: correlated from reading to reading, larger, smaller, and runs that do not repeat.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Complex;
use rand_core::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, best_fit, diagnose};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_tests::sampled;

use crate::machines::machine::{Machine, machines};

/// Correlation of neighbouring readings.
const CORRELATION: f64 = 0.8;
/// Records made for each sound machine.
const RECORDS: u64 = 2;
/// How wrong a stated noise is made.
const WRONG_BY: f64 = 1.5;

/// Standard normal numbers, by the polar method (Marsaglia and Bray 1964).
pub fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    let mut uniform = || 2.0 * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0;
    loop {
        let (u, v) = (uniform(), uniform());
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * s.ln() / s).sqrt();
        }
    }
}

/// What the model of a sound machine shows, with noise of the stated size that knows its neighbour.
fn correlated(machine: &Machine, seed: u64) -> Vec<Reading> {
    let fit = best_fit(&machine.rotor, &machine.readings).unwrap();
    let noise = machine.rotor.noise.unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut last: BTreeMap<(Option<String>, usize), Complex<f64>> = BTreeMap::new();
    let innovation = (1.0 - CORRELATION * CORRELATION).sqrt();
    let mut readings = machine.readings.clone();
    for (reading, model) in readings.iter_mut().zip(&fit.predicted_m) {
        let run = reading.run.clone();
        for (probe, (y, m)) in
            reading.probes.iter_mut().zip(model).enumerate().filter(|(_, (y, _))| y.is_some())
        {
            let fresh = Complex::new(normal(&mut random), normal(&mut random));
            let own = last.entry((run.clone(), probe));
            let e = own
                .and_modify(|before| *before = *before * CORRELATION + fresh * innovation)
                .or_insert(fresh);
            *y = Some(m + *e * (noise.sigma_m(*m)));
        }
    }
    readings
}

/// The measured readings, the response of each run off by a factor of its own, alike at all probes.
fn not_repeating(machine: &Machine, between_runs: f64, seed: u64) -> Vec<Reading> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut factors: BTreeMap<Option<String>, Complex<f64>> = BTreeMap::new();
    let mut readings = machine.readings.clone();
    for reading in &mut readings {
        let new = || 1.0 + Complex::new(normal(&mut random), normal(&mut random)) * between_runs;
        let factor = *factors.entry(reading.run.clone()).or_insert_with(new);
        reading.probes.iter_mut().flatten().for_each(|y| *y *= factor);
    }
    readings
}

fn runs(machine: &Machine) -> usize {
    machine.readings.iter().map(|r| &r.run).collect::<BTreeSet<_>>().len()
}

fn sound() -> Vec<Machine> {
    ["single", "tolerance"].into_iter().flat_map(machines).filter(|m| m.truth.is_empty()).collect()
}

#[test]
fn sound_machine_with_noise_correlation_0_8_names_no_effect() {
    let mut records = 0;
    for m in sound() {
        for seed in 0..RECORDS {
            let found = diagnose(&m.rotor, &correlated(&m, seed)).unwrap();
            assert!(
                !matches!(found.verdict, DiagnosisVerdict::Missing | DiagnosisVerdict::Unknown),
                "{}, seed {seed}: {}",
                m.name,
                found.summary
            );
            assert!(found.scatter.correlation > 0.5, "{}: {:?}", m.name, found.scatter);
            records += 1;
        }
    }
    assert!(records >= 20, "{records} records");
}

#[test]
fn a_noise_stated_wrong_by_half_either_way_changes_no_verdict() {
    let machines = ["single", "tolerance"].into_iter().flat_map(machines).step_by(5).chain(sound());
    for m in sampled(2, machines) {
        let verdict = |by: f64| {
            let mut rotor = m.rotor.clone();
            if let Some(noise) = &mut rotor.noise {
                (noise.relative, noise.floor_um) = (noise.relative * by, noise.floor_um * by);
            }
            let found = diagnose(&rotor, &m.readings).unwrap();
            let first = found
                .candidates
                .first()
                .map(|c| c.label())
                .filter(|_| found.verdict == DiagnosisVerdict::Missing);
            (found.verdict, first)
        };
        let stated = verdict(1.0);
        for by in [WRONG_BY, 1.0 / WRONG_BY] {
            assert_eq!(verdict(by), stated, "{}, noise times {by:.2}", m.name);
        }
    }
}

#[test]
fn sound_machine_with_1_percent_repeatability_names_no_effect() {
    let mut records = 0;
    for m in sound().into_iter().filter(|m| runs(m) > 1) {
        for seed in 0..RECORDS {
            let found = diagnose(&m.rotor, &not_repeating(&m, 0.01, seed)).unwrap();
            println!("{}: {:?} {}", m.name, found.scatter, found.summary);
            assert!(
                !matches!(found.verdict, DiagnosisVerdict::Missing | DiagnosisVerdict::Unknown),
                "{}, seed {seed}: {}",
                m.name,
                found.summary
            );
            records += 1;
        }
    }
    assert!(records >= 8, "{records} records");
}
