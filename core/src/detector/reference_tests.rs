use std::vec::Vec;

use nalgebra::Complex;

use super::*;
use crate::model::{MAX_PLANES, Noise, Pair};
use crate::reading::{ProbeVector, Reading};
use crate::testing::Random;

type C = Complex<f32>;

const THRESHOLDS: Thresholds = Thresholds::DEFAULT;
const SECOND_US: u64 = 1_000_000;
const DAY_US: u64 = 86_400 * SECOND_US;
const PERIOD_US: u64 = 87_000;
const PACES_US: [u64; 4] = [PERIOD_US, SECOND_US, 3600 * SECOND_US, DAY_US];
const SPEED_RPM: f32 = 9000.0;
const BEARINGS: [u8; 8] = [0, 0, 1, 1, 0, 0, 0, 0];
/// Of two planes and four probes, g·mm and µm.
const UNBALANCE: [C; 2] = [C::new(60.0, 80.0), C::new(-30.0, 40.0)];
const VECTORS: [C; 4] = [C::new(10.0, 2.0), C::new(-1.0, 8.0), C::new(4.0, -6.0), C::new(3.0, 5.0)];
const ONE: C = C::new(1.0, 0.0);

fn turn(degrees: f32) -> C {
    let (sin, cos) = degrees.to_radians().sin_cos();
    C::new(cos, sin)
}

fn observation(speed_rpm: f32, unbalance: [C; 2], vectors: [C; 4]) -> Observation {
    let reading = Reading::new(speed_rpm, &vectors.map(ProbeVector::from_phasor)).unwrap();
    let mut unbalance_g_mm = [[0.0; 2]; MAX_PLANES];
    for (own, plane) in unbalance_g_mm.iter_mut().zip(unbalance) {
        *own = [plane.re, plane.im];
    }
    Observation {
        averaged: Average::default().update(1.0, 0, &reading),
        noise: Noise { relative: 0.0, floor_um: 0.01 },
        unbalance_g_mm,
        planes: 2,
        deviation_g_mm: [0.1; MAX_PLANES],
        misfit_g_mm: [0.1; MAX_PLANES],
        floor_g_mm: 1.0,
    }
}

/// The machine with all its vectors, and so its unbalance, times a factor.
fn times(factor: C) -> Observation {
    observation(SPEED_RPM, UNBALANCE.map(|u| factor * u), VECTORS.map(|z| factor * z))
}

/// Takes a reading as a detector does, and tells whether it changed too much.
fn take(reference: &mut Reference, time_us: u64, observed: &Observation) -> bool {
    let part = reference.advance(&THRESHOLDS, time_us);
    let is_changed = reference.is_changed(&THRESHOLDS, observed);
    if !is_changed {
        reference.trust(&THRESHOLDS, observed, part, true);
    }
    is_changed
}

fn settled(period_us: u64) -> (Reference, u64) {
    let mut reference = Reference::default();
    for step in 0..30 {
        assert!(!take(&mut reference, step * period_us, &times(ONE)));
    }
    (reference, 30 * period_us)
}

#[test]
fn allowed_step_passes_and_larger_change_does_not() {
    for period_us in PACES_US {
        let (reference, time_us) = settled(period_us);
        let is_changed = |factor: C| take(&mut { reference }, time_us, &times(factor));
        // A turn of φ moves the vector by 2 sin(φ/2): 0.19 for 11°, 0.52 for 30°.
        for factor in [1.19 * ONE, 0.81 * ONE, turn(11.0), turn(-11.0), 0.9 * turn(9.0)] {
            assert!(!is_changed(factor), "{factor} at {period_us} us");
        }
        for factor in [1.3 * ONE, 0.7 * ONE, 0.0 * ONE, turn(30.0), turn(-30.0), turn(180.0)] {
            assert!(is_changed(factor), "{factor} at {period_us} us");
        }
    }
}

#[test]
fn one_changed_plane_of_two_is_enough() {
    let (reference, time_us) = settled(SECOND_US);
    for plane in 0..2 {
        let mut unbalance = UNBALANCE;
        unbalance[plane] *= 1.3;
        let observed = observation(SPEED_RPM, unbalance, VECTORS);
        assert!(take(&mut { reference }, time_us, &observed), "plane {plane}");
    }
}

/// The first reading that changed too much while all turns and grows by so much a day.
fn first_changed(period_us: u64, days: f64, a_day: impl Fn(f64) -> C) -> Option<u64> {
    let (mut reference, start_us) = settled(period_us);
    let mut time_us = start_us;
    while (time_us - start_us) as f64 <= days * DAY_US as f64 {
        let passed = (time_us - start_us) as f64 / DAY_US as f64;
        if take(&mut reference, time_us, &times(a_day(passed))) {
            return Some(time_us - start_us);
        }
        time_us += period_us;
    }
    None
}

#[test]
fn walk_within_the_allowed_pace_passes_in_any_direction() {
    for period_us in [10 * SECOND_US, 3600 * SECOND_US, DAY_US] {
        let growth = |days: f64| ONE * 1.15_f64.powf(days) as f32;
        let decline = |days: f64| ONE * 0.87_f64.powf(days) as f32;
        let turning = |days: f64| turn(8.0 * days as f32);
        assert_eq!(first_changed(period_us, 10.0, growth), None, "growth, {period_us} us");
        assert_eq!(first_changed(period_us, 10.0, decline), None, "decline, {period_us} us");
        assert_eq!(first_changed(period_us, 45.0, turning), None, "turning, {period_us} us");
    }
}

#[test]
fn walk_of_two_turns_in_an_hour_is_seen_in_a_minute() {
    // 0.2 and 7.52 deviations of a hundred g·mm and of the anchor are 0.21: 12° at 0.2° a second.
    let seen_us = first_changed(PERIOD_US, 0.05, |days| turn(days as f32 * 24.0 * 720.0)).unwrap();
    assert!((50 * SECOND_US..70 * SECOND_US).contains(&seen_us), "{seen_us} us");
}

#[test]
fn change_stays_suspicious_until_it_is_undone() {
    let (mut reference, mut time_us) = settled(PERIOD_US);
    let before = times(turn(40.0));
    for _ in 0..100 {
        time_us += 3600 * SECOND_US;
        assert!(take(&mut reference, time_us, &before), "four days do not make it usual");
    }
    assert!(!take(&mut reference, time_us + PERIOD_US, &times(ONE)));
}

#[test]
fn month_of_standstill_allows_the_same_step() {
    let (reference, time_us) = settled(PERIOD_US);
    let later_us = time_us + 30 * DAY_US;
    assert!(!take(&mut { reference }, later_us, &times(1.19 * ONE)));
    assert!(take(&mut { reference }, later_us, &times(1.3 * ONE)));
}

#[test]
fn after_power_cut_the_last_trusted_estimate_is_the_anchor() {
    let trusted: Vec<Pair> = UNBALANCE.iter().map(|u| [u.re, u.im]).collect();
    let most: Vec<f32> = UNBALANCE.iter().map(|u| crate::scalar::length([u.re, u.im]) + 7.52 * 0.1).collect();
    let reference = Reference::resume(&trusted, &most);
    assert!(!take(&mut { reference }, 5, &times(1.19 * ONE)));
    for factor in [1.3 * ONE, 0.7 * ONE, turn(30.0)] {
        assert!(take(&mut { reference }, 5, &times(factor)), "{factor}");
    }
    let open = Reference::resume(&trusted, &[f32::MAX; 2]);
    assert!(!take(&mut { open }, 5, &times(3.0 * ONE)), "the first reading is the anchor");
    assert_eq!(Reference::resume(&[], &[]), Reference::default());
}

#[test]
fn uninformative_estimates_neither_alarm_nor_move_the_anchor() {
    let (mut reference, mut time_us) = settled(PERIOD_US);
    let mut random = Random::new(3);
    for _ in 0..2000 {
        time_us += 600 * SECOND_US;
        let noise = [C::new(random.signed(), random.signed()), C::new(random.signed(), random.signed())];
        let slow = Observation {
            deviation_g_mm: [100.0; MAX_PLANES],
            misfit_g_mm: [100.0; MAX_PLANES],
            ..observation(2000.0, [UNBALANCE[0] + noise[0] * 170.0, UNBALANCE[1] + noise[1] * 170.0], VECTORS)
        };
        assert!(!take(&mut reference, time_us, &slow));
    }
    // Two weeks later the full speed tells whether the anchor is where it was, to a few per cent.
    for factor in [1.15 * ONE, 0.85 * ONE] {
        assert!(!take(&mut { reference }, time_us + SECOND_US, &times(factor)));
    }
    for factor in [1.3 * ONE, 0.7 * ONE, turn(30.0)] {
        assert!(take(&mut { reference }, time_us + SECOND_US, &times(factor)), "{factor}");
    }
}

/// What a model gets wrong at another speed, which its residual shows there.
fn elsewhere(factor: C) -> Observation {
    let wrong = 1.3 * turn(20.0);
    Observation {
        misfit_g_mm: [10.0; MAX_PLANES],
        ..observation(6000.0, UNBALANCE.map(|u| factor * wrong * u), VECTORS.map(|z| 0.5 * factor * z))
    }
}

#[test]
fn what_the_model_gets_wrong_at_a_speed_is_not_a_change() {
    let (mut reference, mut time_us) = settled(PERIOD_US);
    for step in 0..200 {
        time_us += 60 * SECOND_US;
        let observed = if step / 10 % 2 == 0 { elsewhere(ONE) } else { times(ONE) };
        assert!(!take(&mut reference, time_us, &observed), "step {step}");
    }
    for factor in [1.3 * ONE, 0.7 * ONE, turn(30.0)] {
        assert!(take(&mut { reference }, time_us, &times(factor)), "{factor}");
        assert!(take(&mut { reference }, time_us, &elsewhere(factor)), "{factor} elsewhere");
    }
    // Ten days of growth at the one speed are known at the other.
    for day in 1..=10 {
        let grown = times(ONE * 1.15_f32.powi(day));
        assert!(!take(&mut reference, time_us + day as u64 * DAY_US, &grown), "day {day}");
    }
    let grown = ONE * 1.15_f32.powi(10);
    assert!(!take(&mut reference, time_us + 11 * DAY_US, &elsewhere(grown)));
}

#[test]
fn speeds_passed_through_do_not_displace_settled_ones() {
    let (mut reference, mut time_us) = settled(SECOND_US);
    for rpm in (1000_u16..8900).chain((1000..8900).rev()).step_by(10) {
        time_us += PERIOD_US;
        let passing = observation(rpm.into(), UNBALANCE, VECTORS.map(|z| 0.1 * z));
        let part = reference.advance(&THRESHOLDS, time_us);
        reference.trust(&THRESHOLDS, &passing, part, false);
    }
    assert_eq!(reference.cause(&times(turn(90.0)), &BEARINGS, true), Some((Reason::Keyphasor, 0)));
}

// What changed.

fn cause(vectors: [C; 4], unbalance: [C; 2], fits: bool) -> Option<(Reason, u8)> {
    let (reference, _) = settled(SECOND_US);
    reference.cause(&observation(SPEED_RPM, unbalance, vectors), &BEARINGS, fits)
}

#[test]
fn common_factor_is_keyphasor_or_scale_by_the_greater_part() {
    for fits in [true, false] {
        let of = |factor: C| cause(VECTORS.map(|z| factor * z), UNBALANCE.map(|u| factor * u), fits);
        for factor in [turn(15.0), turn(-90.0), turn(180.0), 0.8 * turn(40.0)] {
            assert_eq!(of(factor), Some((Reason::Keyphasor, 0)), "{factor}");
        }
        for factor in [0.1 * ONE, 0.5 * ONE, 1.4 * ONE, 3.0 * turn(20.0), 0.0 * ONE] {
            assert_eq!(of(factor), Some((Reason::Scale, 0)), "{factor}");
        }
    }
}

#[test]
fn factor_that_one_changed_plane_explains_too_is_no_cause() {
    let factor = 1.5 * ONE;
    // The other plane's unbalance is so small that it does not show whether it changed.
    let mut reference = Reference::default();
    let single = |factor: C| {
        let unbalance = [factor * UNBALANCE[0], factor * C::new(0.5, 0.0)];
        observation(SPEED_RPM, unbalance, VECTORS.map(|z| factor * z))
    };
    take(&mut reference, 0, &single(ONE));
    assert_eq!(reference.cause(&single(factor), &BEARINGS, true), None);
    // A fixed part turns as well: no unbalance explains that.
    assert_eq!(reference.cause(&single(factor), &BEARINGS, false), Some((Reason::Scale, 0)));
}

#[test]
fn one_probe_is_named_where_the_model_misfits() {
    for probe in 0..4 {
        let mut vectors = VECTORS;
        vectors[probe] *= -0.5;
        assert_eq!(cause(vectors, UNBALANCE, false), Some((Reason::Probe, 1 << probe)));
        assert_eq!(cause(vectors, UNBALANCE, true), None, "a changed unbalance explains it");
    }
    // of a bearing's probes the suspect tells, and no factor common to all is blamed
    for bearing in 0..2 {
        let mut vectors = VECTORS;
        for vector in &mut vectors[2 * bearing..2 * bearing + 2] {
            *vector *= turn(60.0);
        }
        assert_eq!(cause(vectors, UNBALANCE, false), None);
    }
    let unlike = [VECTORS[0] * 2.0, VECTORS[1] * -1.0, VECTORS[2] * turn(90.0), VECTORS[3]];
    assert_eq!(cause(unlike, UNBALANCE, false), None);
}

#[test]
fn cause_is_unknown_at_another_speed_and_within_the_noise() {
    let (reference, _) = settled(SECOND_US);
    let fast = observation(9100.0, UNBALANCE, VECTORS.map(|z| turn(90.0) * z));
    assert_eq!(reference.cause(&fast, &BEARINGS, false), None);
    let noisy = Observation { noise: Noise { relative: 0.0, floor_um: 3.0 }, ..times(turn(20.0)) };
    assert_eq!(reference.cause(&noisy, &BEARINGS, false), None);
}

#[test]
fn lost_probe_takes_no_part_in_the_cause() {
    let (reference, _) = settled(SECOND_US);
    let mut observed = times(turn(50.0));
    observed.averaged.reading.lose(0b0100);
    assert_eq!(reference.cause(&observed, &BEARINGS, true), Some((Reason::Keyphasor, 0)));
}

#[test]
fn reference_takes_six_hundred_bytes() {
    assert!(size_of::<Reference>() <= 600, "{}", size_of::<Reference>());
}

#[test]
fn ten_thousand_noisy_estimates_change_nothing_at_any_pace() {
    // 20 % of the smaller plane, where six deviations alone are far beyond the allowed step.
    const DEVIATION: f32 = 10.0;
    let mut random = Random::new(9);
    let mut normal = || (0..12).map(|_| random.signed()).sum::<f32>() / 2.0;
    for period_us in PACES_US {
        let mut reference = Reference::default();
        for step in 0..10_000 {
            let noisy = UNBALANCE.map(|u| u + C::new(normal(), normal()) * DEVIATION);
            let observed = Observation {
                deviation_g_mm: [DEVIATION; MAX_PLANES],
                misfit_g_mm: [DEVIATION; MAX_PLANES],
                ..observation(SPEED_RPM, noisy, VECTORS)
            };
            assert!(!take(&mut reference, step * period_us, &observed), "step {step} at {period_us} us");
        }
    }
}
