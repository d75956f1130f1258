//! Whether `plan` keeps what it promises, on five machines: the predicted probability that an effect is found beside the share of
//! simulated diagnoses that find it, and how often the best further measurement decides what was undecided.
//!
//!     cargo run --release -p rotor-edge-desktop --example plan_power -- [DRAWS]     40 if nothing is said
//!
//! The machines are those of the plan, simulated as `simulate` does, from stated seeds.

use std::path::Path;

use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, SURE, diagnose};
use rotor_edge_desktop::machine::drawing::EffectEntry;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::plan::{Campaign, EffectPlan, Plan, PlanRequest, plan};
use rotor_edge_desktop::simulate::{SimulationRequest, simulate};
use rotor_edge_desktop::{measurement, rotor_file};

/// Machines, each planned at the speeds at which it was measured.
const MACHINES: [[&str; 2]; 5] = [
    ["tests/machines/single/case-004", "measured.csv"],
    ["tests/machines/single/case-014", "measured.csv"],
    ["tests/machines/ordinary/001-pedestal", "measured.csv"],
    ["tests/machines/double/case-000", "measured.csv"],
    ["host-sim/sample/turbine", "runup-day126.csv"],
];
/// Probabilities that the sizes of effects are planned for, and how many effects of each machine at each.
const PROBABILITIES: [f64; 2] = [0.5, 0.9];
const EFFECTS: usize = 4;
const DRAWS: u64 = 40;
/// Predicted and simulated probability may differ by so much.
const NEAR: f64 = 0.1;
/// Undecided cases that are sought, and of one machine at most.
const UNDECIDED: usize = 20;
const UNDECIDED_EACH: usize = 4;

/// What a campaign shows of a machine with an effect, simulated on full finite elements with noise.
fn simulated(campaign: &Campaign, effect: &EffectEntry, seed: u64) -> Option<Vec<Reading>> {
    let mut machine = campaign.rotor.clone();
    machine.effect.push(effect.clone());
    let planes = machine.plane.iter().map(|plane| plane.name.clone());
    let mut speeds_rpm: Vec<f64> = campaign.schedule().map(|(_, speed_rpm)| speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let request = SimulationRequest {
        unbalance_kg_m: planes.zip(campaign.unbalance_kg_m.iter().copied()).collect(),
        speeds_rpm,
        noise: Some(campaign.noise),
        seed,
        ..SimulationRequest::default()
    };
    let mut readings = simulate(&machine, &request).ok()?.readings;
    let planned = |r: &Reading| {
        campaign.schedule().any(|(run, speed_rpm)| run == r.run.as_deref() && speed_rpm == r.speed_rpm)
    };
    readings.retain(planned);
    Some(readings)
}

/// The diagnosis of what a campaign shows, by the file without the effect.
fn diagnosed(campaign: &Campaign, effect: &EffectEntry, seed: u64) -> Option<Diagnosis> {
    let mut rotor = campaign.rotor.clone();
    rotor.noise = Some(campaign.noise);
    diagnose(&rotor, &simulated(campaign, effect, seed)?).ok()
}

/// Whether something is claimed and the effect is named, alone or in a group.
fn is_found(diagnosis: &Diagnosis, label: &str) -> bool {
    let is_first = diagnosis.candidates.first().is_some_and(|c| c.label() == label);
    let is_in_group = diagnosis.indistinguishable.first().is_some_and(|g| g.iter().any(|l| l == label));
    diagnosis.nothing_missing < SURE && (is_first || is_in_group)
}

/// Effects with a smallest size, spread over all of them.
fn chosen(plan: &Plan, offset: usize) -> Vec<&EffectPlan> {
    let sized: Vec<&EffectPlan> =
        plan.effects.iter().filter(|e| e.has_size && e.smallest.is_some()).collect();
    let count = EFFECTS.min(sized.len());
    (0..count).map(|k| sized[((2 * k + offset) * sized.len() / (2 * count)) % sized.len()]).collect()
}

fn planned([folder, data]: [&str; 2], probability: f64) -> Plan {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
    let rotor = rotor_file::read(&folder.join("rotor.toml")).expect("a machine of this repository");
    let readings = measurement::read(&folder.join(data), &rotor).expect("its measurements");
    let mut speeds_rpm: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let request = PlanRequest { speeds_rpm, runs: None, unbalance_kg_m: None, probability };
    plan(&rotor, &request).expect("a plan")
}

/// Predicted and simulated probability of each combination.
fn power(plans: &[(&str, Vec<Plan>)], draws: u64) {
    println!("machine, effect, change of the readings, predicted, simulated ({draws} draws)");
    let mut differences: Vec<[f64; 2]> = Vec::new();
    for (name, plans) in plans {
        for (offset, plan) in plans.iter().enumerate() {
            for effect in chosen(plan, offset) {
                let label = effect.label();
                let size = effect.smallest.as_ref().expect("chosen for it");
                let found = |seed: &u64| {
                    let diagnosis = diagnosed(&plan.campaign, &size.entry, 1000 + seed);
                    diagnosis.is_some_and(|d| is_found(&d, &label))
                };
                let share = (0..draws).filter(found).count() as f64 / draws as f64;
                println!("{name}, {label}, {:.4}, {:.2}, {share:.2}", size.change, size.found);
                differences
                    .push([share - size.found, (size.found * (1.0 - size.found) / draws as f64).sqrt()]);
            }
        }
    }
    let count = differences.len();
    let near = |slack: f64| differences.iter().filter(|[d, sd]| d.abs() <= NEAR + slack * sd).count();
    let mean = differences.iter().map(|[d, _]| d).sum::<f64>() / count as f64;
    let worst = differences.iter().map(|[d, _]| d.abs()).fold(0.0, f64::max);
    println!(
        "{count} combinations: {} within 10 points, {} within 10 points and two standard deviations of the draws",
        near(0.0),
        near(2.0)
    );
    println!("mean difference {:+.1} points, largest {:.0} points\n", 100.0 * mean, 100.0 * worst);
}

/// How often the best further measurement decides a case that is undecided.
fn further(plans: &[(&str, Vec<Plan>)]) {
    println!("machine, effect, best further measurement, verdict with it");
    let (mut undecided, mut decided, mut right) = (0, 0, 0);
    for (name, plans) in plans {
        let (mut of_machine, plan) = (0, plans.last().expect("one a probability"));
        let Some(best) = plan.next.first() else { continue };
        for (k, effect) in plan.effects.iter().enumerate() {
            if of_machine == UNDECIDED_EACH || undecided == UNDECIDED {
                break;
            }
            let (label, entry) = (effect.label(), &effect.relevant.entry);
            let seed = 5000 + k as u64;
            let before = diagnosed(&plan.campaign, entry, seed);
            if !before.is_some_and(|d| d.verdict == DiagnosisVerdict::Undecided && is_found(&d, &label)) {
                continue;
            }
            of_machine += 1;
            undecided += 1;
            let Some(after) = diagnosed(&best.campaign, entry, seed + 1000) else {
                println!("{name}, {label}, {}, not simulated", best.measurement);
                continue;
            };
            let is_decided = after.verdict == DiagnosisVerdict::Missing;
            let is_right = is_decided && after.candidates.first().is_some_and(|c| c.label() == label);
            decided += usize::from(is_decided);
            right += usize::from(is_right);
            let first = after.candidates.first().map(|c| c.label()).unwrap_or_default();
            println!("{name}, {label}, {}, {:?} {first}", best.measurement, after.verdict);
        }
    }
    println!(
        "{undecided} undecided cases: {decided} decided by the best further measurement, {right} of them rightly"
    );
}

fn main() {
    let draws = std::env::args().nth(1).map_or(DRAWS, |text| text.parse().expect("a number of draws"));
    let of_machine = |files: &[&'static str; 2]| {
        (files[0], PROBABILITIES.map(|probability| planned(*files, probability)).to_vec())
    };
    let plans: Vec<(&str, Vec<Plan>)> = MACHINES.iter().map(of_machine).collect();
    power(&plans, draws);
    further(&plans);
}
