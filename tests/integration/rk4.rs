//! The real rig RK-4: unbalance of single conditions from others with stated weights.
//!
//! Magnitudes count over both disks of every condition but the base, phases over disks of 24 g·mm and more, as in the source.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use nalgebra::Complex;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rotor_edge_desktop::balance::estimate::sessions::SessionSource;
use rotor_edge_desktop::balance::estimate::{EstimateOptions, RunEstimate, RunEstimates, estimate};
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, diagnose, improve};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;
use rotor_edge_tests::sampled;

type C = Complex<f64>;

/// The rig as found.
const BASE: &str = "BASE";
/// Draws of trial runs.
const DRAWS: usize = 30;

/// Weights that cannot be true by what everyone makes of the data.
const IMPOSSIBLE: [&str; 4] = ["A027", "B007", "B031", "B047"];
/// Disks with less have no phase that counts, g·mm.
const PHASE_FROM_G_MM: f64 = 24.0;

fn rig() -> (Rotor, Vec<Reading>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/rk4");
    let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let readings = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    (rotor, readings)
}

/// Errors over disk values.
#[derive(Default)]
struct Errors {
    /// Of magnitudes, g·mm.
    magnitudes: Vec<f64>,
    /// Of phases, degrees.
    phases: Vec<f64>,
    /// Whether intervals hold the magnitude.
    held: Vec<bool>,
}

impl Errors {
    fn add(&mut self, truth: &[C], found: &[C]) {
        for (t, f) in truth.iter().zip(found) {
            self.magnitudes.push(f.norm() - t.norm());
            if t.norm() >= PHASE_FROM_G_MM - 1e-9 {
                self.phases.push((f / t).arg().to_degrees());
            }
        }
    }

    fn add_estimate(&mut self, truth: &[C], e: &RunEstimate) {
        self.add(truth, &unbalance(e));
        for (t, p) in truth.iter().zip(&e.planes) {
            let [low, high] = p.magnitude_95_g_mm();
            self.held.push(low <= t.norm() && t.norm() <= high);
        }
    }

    fn rmse(&self) -> f64 {
        (self.magnitudes.iter().map(|e| e * e).sum::<f64>() / self.magnitudes.len() as f64).sqrt()
    }

    fn mae(&self) -> f64 {
        self.magnitudes.iter().map(|e| e.abs()).sum::<f64>() / self.magnitudes.len() as f64
    }

    fn phase_deg(&self) -> f64 {
        self.phases.iter().map(|e| e.abs()).sum::<f64>() / self.phases.len() as f64
    }

    fn share_held(&self) -> f64 {
        self.held.iter().filter(|h| **h).count() as f64 / self.held.len() as f64
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [rmse, mae, phase_deg, held] = [self.rmse(), self.mae(), self.phase_deg(), self.share_held()];
        let values = self.magnitudes.len();
        write!(
            f,
            "{values} values: RMSE {rmse:.2}, MAE {mae:.2} g·mm, phase {phase_deg:.1}°, intervals hold {held:.3}"
        )
    }
}

fn unbalance(e: &RunEstimate) -> Vec<C> {
    e.planes.iter().map(|p| p.unbalance_g_mm).collect()
}

fn refuted(e: &RunEstimates) -> BTreeSet<&str> {
    e.refuted.iter().map(|r| r.run.as_str()).collect()
}

/// The rig with these conditions stated and all others blind.
fn knowing(rotor: &Rotor, known: impl Fn(&str) -> bool) -> Rotor {
    let mut some = rotor.clone();
    some.run.retain(|run| run.name == BASE || known(&run.name));
    some
}

fn truths(rotor: &Rotor, readings: &[Reading]) -> BTreeMap<String, Vec<C>> {
    let trusting = EstimateOptions { trust_weights: true, ..EstimateOptions::default() };
    let all = estimate(rotor, readings, &trusting).unwrap();
    all.runs.into_iter().map(|e| (e.run, e.stated_g_mm.unwrap())).collect()
}

fn left_out(rotor: &Rotor, readings: &[Reading], trust_weights: bool) -> RunEstimates {
    estimate(
        rotor,
        readings,
        &EstimateOptions { leave_one_out: true, trust_weights, ..EstimateOptions::default() },
    )
    .unwrap()
}

#[test]
fn leave_one_out_finds_weights_and_refutes_impossible_ones() {
    let (rotor, readings) = rig();
    let found = left_out(&rotor, &readings, false);
    let out = refuted(&found);
    assert!(IMPOSSIBLE.iter().all(|run| out.contains(run)), "{out:?}");
    assert!(out.len() <= IMPOSSIBLE.len() + 3, "{out:?}");
    let mut kept = Errors::default();
    for e in found.runs.iter().filter(|e| !out.contains(e.run.as_str())) {
        kept.add_estimate(e.stated_g_mm.as_ref().unwrap(), e);
    }
    println!("refuted {out:?}; the others {kept}");
    assert!(kept.rmse() <= 1.6 && kept.mae() <= 1.2 && kept.phase_deg() <= 3.0, "{kept}");
    assert!((0.90..=0.98).contains(&kept.share_held()), "{kept}");
    let [slow, fast] = [0, 1].map(|i| found.determined.conditions[i].condition);
    assert!((16.0..19.0).contains(&slow) && (23.0..26.0).contains(&fast), "{slow} and {fast}");
}

#[test]
fn intervals_hold_for_conditions_of_a_later_session() {
    let (rotor, readings) = rig();
    let truth = truths(&rotor, &readings);
    let names: Vec<&str> = truth.keys().map(String::as_str).collect();
    // each quarter of the conditions in their order, and the first of the three series by itself, as a session that comes later
    let quarters = (0..4).map(|i| names[i * names.len() / 4..(i + 1) * names.len() / 4].to_vec());
    let series: Vec<&str> = names.iter().copied().filter(|run| run.starts_with('A')).collect();
    let held = |later: &[&str]| {
        let some = knowing(&rotor, |run| !later.contains(&run));
        let found = estimate(&some, &readings, &EstimateOptions::default()).unwrap();
        assert_eq!(found.sessions.source, SessionSource::Blocks);
        let [with, without] = found.sessions.half_width_g_mm.unwrap();
        assert!(with > without, "{with} and {without}");
        let mut errors = Errors::default();
        for e in found.runs.iter().filter(|e| later.contains(&e.run.as_str())) {
            if !IMPOSSIBLE.contains(&e.run.as_str()) {
                errors.add_estimate(&truth[&e.run], e);
            }
        }
        errors
    };
    let mut all = Errors::default();
    for quarter in quarters {
        all.held.extend(held(&quarter).held);
    }
    let first = held(&series);
    println!("quarters {:.3}; the first series {first}", all.share_held());
    assert!((0.90..=0.98).contains(&all.share_held()), "{}", all.share_held());
    assert!((0.90..=0.98).contains(&first.share_held()), "{first}");
}

/// The rig and its readings with these conditions alone.
fn part(kept: &BTreeSet<&str>) -> (Rotor, Vec<Reading>) {
    let (mut rotor, mut readings) = rig();
    rotor.run.retain(|run| kept.contains(run.name.as_str()));
    readings.retain(|reading| reading.run.as_deref().is_some_and(|run| kept.contains(run)));
    (rotor, readings)
}

#[test]
fn probe_that_is_off_is_named_though_more_is_missing() {
    let (rotor, readings) = part(&BTreeSet::from(["A003", "A007"]));
    let found = diagnose(&rotor, &readings).unwrap();
    // the influence of each disk at P1X is 0.56 of that at P1Y and 60 to 65° off a quarter turn, over all runs and without a model
    assert_eq!(found.verdict, DiagnosisVerdict::Unknown, "{}", found.summary);
    assert!(
        found.summary.starts_with("Probe P1X does not show what the others do: gain 0."),
        "{}",
        found.summary
    );
    assert_eq!(found.bad_probe.as_deref(), Some("P1X"));
}

/// Conditions of which a runout and a skewed disk would explain more than the probe does, one of them with a weight that is not true.
const THIRTEEN: [&str; 13] =
    ["A004", "A006", "A016", "A018", "A019", "A032", "B005", "B006", "B008", "B019", "B025", "B030", "B031"];

#[test]
fn probe_that_is_off_is_named_by_differences_of_runs() {
    let (rotor, readings) = part(&BTreeSet::from(THIRTEEN));
    let found = diagnose(&rotor, &readings).unwrap();
    assert_ne!(found.candidates[0].at.as_deref(), Some("P1X"), "the probe leads by itself");
    assert_eq!(found.bad_probe.as_deref(), Some("P1X"), "{}", found.summary);
}

/// What is unseen while the rest is learned from, fold by fold, and the RMSE allowed: an eighth of the circle by the angle of the heavier weight; one of
/// the four loadings (either disk alone, both the same way, both against one another); all weights larger than some.
///
/// The source does not say what it calls larger. Of weights up to 12 g·mm its figure is reached; beyond that the four or so
/// conditions that have 60 g·mm and the impossible one of 30 g·mm are most of what is left to test, and the errors are theirs:
/// B047 alone, whose second weight was not there, makes 30 / √56 = 4.0 g·mm of the 56 values above 24 g·mm.
fn protocols(truth: &BTreeMap<String, Vec<C>>) -> Vec<(String, Vec<BTreeSet<&str>>, f64)> {
    let by = |of: &dyn Fn(&[C]) -> i64| {
        let mut folds: BTreeMap<i64, BTreeSet<&str>> = BTreeMap::new();
        truth.iter().for_each(|(run, u)| {
            folds.entry(of(u)).or_default().insert(run);
        });
        folds.into_values().collect::<Vec<_>>()
    };
    let heavier = |u: &[C]| if u[1].norm() > u[0].norm() + 1e-9 { u[1] } else { u[0] };
    let eighth = |u: &[C]| (heavier(u).arg().to_degrees() / 45.0).round().rem_euclid(8.0) as i64;
    let loading = |u: &[C]| match [u[0].norm() > 0.0, u[1].norm() > 0.0] {
        [true, true] => i64::from((u[0] / u[1]).re > 0.0),
        [first, _] => 2 + i64::from(first),
    };
    let mut all = vec![
        ("unseen angle sector".to_string(), by(&eighth), 3.57),
        ("unseen loading".into(), by(&loading), 3.65),
    ];
    for (largest, at_most) in [(12.0, 4.83), (24.0, 5.2), (30.0, 5.5), (36.0, 6.3)] {
        let larger = |u: &[C]| i64::from(heavier(u).norm() > largest + 1e-9);
        all.push((format!("larger than {largest} g·mm"), by(&larger).into_iter().skip(1).collect(), at_most));
    }
    all
}

/// Some of these, each once.
fn draw<'a>(from: &[&'a str], count: usize, random: &mut Xoshiro256PlusPlus) -> BTreeSet<&'a str> {
    let mut drawn = BTreeSet::new();
    while drawn.len() < count {
        drawn.insert(from[(random.next_u64() % from.len() as u64) as usize]);
    }
    drawn
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { values[half] } else { 0.5 * (values[half - 1] + values[half]) }
}

/// Eight conditions of the rig, one of them with a weight that is not true.
const EIGHT: [&str; 8] = [BASE, "A017", "A031", "B016", "B029", "B038", "B044", "B046"];

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn of_three_conditions_nothing_is_claimed_and_nothing_added() {
        let (rotor, readings) = rig();
        let names: Vec<&str> = rotor.run.iter().map(|r| r.name.as_str()).filter(|run| *run != BASE).collect();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        for _ in sampled(2, 0..6) {
            let drawn = draw(&names, 2, &mut random);
            let some = knowing(&rotor, |run| drawn.contains(run));
            let three: Vec<Reading> = readings
                .iter()
                .filter(|r| r.run.as_deref().is_some_and(|run| run == BASE || drawn.contains(run)))
                .cloned()
                .collect();
            let outcome = improve(&some, &three, |_| ()).unwrap();
            println!("{drawn:?} {:?} {} effects: {}", outcome.verdict, outcome.steps.len(), outcome.summary);
            let claims = matches!(outcome.verdict, DiagnosisVerdict::Adequate | DiagnosisVerdict::Missing);
            assert!(!claims && outcome.steps.is_empty(), "{drawn:?}: {}", outcome.summary);
        }
    }

    #[test]
    fn probe_that_is_off_is_named_by_most_parts_of_the_data() {
        let (rotor, _) = rig();
        let names: Vec<&str> = rotor.run.iter().map(|r| r.name.as_str()).collect();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut named = 0;
        for count in (3..=20).step_by(2) {
            let drawn = draw(&names, count, &mut random);
            let (some, readings) = part(&drawn);
            let found = diagnose(&some, &readings).unwrap();
            println!("{count} runs: {:?}, {}", found.bad_probe, found.summary);
            assert!(found.bad_probe.as_deref().is_none_or(|probe| probe == "P1X"), "{drawn:?}");
            named += usize::from(found.bad_probe.is_some());
        }
        assert!(named > 4, "{named} of 9");
    }

    #[test]
    fn all_of_the_data_blame_no_probe_but_the_one_that_is_off() {
        let (rotor, readings) = rig();
        let found = diagnose(&rotor, &readings).unwrap();
        assert_eq!(found.verdict, DiagnosisVerdict::Unknown, "{}", found.summary);
        assert!(found.bad_probe.as_deref().is_none_or(|probe| probe == "P1X"), "{}", found.summary);
    }

    #[test]
    fn unexplained_misfit_gives_unknown_verdict_and_adds_no_effect() {
        let (mut rotor, mut readings) = rig();
        let chosen = |run: &str| EIGHT.contains(&run);
        rotor.run.retain(|r| chosen(&r.name));
        readings.retain(|r| r.run.as_deref().is_some_and(chosen));
        let outcome = improve(&rotor, &readings, |_| ()).unwrap();
        assert_eq!(outcome.verdict, DiagnosisVerdict::Unknown, "{}", outcome.summary);
        assert!(outcome.steps.is_empty() && outcome.rotor.effect.is_empty());
        assert!(outcome.unknown.is_some_and(|cause| cause.probability > 0.95));
    }

    #[test]
    fn model_with_few_trial_runs_beats_influence_coefficients() {
        let (rotor, mut readings) = rig();
        // trial runs are drawn from all over the campaign, so that the others are of no later session
        readings.iter_mut().for_each(|r| r.session = Some("campaign".into()));
        let found = left_out(&rotor, &readings, false);
        let out = refuted(&found);
        let sound = found.runs.iter().filter(|e| !out.contains(e.run.as_str()));
        let truth: BTreeMap<&str, &Vec<C>> =
            sound.map(|e| (e.run.as_str(), e.stated_g_mm.as_ref().unwrap())).collect();
        let names: Vec<&str> = truth.keys().copied().collect();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(14);
        for trials in [2, 4, 7, 15] {
            let (mut ours, mut coefficients, mut held, mut worse) = (vec![], vec![], vec![], 0);
            while ours.len() < DRAWS {
                let drawn = draw(&names, trials, &mut random);
                let some = knowing(&rotor, |run| drawn.contains(run));
                let answer = estimate(&some, &readings, &EstimateOptions::default()).unwrap();
                let (mut model, mut plain) = (Errors::default(), Errors::default());
                for e in answer.runs.iter().filter(|e| !drawn.contains(e.run.as_str())) {
                    let (Some(t), Some(u)) = (truth.get(e.run.as_str()), &e.influence_g_mm) else { continue };
                    model.add_estimate(t, e);
                    plain.add(t, u);
                }
                if plain.magnitudes.is_empty() {
                    continue; // the drawn weights do not tell the planes apart, so there are no coefficients to compare with
                }
                assert!(trials > 2 || answer.determined.poorly, "{drawn:?}: {:?}", answer.determined);
                worse += usize::from(model.rmse() > plain.rmse());
                ours.push(model.rmse());
                coefficients.push(plain.rmse());
                held.extend(model.held);
            }
            let [model, plain] = [ours, coefficients].map(median);
            let share = held.iter().filter(|h| **h).count() as f64 / held.len() as f64;
            println!(
                "{trials} trials: {model:.2} against {plain:.2} g·mm, worse in {worse} of {DRAWS} draws, intervals hold {share:.3}"
            );
            assert!(
                worse == 0 && model <= if trials < 4 { 0.8 } else { 0.6 } * plain,
                "{model} {plain} {worse}"
            );
            assert!((0.90..=0.98).contains(&share), "{share}");
        }
    }

    #[test]
    fn trusted_weights_reach_published_errors() {
        let (rotor, readings) = rig();
        let mut all = Errors::default();
        for e in &left_out(&rotor, &readings, true).runs {
            all.add_estimate(e.stated_g_mm.as_ref().unwrap(), e);
        }
        println!("each left out {all}");
        assert!(all.rmse() <= 3.38 && all.mae() <= 1.90 && all.phase_deg() <= 5.9, "{all}");
        let truth = truths(&rotor, &readings);
        for (protocol, folds, at_most) in protocols(&truth) {
            let mut errors = Errors::default();
            for unseen in folds {
                let some = knowing(&rotor, |run| !unseen.contains(run));
                let trusting = EstimateOptions { trust_weights: true, ..EstimateOptions::default() };
                let found = estimate(&some, &readings, &trusting).unwrap();
                for e in found.runs.iter().filter(|e| unseen.contains(e.run.as_str())) {
                    errors.add_estimate(&truth[&e.run], e);
                }
            }
            println!("{protocol} {errors}");
            assert!(errors.rmse() <= at_most, "{protocol} {errors}");
        }
    }
}
