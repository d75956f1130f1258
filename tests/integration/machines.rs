//! The given machines: is the hidden effect found, is nothing claimed where nothing hides, and do the
//! fitted parameters and errors deserve their stated uncertainty?
//!
//! The table of docs/diagnosis.md comes from here; `the_table_in_the_docs_is_current` prints it anew when it differs.

mod machine;

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use machine::{Hidden, Machine, machines};
use rotor_edge_desktop::diagnose::{Candidate, DiagnosisVerdict, add, diagnose, improve};
use rotor_edge_desktop::machine::drawing::{ParameterValue, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_tests::{repository, sampled};

/// Half width of a 95 % interval in standard deviations.
const NINETY_FIVE: f64 = 1.96;
/// How far χ² and the error may lie from what the noise makes them.
const NEAR: f64 = 0.1;
/// With few values both scatter by more than that; so many standard deviations of it are allowed.
const SCATTER: f64 = 3.0;

/// What was found on one machine.
struct Found {
    name: String,
    truth: String,
    /// The effects that were named; empty if none.
    named: String,
    verdict: DiagnosisVerdict,
    /// What the data cannot tell apart.
    group: Vec<String>,
    chi2_per_value: f64,
    chi2_scatter: f64,
    /// The error over the noise's own; none where the model was left as drawn and the drawing is inexact.
    error: Option<f64>,
    error_scatter: f64,
    /// Fitted parameters: name, and how many standard deviations they are off the truth.
    parameters: Vec<(String, f64)>,
    time: Duration,
}

impl Found {
    fn new(machine: &Machine, time: Duration) -> Self {
        let (_, error_scatter) = machine.own_error();
        Self {
            name: machine.name.clone(),
            truth: machine.truth_label(),
            named: String::new(),
            verdict: DiagnosisVerdict::Adequate,
            group: Vec::new(),
            chi2_per_value: f64::NAN,
            // two real numbers a value, each with a χ² that scatters by √2
            chi2_scatter: 1.0 / (machine.values().len() as f64).sqrt(),
            error: None,
            error_scatter,
            parameters: Vec::new(),
            time,
        }
    }

    fn hides(&self) -> bool {
        !self.truth.is_empty()
    }

    /// The truth, and nothing else, was named.
    fn first(&self) -> bool {
        self.named == self.truth
    }

    /// The truth was named, or stands in the group that the data cannot tell apart.
    fn right(&self) -> bool {
        self.first() || self.group.contains(&self.truth)
    }

    fn chi2_is_near(&self) -> bool {
        (self.chi2_per_value - 1.0).abs() <= NEAR.max(SCATTER * self.chi2_scatter)
    }

    fn error_is_near(&self) -> bool {
        self.error.is_none_or(|e| (e - 1.0).abs() <= NEAR.max(SCATTER * self.error_scatter))
    }
}

impl Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let or_none = |text: &str| if text.is_empty() { "none".to_string() } else { text.to_string() };
        write!(
            f,
            "{}: truth {}, named {} ({}), group [{}], χ² {:.3} ± {:.3}, error {} ± {:.3} of the noise's",
            self.name,
            or_none(&self.truth),
            or_none(&self.named),
            self.verdict.name(),
            self.group.join(", "),
            self.chi2_per_value,
            self.chi2_scatter,
            self.error.map_or("–".to_string(), |e| format!("{e:.3}")),
            self.error_scatter
        )?;
        self.parameters.iter().try_for_each(|(name, off)| write!(f, ", {name} off by {off:.1} sd"))
    }
}

fn diagnosed(machine: &Machine) -> Found {
    let start = Instant::now();
    let diagnosis = diagnose(&machine.rotor, &machine.readings).unwrap();
    let mut found = Found::new(machine, start.elapsed());
    found.verdict = diagnosis.verdict;
    found.group = diagnosis.indistinguishable.into_iter().next().unwrap_or_default();
    let (own, _) = machine.own_error();
    match diagnosis.candidates.first() {
        Some(best) if diagnosis.verdict != DiagnosisVerdict::Adequate => {
            found.named = best.label();
            found.chi2_per_value = best.chi2_per_value;
            found.error = Some(best.error_after / own);
        }
        _ => {
            found.chi2_per_value = diagnosis.chi2_per_value;
            found.error = machine.rotor.tolerance.is_none().then_some(diagnosis.error_before / own);
        }
    }
    if let ([hidden], true) = (&machine.truth[..], found.right()) {
        let added = add(&machine.rotor, &machine.readings, &hidden.effect, hidden.at.as_deref()).unwrap();
        found.parameters = beside_truth(hidden, &added.added, &added.rotor);
    }
    found
}

fn improved(machine: &Machine) -> Found {
    let start = Instant::now();
    let outcome = improve(&machine.rotor, &machine.readings, |_| ()).unwrap();
    let mut found = Found::new(machine, start.elapsed());
    let (own, _) = machine.own_error();
    let mut labels: Vec<String> = outcome.steps.iter().map(|s| s.added.label()).collect();
    labels.sort();
    found.named = labels.join(" + ");
    found.verdict = outcome.verdict;
    if let Some(last) = outcome.steps.last() {
        found.group = last.group.clone();
        (found.chi2_per_value, found.error) = (last.chi2_per_value, Some(last.error_after / own));
    }
    if found.first() {
        for hidden in &machine.truth {
            let added = outcome.steps.iter().map(|s| &s.added).find(|a| a.label() == hidden.label()).unwrap();
            found.parameters.extend(beside_truth(hidden, added, &outcome.rotor));
        }
    }
    found
}

/// How many standard deviations each fitted parameter is off the truth.
fn beside_truth(hidden: &Hidden, added: &Candidate, better: &Rotor) -> Vec<(String, f64)> {
    let truth = |name: &str| &hidden.parameters[name];
    let number = |name: &str| truth(name).as_f64().unwrap();
    let mut all = Vec::new();
    for p in &added.parameters {
        let sd = p.sd.unwrap_or(0.0);
        let mut push = |name: &str, value: f64, truth: f64, sd: f64| {
            all.push((format!("{} {name}", hidden.label()), (value - truth).abs() / sd));
        };
        match (p.name.split_once(' '), p.value.as_slice()) {
            // one vector a probe
            (Some((name, k)), &[re, im]) => {
                let pair = &truth(name)[k.parse::<usize>().unwrap() - 1];
                push(&p.name, re, pair[0].as_f64().unwrap(), sd);
                push(&p.name, im, pair[1].as_f64().unwrap(), sd);
            }
            (None, &[re, im]) => {
                push(&p.name, re, truth(&p.name)[0].as_f64().unwrap(), sd);
                push(&p.name, im, truth(&p.name)[1].as_f64().unwrap(), sd);
            }
            (None, &[gain]) if p.name == "gain" => push("gain", gain, number("gain").abs(), sd),
            (None, &[phase]) if p.name == "phase" => {
                // a negative gain is half a turn
                let half = if number("gain") < 0.0 { std::f64::consts::PI } else { 0.0 };
                let turn = std::f64::consts::TAU;
                let off = (phase - number("phase") - half + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
                push("phase", off, 0.0, sd);
            }
            (None, &[slope]) if p.name == "slope" => {
                // both state the slope at a speed of their own
                let entry = better.effect.iter().find(|e| e.kind == hidden.effect).unwrap();
                let Some(ParameterValue::Real(own)) = entry.parameters.get("ref") else { panic!("no ref") };
                let ratio = number("ref") / own;
                let of = 1.0 + slope * (ratio - 1.0);
                push("slope", slope * ratio / of, number("slope"), sd * ratio / of.powi(2));
            }
            (None, &[value]) => push(&p.name, value, number(&p.name), sd),
            _ => panic!("{p:?}"),
        }
    }
    all
}

/// All machines of one kind.
struct Set {
    title: &'static str,
    found: Vec<Found>,
}

impl Set {
    fn new(title: &'static str, folder: &str, find: fn(&Machine) -> Found) -> Self {
        Self { title, found: machines(folder).iter().map(find).collect() }
    }

    fn hiding(&self) -> impl Iterator<Item = &Found> {
        self.found.iter().filter(|f| f.hides())
    }

    fn hiding_none(&self) -> impl Iterator<Item = &Found> {
        self.found.iter().filter(|f| !f.hides())
    }

    fn parameters(&self) -> impl Iterator<Item = &(String, f64)> {
        self.found.iter().flat_map(|f| &f.parameters)
    }

    fn median_time(&self) -> Duration {
        let mut times: Vec<Duration> = self.found.iter().map(|f| f.time).collect();
        times.sort();
        times[times.len() / 2]
    }

    /// Machines of `among` for which `holds` is not true, and whether those for which it is are enough.
    #[track_caller]
    fn assert_share<'a>(
        &self,
        what: &str,
        share: f64,
        among: impl Iterator<Item = &'a Found>,
        holds: fn(&Found) -> bool,
    ) {
        let all: Vec<&Found> = among.collect();
        let failed: Vec<String> = all.iter().filter(|f| !holds(f)).map(|f| format!("\n  {f}")).collect();
        let reached = 1.0 - failed.len() as f64 / all.len() as f64;
        assert!(
            reached >= share,
            "{}, {what}: {:.1} % of {}, to reach {:.0} %; not on{}",
            self.title,
            100.0 * reached,
            all.len(),
            100.0 * share,
            failed.concat()
        );
    }
}

/// The machines of each set, looked at once for all tests.
fn looked_at(
    once: &'static OnceLock<Set>,
    title: &'static str,
    folder: &str,
    find: fn(&Machine) -> Found,
) -> &'static Set {
    once.get_or_init(|| {
        let set = Set::new(title, folder, find);
        println!("\n{}; median time {:.2?} a machine", set.title, set.median_time());
        set.found.iter().for_each(|f| println!("  {f}"));
        set
    })
}

fn single() -> &'static Set {
    static SET: OnceLock<Set> = OnceLock::new();
    looked_at(&SET, "one effect", "single", diagnosed)
}

fn tolerance() -> &'static Set {
    static SET: OnceLock<Set> = OnceLock::new();
    looked_at(&SET, "one effect, inexact drawing", "tolerance", diagnosed)
}

fn double() -> &'static Set {
    static SET: OnceLock<Set> = OnceLock::new();
    looked_at(&SET, "two effects", "double", improved)
}

fn all_sets() -> [&'static Set; 3] {
    [single(), tolerance(), double()]
}

/// The table of docs/diagnosis.md.
fn table() -> String {
    let mut lines = vec![
        format!("| | {} | to reach |", all_sets().map(|s| s.title).join(" | ")),
        "|---|---|---|---|---|".to_string(),
    ];
    let mut row = |what: &str, cell: &dyn Fn(&Set) -> String, reach: &str| {
        lines.push(format!("| {what} | {} | {reach} |", all_sets().map(cell).join(" | ")));
    };
    let counted = |holding: usize, all: usize| {
        if all == 0 { "–".to_string() } else { format!("{holding} of {all}") }
    };
    row("machines, of which hide something", &|s| format!("{}, {}", s.found.len(), s.hiding().count()), "");
    row(
        "effect and place named first",
        &|s| counted(s.hiding().filter(|f| f.first()).count(), s.hiding().count()),
        "",
    );
    row(
        "first, or in the group that the data cannot tell apart",
        &|s| counted(s.hiding().filter(|f| f.right()).count(), s.hiding().count()),
        "97 %, 90 %, 85 %",
    );
    row(
        "the largest such group",
        &|s| s.found.iter().map(|f| f.group.len().max(1)).max().unwrap_or(0).to_string(),
        "",
    );
    row(
        "nothing hidden, nothing claimed",
        &|s| {
            let quiet = s.hiding_none().filter(|f| f.verdict == DiagnosisVerdict::Adequate);
            counted(quiet.count(), s.hiding_none().count())
        },
        "98 %, 93 %",
    );
    let from_to = |values: &mut dyn Iterator<Item = f64>| {
        let range = values.fold(f64::INFINITY..=f64::NEG_INFINITY, |r: RangeInclusive<f64>, v| {
            r.start().min(v)..=r.end().max(v)
        });
        format!("{:.2} to {:.2}", range.start(), range.end())
    };
    row(
        "χ² per value with the effect added",
        &|s| from_to(&mut s.found.iter().map(|f| f.chi2_per_value)),
        "0.9 to 1.1 \\*",
    );
    row(
        "error with the effect added, of the noise's own",
        &|s| from_to(&mut s.found.iter().filter_map(|f| f.error)),
        "0.9 to 1.1 \\*",
    );
    row(
        "true parameters inside the stated 95 % interval",
        &|s| counted(s.parameters().filter(|(_, off)| *off <= NINETY_FIVE).count(), s.parameters().count()),
        "90 %",
    );
    lines.join("\n")
}

#[test]
fn one_hidden_effect_is_named_first_or_in_its_group() {
    let set = single();
    set.assert_share("right", 0.97, set.hiding(), Found::right);
}

/// What only `tests/all` runs.
mod slow {
    mod far_drawing;
    mod film;
    mod mistakes;
    mod noise;
    mod ordinary;
    mod pedestals;
    mod plan;
    mod table_machines;
    mod train;
    mod unlisted;

    use super::*;

    #[test]
    fn one_hidden_effect_is_found_though_the_drawing_is_inexact() {
        let set = tolerance();
        set.assert_share("right", 0.90, set.hiding(), Found::right);
    }

    #[test]
    fn two_hidden_effects_are_both_found() {
        let set = double();
        set.assert_share("both found", 0.85, set.hiding(), Found::right);
    }

    #[test]
    fn nothing_is_claimed_where_nothing_hides() {
        let quiet = |f: &Found| f.verdict == DiagnosisVerdict::Adequate;
        let (single, tolerance) = (single(), tolerance());
        single.assert_share("nothing claimed", 0.98, single.hiding_none(), quiet);
        tolerance.assert_share("nothing claimed", 0.93, tolerance.hiding_none(), quiet);
    }

    #[test]
    fn with_the_effect_added_only_noise_is_left() {
        for set in all_sets() {
            set.assert_share("χ² per value near 1", 1.0, set.found.iter(), Found::chi2_is_near);
            set.assert_share("error near the noise's own", 1.0, set.found.iter(), Found::error_is_near);
        }
    }

    #[test]
    fn stated_intervals_hold_the_truth() {
        let all: Vec<&(String, f64)> = all_sets().into_iter().flat_map(Set::parameters).collect();
        let outside: Vec<_> = all.iter().filter(|(_, off)| off.is_nan() || *off > NINETY_FIVE).collect();
        let share = 1.0 - outside.len() as f64 / all.len() as f64;
        assert!(share >= 0.90, "{:.1} % of {}; not {outside:?}", 100.0 * share, all.len());
    }

    #[test]
    fn the_table_in_the_docs_is_current() {
        let page = std::fs::read_to_string(repository("docs/diagnosis.md")).unwrap();
        let table = table();
        let marked = page
            .split("<!-- machines -->")
            .nth(1)
            .expect("two <!-- machines --> in docs/diagnosis.md")
            .trim();
        assert!(
            marked == table,
            "paste this between the <!-- machines --> of docs/diagnosis.md:\n\n{table}\n"
        );
    }

    #[test]
    fn phases_reversed_are_recognised_on_every_machine() {
        let all = ["single", "tolerance", "double"].into_iter().flat_map(machines);
        let missed = sampled(3, all).filter_map(|m| {
            let mirrored = |r: &Reading| Reading {
                probes: r.probes.iter().map(|y| y.map(|y| y.conj())).collect(),
                ..r.clone()
            };
            let mirrored: Vec<Reading> = m.readings.iter().map(mirrored).collect();
            match diagnose(&m.rotor, &mirrored) {
                Err(e) if e.to_string().contains("reversed") => None,
                Err(e) => Some(format!("\n  {}, {}: {e}", m.name, m.truth_label())),
                Ok(d) => Some(format!("\n  {}, {}: {}", m.name, m.truth_label(), d.summary)),
            }
        });
        let missed: Vec<String> = missed.collect();
        assert!(missed.is_empty(), "{} were not:{}", missed.len(), missed.concat());
    }
}
