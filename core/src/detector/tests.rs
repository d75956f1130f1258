use std::vec::Vec;

use super::*;
use crate::model::{MAX_PLANES, Noise};
use crate::reading::{ProbeVector, Reading};

const DAY_US: u64 = 86_400_000_000;
/// 11.5 readings a second, as the board makes them.
const PERIOD_US: u64 = 87_000;
const THRESHOLDS: Thresholds = Thresholds::DEFAULT;

/// Four probes, two at each bearing, `e_um` at the first probe of one of them and a feature sum of 100 µm.
fn evidence(e_um: f32, bearing: usize) -> Evidence {
    let measured = [ProbeVector { cos_um: 12.5, sin_um: 12.5 }; 4];
    let mut calculated = measured;
    calculated[2 * bearing].cos_um += e_um;
    let reading = Reading::new(9000.0, &measured).unwrap();
    Evidence {
        residual: Residual::new(&calculated, &measured).unwrap(),
        free_residual_um: e_um,
        redundancy: 4,
        floor_um: 0.0,
        bearings: [0, 0, 1, 1, 0, 0, 0, 0],
        observation: Observation {
            averaged: Average::default().update(1.0, 0, &reading),
            noise: Noise::default(),
            unbalance_g_mm: [[100.0, 0.0], [0.0, 50.0], [0.0; 2], [0.0; 2]],
            planes: 2,
            deviation_g_mm: [f32::NAN; MAX_PLANES],
            misfit_g_mm: [f32::NAN; MAX_PLANES],
            floor_g_mm: 0.0,
        },
        raw: Reason::None,
    }
}

/// The verdicts on one residual a period.
fn run(
    detector: &mut Detector,
    period_us: u64,
    residuals: impl IntoIterator<Item = Evidence>,
) -> Vec<ResidualVerdict> {
    let start_us = detector.judged_us().map_or(0, |judged_us| judged_us + period_us);
    let mut verdicts = Vec::new();
    for (time_us, evidence) in (0..).map(|n| start_us + n * period_us).zip(residuals) {
        verdicts.push(detector.update(&THRESHOLDS, time_us, &evidence));
    }
    verdicts
}

fn first_flag(verdicts: &[ResidualVerdict]) -> Option<usize> {
    verdicts.iter().position(|verdict| verdict.flagged)
}

#[test]
fn lasting_rise_in_daily_record_is_flagged_at_third_reading() {
    let residuals = [evidence(10.0, 0); 10].into_iter().chain([evidence(20.0, 1); 4]);
    let mut detector = Detector::default();
    let verdicts = run(&mut detector, DAY_US, residuals);
    assert_eq!(first_flag(&verdicts), Some(12));
    assert_eq!((verdicts[12].suspect, verdicts[12].reason), (Some(1), Reason::Rise));
    assert_eq!((verdicts[11].suspect, verdicts[11].streak), (None, 2));
    assert_eq!(verdicts[13].streak, 4);
    assert_eq!(detector.latched(), Some(LatchedFlag { cause: Reason::Rise, suspect: Some(1) }));
}

#[test]
fn lasting_rise_at_full_rate_is_flagged_after_persistence() {
    let residuals = [evidence(10.0, 0); 1000].into_iter().chain([evidence(20.0, 1); 200]);
    let flag = first_flag(&run(&mut Detector::default(), PERIOD_US, residuals)).unwrap();
    let after_s = (flag - 1000) as f64 * PERIOD_US as f64 * 1e-6;
    assert!((10.0..10.1).contains(&after_s), "{after_s}");
}

#[test]
fn a_single_bad_reading_is_suspicious_but_never_flagged() {
    let residuals =
        [evidence(10.0, 0); 5].into_iter().chain([evidence(30.0, 0)]).chain([evidence(10.0, 0); 5]);
    let mut detector = Detector::default();
    let verdicts = run(&mut detector, DAY_US, residuals);
    assert!(verdicts[5].is_suspicious() && first_flag(&verdicts).is_none());
    assert_eq!((verdicts[6].streak, detector.latched()), (0, None));
}

#[test]
fn an_event_does_not_raise_the_level_it_is_measured_by() {
    let residuals = [evidence(10.0, 0); 5].into_iter().chain([evidence(20.0, 0); 30]);
    let verdicts = run(&mut Detector::default(), DAY_US, residuals);
    assert!((verdicts.last().unwrap().level_um - 10.0).abs() < 1e-4);
}

#[test]
fn a_large_rise_of_a_negligible_residual_is_not_suspicious() {
    let residuals = [evidence(1.0, 0); 5].into_iter().chain([evidence(9.0, 0)]);
    assert!(!run(&mut Detector::default(), DAY_US, residuals)[5].is_suspicious());
}

#[test]
fn a_third_of_the_features_is_suspicious_from_the_first_reading() {
    assert_eq!(run(&mut Detector::default(), DAY_US, [evidence(34.0, 0)])[0].reason, Reason::Ratio);
    assert_eq!(run(&mut Detector::default(), DAY_US, [evidence(32.0, 0)])[0].reason, Reason::None);
}

#[test]
fn nothing_is_suspicious_up_to_the_floor() {
    let noisy = Evidence { floor_um: 40.0, ..evidence(40.0, 0) };
    assert_eq!(run(&mut Detector::default(), DAY_US, [noisy])[0].reason, Reason::None);
    let above = Evidence { floor_um: 39.9, ..noisy };
    assert_eq!(run(&mut Detector::default(), DAY_US, [above])[0].reason, Reason::Ratio);
    let thresholds = Thresholds { floor_um: 50.0, ..THRESHOLDS };
    assert_eq!(Detector::default().update(&thresholds, 0, &above).reason, Reason::None);
}

#[test]
fn unbalance_jump_is_distinguished_from_misfit() {
    let jumped = Evidence { free_residual_um: 10.0, ..evidence(30.0, 0) };
    let residuals = [evidence(10.0, 0); 5].into_iter().chain([jumped; 3]);
    let mut detector = Detector::default();
    let verdicts = run(&mut detector, DAY_US, residuals);
    assert_eq!((verdicts[7].reason, verdicts[7].flagged), (Reason::Jump, true));
    assert_eq!(detector.latched().map(|latched| latched.cause), Some(Reason::Jump));
}

#[test]
fn scatter_of_raw_readings_is_flagged_unless_residual_says_more() {
    let scattering = |e_um| Evidence { raw: Reason::Scatter, ..evidence(e_um, 1) };
    let residuals =
        [evidence(10.0, 0); 10].into_iter().chain([scattering(10.0); 3]).chain([scattering(20.0)]);
    let mut detector = Detector::default();
    let verdicts = run(&mut detector, DAY_US, residuals);
    assert_eq!((verdicts[10].reason, verdicts[10].flagged), (Reason::Scatter, false));
    assert_eq!((verdicts[12].reason, verdicts[12].flagged), (Reason::Scatter, true));
    assert_eq!((verdicts[12].level_um, verdicts[13].reason), (10.0, Reason::Rise));
    assert_eq!(detector.latched().map(|latched| latched.cause), Some(Reason::Scatter));
}

#[test]
fn fault_too_slow_for_the_level_is_seen_against_the_reference() {
    // One reading an hour; e grows from 10 by a factor of e in 100 days, so the level of ten days always lags by 10 %.
    let residuals = (0..100 * 24).map(|hour| evidence(10.0 * (hour as f32 / 2400.0).exp(), 1));
    let verdicts = run(&mut Detector::default(), DAY_US / 24, residuals);
    let flag = first_flag(&verdicts).unwrap();
    assert_eq!(verdicts[flag].reason, Reason::Reference);
    let e_um = verdicts[flag].residual.e_um;
    assert!((15.0..15.2).contains(&e_um), "{e_um}");
}

#[test]
fn fifteenfold_residual_growth_is_flagged_at_any_rate() {
    for (growth_s, period_s) in [
        (3.0, 0.087),
        (36.0, 0.087),
        (360.0, 0.087),
        (3600.0, 0.5),
        (86_400.0, 12.0),
        (30.0 * 86_400.0, 60.0),
        (30.0 * 86_400.0, 86_400.0),
    ] {
        let healthy = ((300.0 / period_s) as usize).max(20);
        let grown = (growth_s / period_s) as usize;
        let after = ((20.0 / period_s) as usize).max(4);
        for shape in 0..3 {
            let e = |step: usize| {
                let part = (step as f64 / grown.max(1) as f64).min(1.0);
                let factor = match shape {
                    0 => 1.0 + 14.0 * part,
                    1 => 15.0_f64.powf(part),
                    _ => 1.0 + 14.0 * part * part,
                };
                evidence((2.0 * factor) as f32, 0)
            };
            let residuals = (0..healthy).map(|_| evidence(2.0, 0)).chain((0..grown + after).map(e));
            let verdicts = run(&mut Detector::default(), (period_s * 1e6) as u64, residuals);
            let flag = first_flag(&verdicts);
            assert!(
                flag.is_some_and(|flag| flag >= healthy),
                "{growth_s} s, {period_s} s a reading, shape {shape}"
            );
        }
    }
}

#[test]
fn levels_of_partial_readings_are_held_against_fewer_rows() {
    let mut detector = Detector::default();
    run(&mut detector, DAY_US, [evidence(16.0, 0); 12]);
    // two rows left of four: half the level
    let partial = |e_um| Evidence { redundancy: 2, ..evidence(e_um, 0) };
    let fine = run(&mut detector, DAY_US, [partial(11.9)])[0];
    assert_eq!((fine.reason, fine.level_um, fine.reference_um), (Reason::None, 8.0, Some(8.0)));
    // 11.9 of ten days' readings has raised the level to 8.39: half as much again is 12.6
    assert_eq!(run(&mut detector, DAY_US, [partial(12.5)])[0].reason, Reason::Reference);
    assert_eq!(run(&mut detector, DAY_US, [partial(12.7)])[0].reason, Reason::Rise);
}

#[test]
fn learning_needs_time_and_readings_and_baseline_then_stays() {
    let mut detector = Detector::default();
    run(&mut detector, PERIOD_US, [evidence(10.0, 0); 600]);
    assert!(detector.is_learning(), "52 s");
    run(&mut detector, PERIOD_US, [evidence(10.0, 0); 100]);
    assert!(!detector.is_learning(), "61 s");
    let mut daily = Detector::default();
    run(&mut daily, DAY_US, [evidence(10.0, 0); 9]);
    assert!(daily.is_learning(), "9 readings");
    run(&mut daily, DAY_US, [evidence(10.0, 0); 1]);
    let verdicts = run(&mut daily, DAY_US, [evidence(14.0, 0); 100]);
    let last = verdicts.last().unwrap();
    assert_eq!(last.reference_um, Some(10.0));
    assert!(last.level_um > 13.9);
}

#[test]
fn an_acknowledged_flag_is_raised_again_by_what_still_misfits() {
    let mut detector = Detector::default();
    run(&mut detector, DAY_US, [evidence(10.0, 0); 10].into_iter().chain([evidence(20.0, 0); 5]));
    assert!(detector.latched().is_some());
    let healthy = run(&mut detector, DAY_US, [evidence(10.0, 0); 50]);
    assert!(detector.latched().is_some() && !healthy[49].flagged, "healthy readings do not lower it");
    detector.acknowledge();
    assert_eq!(detector.latched(), None);
    run(&mut detector, DAY_US, [evidence(20.0, 0); 2]);
    assert_eq!(detector.latched(), None);
    run(&mut detector, DAY_US, [evidence(20.0, 0); 1]);
    assert!(detector.latched().is_some());
}

#[test]
fn suspect_bearing_has_greatest_residual_per_remaining_probe() {
    // Both bearings misfit; bearing 2 more a probe, although it has lost one and its sum is less.
    let measured = [ProbeVector { cos_um: 12.5, sin_um: 12.5 }; 4];
    let mut lost = measured;
    lost[3] = ProbeVector::LOST;
    let mut calculated = measured;
    (calculated[0].cos_um, calculated[1].cos_um, calculated[2].cos_um) = (32.5, 32.5, 42.5);
    let partial = Evidence {
        residual: Residual::new(&calculated, &lost).unwrap(),
        free_residual_um: 70.0,
        redundancy: 2,
        ..evidence(0.0, 0)
    };
    let verdicts = run(&mut Detector::default(), DAY_US, [partial; 3]);
    assert_eq!(verdicts[2].suspect, Some(1));
}

#[test]
fn a_clock_that_goes_back_harms_nothing() {
    let mut detector = Detector::default();
    for time_us in [1_000_000, 0, 5, 3, 900_000] {
        let verdict = detector.update(&THRESHOLDS, time_us, &evidence(10.0, 0));
        assert!(!verdict.is_suspicious() && verdict.level_um.is_finite());
    }
}
