//! Whether a plan keeps what it promises: effects of a size that is found with some probability are found as often.

use nalgebra::{Complex, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use rotor_edge_desktop::diagnose::{SURE, diagnose};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::plan::{EffectPlan, Plan, PlanRequest, plan};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_desktop::units::rad_s;
use rotor_edge_tests::{repository, sampled};

use super::noise::normal;

const DRAWS: u64 = 20;
/// Predicted and simulated probability may differ by so much, beside what chance makes of so few draws.
const NEAR: f64 = 0.1;

/// What the machine shows with an effect of its smallest size, with noise.
fn simulated(rotor: &Rotor, effect: &EffectPlan, plan: &Plan, seed: u64) -> Vec<Reading> {
    let mut machine = rotor.as_stated();
    machine.run.clear();
    machine.effect.push(effect.smallest.as_ref().unwrap().entry.clone());
    let model = Model::finite_elements(&machine);
    let planes = plan.unbalance.iter().map(|(_, [magnitude, angle])| phasor_kg_m(*magnitude, *angle));
    let u = DVector::from_iterator(plan.unbalance.len(), planes);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let reading = |speed_rpm: &f64| {
        let seen = model.response_under(rad_s(*speed_rpm), &u).unwrap().at(&u);
        let noisy = seen.iter().map(|y| {
            let sd = plan.noise.sigma_m(*y);
            Some(y + Complex::new(normal(&mut random) * sd, normal(&mut random) * sd))
        });
        Reading { speed_rpm: *speed_rpm, probes: noisy.collect(), ..Reading::default() }
    };
    plan.speeds_rpm.iter().map(reading).collect()
}

/// How often a diagnosis names the effect, alone or in a group.
fn found(rotor: &Rotor, effect: &EffectPlan, plan: &Plan) -> f64 {
    let label = effect.label();
    let names = |seed: u64| {
        let answer = diagnose(rotor, &simulated(rotor, effect, plan, seed)).unwrap();
        let is_first = answer.candidates.first().is_some_and(|c| c.label() == label);
        let is_in_group = answer.indistinguishable.first().is_some_and(|g| g.contains(&label));
        answer.nothing_missing < SURE && (is_first || is_in_group)
    };
    (0..DRAWS).filter(|seed| names(1000 + seed)).count() as f64 / DRAWS as f64
}

#[test]
fn planned_probability_is_that_of_simulated_diagnoses() {
    let mut rotor = rotor_file::read(&repository("tests/machines/single/case-004/rotor.toml")).unwrap();
    rotor.run.clear();
    let mut differences = Vec::new();
    for probability in sampled(2, [0.9, 0.5]) {
        let speeds_rpm = (0..31).map(|k| 500.0 + 4700.0 * f64::from(k) / 30.0).collect();
        let request = PlanRequest { probability, ..PlanRequest::at(speeds_rpm) };
        let plan = plan(&rotor, &request).unwrap();
        for label in ["speed_dependent_stiffness", "pedestal@OB", "shaft_bow", "probe_calibration@IBX"] {
            let effect = plan.effects.iter().find(|e| e.label() == label).unwrap();
            let predicted = effect.smallest.as_ref().unwrap().found;
            let simulated = found(&rotor, effect, &plan);
            println!("{label}: predicted {predicted:.2}, simulated {simulated:.2}");
            // three standard deviations of a share among so many draws
            let chance = 3.0 * (predicted * (1.0 - predicted) / DRAWS as f64).sqrt();
            assert!((simulated - predicted).abs() <= NEAR + chance, "{label}: {predicted} {simulated}");
            differences.push(simulated - predicted);
        }
    }
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    assert!(mean.abs() <= NEAR, "{mean}");
}

/// Rubs at the two disks of a fan move its bearings and planes alike: in 20 draws each, no single further measurement decided which it is in
/// more than half of them. A plan that takes rivals as linear promises that each of them does.
#[test]
fn rub_is_not_promised_to_be_told_from_the_same_at_another_disk() {
    let folder = repository("tests/machines/ordinary/001-pedestal");
    let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let readings = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    let mut speeds_rpm: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let between = vec!["rub@left".to_string(), "rub@right".to_string()];
    let plan =
        plan(&rotor, &PlanRequest { between: between.clone(), ..PlanRequest::at(speeds_rpm) }).unwrap();
    for further in &plan.next {
        for (label, alone) in further.alone_of.iter().filter(|(label, _)| between.contains(label)) {
            assert!(*alone < 0.6, "{label} with {}: {alone}", further.measurement);
        }
    }
    let decision = plan.between.unwrap();
    let measurement = decision.measurement.unwrap().measurement;
    assert!(measurement.contains(", together with "), "{measurement}");
    assert!(decision.then > decision.now + 0.2, "{} {}", decision.now, decision.then);
}
