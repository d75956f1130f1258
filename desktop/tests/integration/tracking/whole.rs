//! Machines with one bearing, three and four, more planes, and oil films.

use rayon::prelude::*;
use rotor_edge_desktop::track::{Config, Method, track};

use super::generator::{Change, FAN_TRAIN, Machine, ON_FILMS, OVERHUNG, Plan, TURBINE_GENERATOR};
use super::score::{Judged, Summary};
use super::{judged, summary, with};

fn quiet(machine: Machine, seeds: std::ops::Range<u64>, days: usize) -> Vec<Judged> {
    judged(seeds.map(|seed| (Plan { days, ..Plan::quiet(machine, seed) }, false)).collect())
}

/// That both intervals hold, and no event is claimed.
fn both_hold(name: &str, all: &[Judged]) {
    let s = summary(name, all, all.iter().map(|j| j.before.clone()));
    for j in all {
        assert!(j.events().is_empty(), "{name}: {}", j.line());
    }
    assert!((0.92..=0.99).contains(&s.coverage) && s.least_coverage >= 0.6, "{name}: {s}");
    assert!(s.angle_coverage >= 0.9 && s.least_angle_coverage >= 0.6, "{name}: {s}");
}

#[test]
fn every_method_follows_one_three_and_four_bearings() {
    let machines = [OVERHUNG, FAN_TRAIN, TURBINE_GENERATOR];
    let methods = [Method::Fixed, Method::Adaptive, Method::Joint];
    let all: Vec<(Machine, Method)> =
        machines.iter().flat_map(|machine| methods.map(|method| (*machine, method))).collect();
    all.into_par_iter().for_each(|(machine, method)| {
        let record = Plan { days: 40, wander: [0.02, 0.02], ..Plan::quiet(machine, 1000) }.make();
        let config = Config::new(method);
        let found =
            track(&record.rotor, &record.readings, &record.runup, &[], &config, &mut |_, _| ()).unwrap();
        let (last, truth) = (found.estimates.last().unwrap(), record.unbalance_kg_m.last().unwrap());
        assert_eq!(last.logs.len(), 4 * record.rotor.bearing.len());
        for (u, truth) in last.unbalance_kg_m.iter().zip(truth) {
            assert!((u - truth).norm() < 0.5 * truth.norm(), "{} {method:?}: {u} {truth}", machine.name);
        }
    });
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn intervals_of_four_bearings_and_three_planes_hold() {
        both_hold("four bearings", &quiet(TURBINE_GENERATOR, 1100..1116, 460));
    }

    #[test]
    fn intervals_of_three_bearings_hold() {
        both_hold("three bearings", &quiet(FAN_TRAIN, 1200..1206, 460));
    }

    #[test]
    fn intervals_of_one_bearing_hold() {
        both_hold("one bearing", &quiet(OVERHUNG, 1300..1308, 460));
    }

    #[test]
    fn intervals_on_oil_films_hold() {
        both_hold("oil films", &quiet(ON_FILMS, 1400..1406, 460));
    }

    #[test]
    fn event_at_each_of_four_bearings_is_found_at_its_bearing() {
        let change = |index| Change::Bearing { index, stiffness: [0.55, 1.25], damping: [0.5, 0.7] };
        let plan = |index: usize| Plan {
            days: 240,
            ..with(TURBINE_GENERATOR, 1500 + index as u64, 120, change(index))
        };
        let all = judged((0..4).map(|index| (plan(index), index % 2 == 0)).collect());
        let before = summary("before an event at a bearing", &all, all.iter().map(|j| j.before.clone()));
        let after = Summary::of(all.iter().filter_map(|j| j.after.clone()));
        println!("after an event at a bearing, {after}");
        for (index, j) in all.iter().enumerate() {
            let [event] = j.events() else { panic!("{}", j.line()) };
            assert!((event.time_d - 120.0).abs() <= 1.0, "{}", j.line());
            assert_eq!(event.scope.bearings.iter().collect::<Vec<usize>>(), [index], "{}", j.line());
        }
        assert!(before.coverage >= 0.9 && before.angle_coverage >= 0.85, "{before}");
        assert!(after.coverage >= 0.88 && after.angle_coverage >= 0.85, "{after}");
    }
}
