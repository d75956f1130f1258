use std::vec::Vec;

use super::*;
use crate::testing::{Random, normal, rounded};

/// Readings in the order in which they come.
#[derive(Default)]
struct Sender {
    repeats: Repeats,
    last: Option<Reading>,
}

impl Sender {
    fn send(&mut self, reading: Reading) -> Repetition {
        let mut last = [ProbeVector::LOST; MAX_PROBES];
        if let Some(reading) = &self.last {
            last[..reading.probes().len()].copy_from_slice(reading.probes());
        }
        self.last = Some(reading);
        self.repeats.update(&last, &reading)
    }

    /// The number of the first reading of these, from zero, with a probe that repeats too often.
    fn first_excess(&mut self, readings: impl IntoIterator<Item = Reading>) -> Option<(usize, u8)> {
        let masks = readings.into_iter().map(|reading| self.send(reading).excess_mask);
        masks.enumerate().find(|&(_, mask)| mask != 0)
    }
}

/// Readings of four probes with normal noise.
fn moving(random: &mut Random, sigma_um: f32) -> Reading {
    let mut part = |value: f32| value + sigma_um * normal(random);
    let vectors = [3.0, -7.0, 11.0, -2.0].map(|x| ProbeVector { cos_um: part(x), sin_um: part(x - 1.0) });
    Reading::new(9000.0, &vectors).unwrap()
}

fn some(number: usize, seed: u64) -> Vec<Reading> {
    let mut random = Random::new(seed);
    (0..number).map(|_| moving(&mut random, 0.1)).collect()
}

/// Chance of `k` repeats in a row whose chance has the distribution Beta(a, b): by quadrature.
fn chance_of_run(a: f64, b: f64, k: i32) -> f64 {
    const STEPS: i32 = 400_000;
    let moment = |power: f64| -> f64 {
        let density = |step: i32| {
            let p = (f64::from(step) + 0.5) / f64::from(STEPS);
            ((power + a - 1.0) * p.ln() + (b - 1.0) * (1.0 - p).ln()).exp()
        };
        (0..STEPS).map(density).sum()
    };
    moment(f64::from(k)) / moment(0.0)
}

#[test]
fn chance_of_a_run_is_that_of_its_posterior() {
    for (c, r, next_c, next_r, k) in
        [(0, 0, 0, 0, 3), (0, 0, 0, 0, 60), (7, 2, 20, 1, 9), (100, 90, 4, 2, 20)]
    {
        let after_move = Counts { comparisons: c, repeats: r };
        let after_repeat = Counts { comparisons: next_c, repeats: next_r };
        let mut run = Run { after_move, after_repeat, ..Run::NONE };
        for _ in 0..k {
            assert!(!run.is_too_long(true));
        }
        let first = f64::from(r + 1) / f64::from(c + 5);
        // With the first repeat counted.
        let (weight, mean) = (f64::from(c + 6).min(16.0), f64::from(r + 2) / f64::from(c + 6));
        let a = f64::from(next_r) + weight * mean;
        let b = f64::from(next_c - next_r) + weight * (1.0 - mean);
        let expected = first * chance_of_run(a, b, k - 1);
        assert!((f64::from(run.chance) / expected - 1.0).abs() < 1e-2, "{c} {r} {k}: {expected}");
    }
}

#[test]
fn identical_readings_are_excessive_by_the_chance_of_the_run() {
    for (before, repeats) in [(0, 68), (60, 6), (600, 3), (2000, 2), (5000, 2)] {
        // The first of them does not repeat.
        let mut sender = Sender::default();
        assert_eq!(sender.first_excess(some(before, 1)), None);
        let stale = some(1, 2)[0];
        assert_eq!(sender.first_excess([stale; 1800]), Some((repeats, u8::MAX)), "after {before}");
    }
    // The first value is that of Beta(1, 4) alone.
    assert!(chance_of_run(1.0, 4.0, 68) < 1e-6 && chance_of_run(1.0, 4.0, 67) > 1e-6);
}

#[test]
fn a_reading_that_moves_ends_an_excessive_run() {
    let mut sender = Sender::default();
    sender.first_excess(some(100, 1));
    for (number, fresh) in some(100, 3).into_iter().enumerate() {
        assert_eq!(sender.send(fresh).excess_mask, 0, "{number}");
        // A sender that is stuck again and again is not the usual one.
        assert_eq!(sender.first_excess([fresh; 40]).map(|(at, _)| at), Some(4), "{number}");
    }
}

#[test]
fn one_frozen_probe_is_named_while_others_move() {
    for probe in 0..4 {
        let mut sender = Sender::default();
        assert_eq!(sender.first_excess(some(100, 4)), None);
        let frozen = some(1, 5)[0];
        let partly = some(20, 6).into_iter().map(|reading| {
            let mut vectors = reading.probes().to_vec();
            vectors[probe] = frozen.probes()[probe];
            Reading::new(9000.0, &vectors).unwrap()
        });
        assert_eq!(sender.first_excess(partly), Some((5, 1 << probe)));
    }
}

#[test]
fn values_of_a_probe_that_is_lost_at_times_repeat_all_the_same() {
    let mut random = Random::new(8);
    let mut repeats = Repeats::default();
    let mut last = [ProbeVector::LOST; MAX_PROBES];
    let mut excess = 0;
    for step in 0..200 {
        let mut vectors = moving(&mut random, 0.1).probes().to_vec();
        vectors[2] = if step % 2 == 0 { ProbeVector { cos_um: 1.0, sin_um: 2.0 } } else { ProbeVector::LOST };
        let reading = Reading::new(9000.0, &vectors).unwrap();
        excess |= repeats.update(&last, &reading).excess_mask;
        for (last, &now) in last.iter_mut().zip(&vectors).filter(|(_, now)| now.is_finite()) {
            *last = now;
        }
    }
    assert_eq!(excess, 0b0100);
}

#[test]
fn a_loop_is_found_up_to_the_length_of_the_history() {
    for length in [2, 3, 10, 63, HISTORY] {
        let mut sender = Sender::default();
        assert_eq!(sender.first_excess(some(100, 1)), None);
        let cycle = some(length, 9);
        // Once round, one reading to choose the distance, and a run of four or five at a chance of 1/160 or 1/100.
        let mut masks = (0..300).map(|step| sender.send(cycle[step % length]).excess_mask);
        let found = masks.position(|mask| mask == u8::MAX);
        assert!(found.is_some_and(|found| (length + 4..=length + 5).contains(&found)), "{length}: {found:?}");
        assert!(masks.all(|mask| mask == u8::MAX), "{length}");
        assert_eq!(sender.first_excess(some(100, 10)), None, "{length}");
    }
    let longer = some(HISTORY + 1, 9);
    assert_eq!(Sender::default().first_excess((0..1000).map(|step| longer[step % longer.len()])), None);
}

#[test]
fn a_loop_with_each_reading_sent_twice_is_found() {
    let mut sender = Sender::default();
    let cycle = some(10, 9);
    assert_eq!(sender.first_excess(some(100, 1).into_iter().flat_map(|reading| [reading; 2])), None);
    let found = sender.first_excess((0..300).map(|step| cycle[step / 2 % 10]));
    assert!(found.is_some_and(|(at, mask)| mask == u8::MAX && at < 40), "{found:?}");
}

/// Deviation of the noise and step of rounding, µm. A step of 1 µm leaves a deviation of 0.29 µm by itself.
const ROUNDINGS: [(f32, Option<f32>); 5] =
    [(0.1, Some(1e-5)), (0.1, Some(0.01)), (0.1, Some(0.1)), (0.3, Some(1.0)), (0.3, None)];

/// Runs of excess among readings.
fn excess_runs(readings: impl IntoIterator<Item = Reading>) -> usize {
    let mut sender = Sender::default();
    let excess = readings.into_iter().map(|reading| sender.send(reading).excess_mask != 0);
    let excess: Vec<_> = excess.collect();
    excess.windows(2).filter(|pair| pair[1] && !pair[0]).count()
}

#[test]
fn rounded_and_held_values_repeat_as_often_as_chance_allows() {
    let mut coarse = 0;
    for (number, (sigma_um, step_um)) in ROUNDINGS.into_iter().enumerate() {
        for hold in [1, 2, 5, 20] {
            let mut random = Random::new(100 * number as u64 + hold);
            let readings = (0..20_000 / hold).flat_map(|_| {
                let reading = rounded(&moving(&mut random, sigma_um), step_um);
                (0..hold).map(move |_| reading)
            });
            let runs = excess_runs(readings);
            assert!(number >= 2 || runs == 0, "rounding {number}, each {hold} times");
            coarse += runs;
        }
    }
    // Of 240,000 readings that often repeat, in six runs at once: at 1e-6 one or two, somewhat more as their chances differ.
    assert!(coarse <= 6, "{coarse}");
}

#[test]
fn a_resolution_that_hides_the_noise_is_seldom_excessive() {
    // A step of ten deviations, the mean two of them from an edge: one part of eight moves in forty readings.
    let mut random = Random::new(3);
    let mut part = || (0.3 + 0.1 * normal(&mut random)).round();
    let mut vector = || ProbeVector { cos_um: 5.0 + part(), sin_um: 3.0 + part() };
    let runs =
        excess_runs((0..50_000).map(|_| Reading::new(9000.0, &[vector(), vector(), vector()]).unwrap()));
    assert!(runs <= 4, "{runs}");
}
