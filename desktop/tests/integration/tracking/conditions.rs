//! Records with a column of the oil's temperature, which the bearings follow or do not.

use rayon::prelude::*;
use rotor_edge_desktop::measurement::{Condition, ConditionUnit};
use rotor_edge_desktop::track::{ConditionEffect, Config, Method, track};

use super::generator::{Plan, TURBINE};
use super::sampled;
use super::score::{Judged, Summary};

/// Change of the stiffness's logarithm for 10 °C.
const PER_TEN: [f64; 2] = [-0.15, -0.10];

fn plan(seed: u64, heat: [f64; 2]) -> Plan {
    Plan { heat: Some(heat), ..Plan::quiet(TURBINE, 1_000 + seed) }
}

fn oil() -> Condition {
    Condition { name: "oil_temperature".into(), unit: ConditionUnit::DegreeCelsius }
}

/// A record followed with its column or without.
fn followed(plan: &Plan, with_column: bool) -> Judged {
    let conditions = if with_column { vec![oil()] } else { Vec::new() };
    Judged::by(plan, &plan.make(), &Config { conditions, ..Config::new(Method::Joint) }).unwrap()
}

fn only(judged: &Judged) -> &ConditionEffect {
    let [effect] = judged.conditions() else { panic!("{}", judged.line()) };
    effect
}

#[test]
fn stiffness_that_follows_temperature_is_found_with_its_size() {
    let plan = Plan { days: 240, ..plan(0, PER_TEN) };
    let judged = followed(&plan, true);
    println!("{} {:?}", judged.line(), judged.conditions());
    let effect = only(&judged);
    assert_eq!((&effect.condition, effect.step), (&oil(), 10.0));
    assert!(!effect.bearings.is_empty(), "{effect:?}");
    for found in &effect.bearings {
        let off = (found.stiffness.log - PER_TEN[found.bearing]) / found.stiffness.sd;
        assert!(off.abs() < 3.0, "{off}: {found:?}");
    }
}

#[test]
fn temperature_that_bearings_do_not_follow_is_not_used() {
    let judged = followed(&Plan { days: 240, ..plan(1, [0.0; 2]) }, true);
    println!("{} {:?}", judged.line(), judged.conditions());
    assert!(!only(&judged).is_used() && only(&judged).evidence < 0.0, "{:?}", judged.conditions());
}

#[test]
fn lost_temperatures_are_interpolated_mostly_lost_ones_refused() {
    let plan = Plan { days: 240, ..plan(0, PER_TEN) };
    let config = Config { conditions: vec![oil()], ..Config::new(Method::Joint) };
    let lost_but = |every: usize| {
        let mut record = plan.make();
        let keep = |k: usize| k.is_multiple_of(every);
        let lost = record.readings.iter_mut().enumerate().filter(|(k, _)| !keep(*k));
        lost.for_each(|(_, reading)| reading.conditions = vec![None]);
        Judged::by(&plan, &record, &config).unwrap()
    };
    assert!(only(&lost_but(2)).is_used());
    let refused = lost_but(4);
    assert!(refused.conditions().is_empty());
    let remark = refused.remarks().iter().find(|r| r.contains("oil_temperature_degc")).unwrap();
    assert!(remark.contains("expected at least half"), "{remark}");
}

#[test]
fn other_methods_say_that_they_use_no_conditions() {
    let plan = Plan { days: 30, ..plan(0, PER_TEN) };
    let config = Config { conditions: vec![oil()], ..Config::new(Method::Adaptive) };
    let record = plan.make();
    let found = track(&record.rotor, &record.readings, &record.runup, &[], &config, &mut |_, _| ()).unwrap();
    let said = |r: &&String| r.contains("(oil_temperature_degc); --method joint does");
    assert_eq!(found.remarks.iter().filter(said).count(), 1, "{:?}", found.remarks);
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn intervals_hold_where_bearings_follow_temperature() {
        let of = |with_column: bool| -> Vec<Judged> {
            let seeds: Vec<u64> = sampled(0..8).collect();
            seeds.into_par_iter().map(|seed| followed(&plan(seed, PER_TEN), with_column)).collect()
        };
        let (with, without) = (of(true), of(false));
        for (with, without) in with.iter().zip(&without) {
            println!("{}\n   without: {}", with.line(), without.line());
            println!("   {:?}", with.conditions());
        }
        let summary = |all: &[Judged]| Summary::of(all.iter().map(|j| j.before.clone()));
        let (s, before) = (summary(&with), summary(&without));
        println!("with the column, {s}\nwithout, {before}");
        assert!(with.iter().all(|j| only(j).is_used()), "an effect was not found");
        assert!(with.iter().all(|j| j.events().is_empty()), "an event was claimed");
        assert!(s.coverage >= 0.9 && s.angle_coverage >= 0.85, "{s}");
        assert!(s.rms_g_mm < before.rms_g_mm, "{s}, without {before}");
    }

    #[test]
    fn irrelevant_temperature_is_used_in_no_record() {
        let seeds: Vec<u64> = sampled(20..28).collect();
        let all: Vec<Judged> =
            seeds.into_par_iter().map(|seed| followed(&plan(seed, [0.0; 2]), true)).collect();
        for j in &all {
            println!("{} {:?}", j.line(), j.conditions());
        }
        println!("irrelevant, {}", Summary::of(all.iter().map(|j| j.before.clone())));
        assert!(all.iter().all(|j| !only(j).is_used()), "a column was used");
    }
}
