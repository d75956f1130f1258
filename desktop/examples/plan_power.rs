//! Whether `plan` keeps what it promises, on five machines: the predicted probability that an effect is found beside the share of
//! simulated diagnoses that find it, and how often the best further measurement decides what was undecided.
//!
//!     cargo run --release -p rotor-edge-desktop --example plan_power -- [DRAWS [MACHINE [EFFECT]]]
//!
//! 40 draws if nothing is said. MACHINE and EFFECT are parts of names and restrict the test; the effect `further` leaves further
//! measurements alone.
//!
//! The machines are those of the plan, simulated as `simulate` does, from stated seeds.

use std::path::Path;

use rayon::prelude::*;
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, SURE, diagnose};
use rotor_edge_desktop::machine::drawing::EffectEntry;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::plan::{Campaign, Decision, EffectPlan, FurtherMeasurement, Plan, PlanRequest, plan};
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
const UNDECIDED_EACH: usize = 5;

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

/// Whether something is claimed and the effect is named, alone or in a group; a verdict of an unknown cause names none.
fn is_found(diagnosis: &Diagnosis, label: &str) -> bool {
    let is_first = diagnosis.candidates.first().is_some_and(|c| c.label() == label);
    let is_in_group = diagnosis.indistinguishable.first().is_some_and(|g| g.iter().any(|l| l == label));
    diagnosis.nothing_missing < SURE
        && diagnosis.verdict != DiagnosisVerdict::Unknown
        && (is_first || is_in_group)
}

/// What is said in place of the effect; `None` where it is found.
fn missed(diagnosis: &Diagnosis, label: &str) -> Option<String> {
    if is_found(diagnosis, label) {
        return None;
    }
    if diagnosis.nothing_missing >= SURE {
        return Some("nothing claimed".into());
    }
    if diagnosis.verdict == DiagnosisVerdict::Unknown {
        return Some("unknown".into());
    }
    let first = diagnosis.candidates.first().map(|c| c.label()).unwrap_or_default();
    let group = diagnosis.indistinguishable.first().map(|g| g.join(" or "));
    Some(group.unwrap_or(first))
}

/// What was said, each once, with how often.
fn counted(mut said: Vec<String>) -> String {
    said.sort();
    let each = said.chunk_by(|a, b| a == b);
    each.map(|alike| format!("; {} × {}", alike.len(), alike[0])).collect()
}

/// Effects with a smallest size, spread over all of them.
fn chosen(plan: &Plan, offset: usize) -> Vec<&EffectPlan> {
    let sized: Vec<&EffectPlan> =
        plan.effects.iter().filter(|e| e.has_size && e.smallest.is_some()).collect();
    if std::env::args().nth(3).is_some() {
        return sized.into_iter().filter(|e| is_sought(3, &e.label())).collect();
    }
    let count = EFFECTS.min(sized.len());
    (0..count).map(|k| sized[((2 * k + offset) * sized.len() / (2 * count)) % sized.len()]).collect()
}

/// The plan of a machine, for effects that are found with this probability, or to decide between some.
fn planned([folder, data]: [&str; 2], probability: f64, between: Vec<String>) -> Plan {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
    let rotor = rotor_file::read(&folder.join("rotor.toml")).expect("a machine of this repository");
    let readings = measurement::read(&folder.join(data), &rotor).expect("its measurements");
    let mut speeds_rpm: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let request = PlanRequest { probability, between, ..PlanRequest::at(speeds_rpm) };
    plan(&rotor, &request).expect("a plan")
}

/// Predicted and simulated probability of each combination.
fn power(([name, _], plans): &([&str; 2], Vec<Plan>), draws: u64, differences: &mut Vec<[f64; 2]>) {
    for (offset, plan) in plans.iter().enumerate() {
        for effect in chosen(plan, offset) {
            let label = effect.label();
            let size = effect.smallest.as_ref().expect("chosen for it");
            let ends = (0..draws).into_par_iter().map(|seed| {
                // each combination has its own noise; with common noise a machine's effects would be found or missed together
                let seed = 1000 * (1 + differences.len() as u64) + seed;
                let diagnosis = diagnosed(&plan.campaign, &size.entry, seed);
                diagnosis.map_or_else(|| Some("no diagnosis".into()), |d| missed(&d, &label))
            });
            let misses: Vec<String> = ends.flatten().collect();
            let share = 1.0 - misses.len() as f64 / draws as f64;
            println!("{name}, {label}, {:.4}, {:.2}, {share:.2}{}", size.change, size.found, counted(misses));
            differences.push([share - size.found, (size.found * (1.0 - size.found) / draws as f64).sqrt()]);
        }
    }
}

/// How far the two differ.
fn sum_up(differences: &[[f64; 2]]) {
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

/// What decides between the effects that a diagnosis could not tell apart, by a plan made for that.
fn deciding(files: [&str; 2], plan: &Plan, undecided: &Diagnosis) -> Option<(Decision, FurtherMeasurement)> {
    let likeliest = || undecided.candidates.iter().take(2).map(|c| c.label()).collect();
    let mut labels: Vec<String> = undecided.indistinguishable.first().cloned().unwrap_or_else(likeliest);
    labels.retain(|label| plan.effects.iter().any(|e| e.label() == *label));
    let decision = planned(files, plan.probability, labels).between?;
    let best = decision.measurement.clone()?;
    Some((decision, best))
}

/// How often the best further measurement decides a case that is undecided.
fn further(plans: &[([&str; 2], Vec<Plan>)], draws: u64) {
    println!("machine, effect, best further measurement, probability that it decides, verdict with it");
    let [mut undecided, mut decided, mut right, mut drawn, mut cases_decided] = [0; 5];
    for (files @ [name, _], plans) in plans {
        let (mut of_machine, plan) = (0, plans.last().expect("one a probability"));
        for (k, effect) in plan.effects.iter().enumerate() {
            if of_machine == UNDECIDED_EACH || undecided == UNDECIDED {
                break;
            }
            let (label, entry) = (effect.label(), &effect.relevant.entry);
            let seed = 5000 + k as u64;
            let Some(before) = diagnosed(&plan.campaign, entry, seed) else { continue };
            if before.verdict != DiagnosisVerdict::Undecided || !is_found(&before, &label) {
                continue;
            }
            let Some((decision, best)) = deciding(*files, plan, &before) else { continue };
            of_machine += 1;
            undecided += 1;
            let then = |draw: u64| diagnosed(&best.campaign, entry, seed + 1000 * (draw + 1));
            let after: Vec<Diagnosis> = (0..draws).into_par_iter().filter_map(then).collect();
            let decisions = || after.iter().filter(|d| d.verdict == DiagnosisVerdict::Missing);
            let is_right = |d: &&Diagnosis| d.candidates.first().is_some_and(|c| c.label() == label);
            let (of_case, right_of_case) = (decisions().count(), decisions().filter(is_right).count());
            decided += of_case;
            right += right_of_case;
            drawn += after.len();
            let ends = after.iter().map(|d| {
                let first = d.candidates.first().map(|c| c.label()).unwrap_or_default();
                format!(
                    "{} {}",
                    d.verdict.name(),
                    d.indistinguishable.first().map_or(first, |g| g.join(" or "))
                )
            });
            let ends = counted(ends.collect());
            println!(
                "{name}, {label}, {}, {:.2}, {of_case} of {} decided{ends}",
                best.measurement,
                decision.then,
                after.len()
            );
            cases_decided += usize::from(2 * of_case > after.len());
        }
    }
    println!(
        "{undecided} undecided cases, {cases_decided} of them decided in most draws by the best further measurement; {decided} of \
         {drawn} draws decided, {right} of them rightly"
    );
}

/// Whether a name holds what this argument says, if it says anything.
fn is_sought(argument: usize, name: &str) -> bool {
    std::env::args().nth(argument).is_none_or(|part| name.contains(&part))
}

fn main() {
    let draws = std::env::args().nth(1).map_or(DRAWS, |text| text.parse().expect("a number of draws"));
    let is_further_alone = std::env::args().nth(3).is_some_and(|part| part == "further");
    let of_machine = |files: &[&'static str; 2]| {
        (*files, PROBABILITIES.map(|probability| planned(*files, probability, Vec::new())).to_vec())
    };
    println!("machine, effect, change of the readings, predicted, simulated ({draws} draws)");
    let (mut plans, mut differences) = (Vec::new(), Vec::new());
    for files in MACHINES.iter().filter(|files| is_sought(2, files[0])) {
        let of_machine = of_machine(files);
        if !is_further_alone {
            power(&of_machine, draws, &mut differences);
        }
        plans.push(of_machine);
    }
    sum_up(&differences);
    if std::env::args().nth(3).is_some() && !is_further_alone {
        return;
    }
    further(&plans, draws);
}
