//! `diagnose`: which physical effect is missing.

pub mod fitted;
pub mod machine;
pub mod report;
pub mod story;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{Candidate, Diagnosis, DiagnosisVerdict, RefutedRun, diagnose_telling};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::entitled;
use super::listener::Listener;
use super::output::{self, Json};
use super::quantity::quantity;
use crate::command::shell;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    /// Candidates to list
    #[arg(long, default_value_t = 8)]
    top: usize,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let (rotor, readings) = arguments.measured.read()?;
    let (working, told) = listener.search("effects tried");
    let found = diagnose_telling(&rotor, &readings, &told)?;
    working.finish_and_clear();
    if let Some(path) = &arguments.form.report {
        let (story, sections) = report::page(&rotor, &readings, &found, next(arguments, &found))?;
        let title = format!("{}: what is missing in the model", rotor.name);
        output::story(path, &title, Some(&story), sections)?;
    }
    if arguments.form.json {
        return output::as_json(&Summary::of(&found));
    }
    print(&found, arguments.top);
    let (words, command) = next(arguments, &found);
    println!("\nNext: {words}{}", command.map_or(String::new(), |command| format!("\n  {command}")));
    Ok(None)
}

fn print(found: &Diagnosis, top: usize) {
    println!("{}: {}", found.verdict.name(), found.summary);
    for line in found.refuted.iter().map(RefutedRun::words).chain(found.remarks.iter().cloned()) {
        println!("  {line}");
    }
    println!(
        "\n  model as it is: error {:.2} %, χ² per value {:.2}",
        found.error_before * 100.0,
        found.chi2_per_value
    );
    println!("  {}", entitled::noise(&found.scatter));
    entitled::planes(&found.determined).iter().for_each(|line| println!("  {line}"));
    if let Some(cause) = &found.unknown {
        println!("\n  {}", entitled::unknown(cause));
    }
    println!("\n  candidate                           probability   evidence   error after   χ² per value");
    if let Some(cause) = &found.unknown {
        println!("  {:<36} {:>9.1} %", entitled::OUTSIDE, cause.probability * 100.0);
    }
    for c in found.candidates.iter().take(top) {
        println!(
            "  {:<36} {:>9.1} % {:>10.1} {:>11.2} % {:>14.2}{}",
            c.label(),
            c.probability * 100.0,
            c.support,
            c.error_after * 100.0,
            c.chi2_per_value,
            if c.disqualified.is_some() { "   ruled out" } else { "" }
        );
    }
    println!("  (evidence: twice the logarithm of the odds over the model alone; above 10 is strong)");
    if let Some(best) = found.named() {
        println!("\n{}", best.label());
        for p in parameter_lines(best) {
            println!("  {p}");
        }
        println!("\n  {}", best.explanation());
        if let Some(h) = found.held_out {
            println!(
                "\n  On speeds that were left out: χ² per value {:.2} without it, {:.2} with it.",
                h.before, h.after
            );
        }
    }
    for group in &found.indistinguishable {
        println!("\nThese data cannot tell apart: {}", group.join(", "));
    }
    if !found.advice.is_empty() {
        println!("\nWhat would tell them apart, least effort first");
        for a in found.advice.iter().take(5) {
            let repeats =
                if a.repeats > 1 { format!(", so repeat it {} times", a.repeats) } else { String::new() };
            println!(
                "  {} (they differ by {:.1} standard deviations, most at {:.0} rpm{repeats})",
                a.measurement, a.separation_sd, a.speed_rpm
            );
        }
    }
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, found: &Diagnosis) -> (String, Option<String>) {
    let output::Measured { rotor, data, runout } = &arguments.measured;
    let (rotor, data) = (shell::path(rotor), shell::path(data));
    let with = |words: &str, command: String| (words.to_string(), Some(format!("rotor-edge {command}")));
    match (found.verdict, found.candidates.first()) {
        (DiagnosisVerdict::Undecided, _) if found.too_fast => {
            ("measure a run-up again, no faster than said above.".into(), None)
        }
        (DiagnosisVerdict::Missing, Some(best)) => with(
            "add it",
            format!("add {rotor} {} --data {data}{runout} -o better.toml", shell::word(&best.label())),
        ),
        (DiagnosisVerdict::Undecided, Some(_)) if !found.saturated && !found.indistinguishable.is_empty() => {
            with(
                "measure, or add the first of the group, which predicts this machine as well as any",
                format!("improve {rotor} {data}{runout} -o better.toml"),
            )
        }
        (DiagnosisVerdict::NotDetermined, _) => with(
            "measure what tells the planes apart: a run with a known trial weight in each, or speeds nearer to and beyond a \
             resonance; what corrections would leave is said by",
            format!("balance {rotor} {data}{runout}"),
        ),
        (DiagnosisVerdict::Unknown, _) => with(
            "look at the machine where the force acts; see where the model misses",
            format!("compare {rotor} {data}{runout} --report compare.html"),
        ),
        (DiagnosisVerdict::Adequate, _) => {
            with("follow the unbalance through a record of days", format!("track {rotor} RECORD.csv"))
        }
        _ => with(
            "measure what is listed above, or see where the model misses",
            format!("compare {rotor} {data}{runout}"),
        ),
    }
}

/// Parameters with their uncertainty, one line each.
pub fn parameter_lines(candidate: &Candidate) -> Vec<String> {
    let line = |p: &rotor_edge_desktop::diagnose::FittedParameter| match p.value.as_slice() {
        [re, im] => {
            let (size, angle) = (re.hypot(*im), im.atan2(*re).to_degrees());
            format!("{} = {} at {angle:.1}°", p.name, quantity(size, p.sd, p.unit))
        }
        other => {
            let value = other.first().copied().unwrap_or(f64::NAN);
            format!("{} = {}", p.name, quantity(value, p.sd, p.unit))
        }
    };
    let mut lines: Vec<String> = candidate.parameters.iter().map(line).collect();
    lines.extend(candidate.disqualified.clone());
    lines
}

/// What `diagnose --json` prints.
#[derive(Serialize)]
struct Summary {
    verdict: &'static str,
    summary: String,
    error_before: f64,
    chi2_per_value: f64,
    nothing_missing: f64,
    candidates: Vec<Value>,
    indistinguishable: Vec<Vec<String>>,
    held_out: Option<Value>,
    advice: Vec<Value>,
    remarks: Vec<String>,
    noise: Value,
    determined: Value,
    unknown: Option<Value>,
    refuted_runs: Value,
}

impl Summary {
    fn of(found: &Diagnosis) -> Self {
        let advice = |a: &rotor_edge_desktop::diagnose::Advice| json!({"measurement": a.measurement, "separation_sd": a.separation_sd, "speed_rpm": a.speed_rpm, "repeats": a.repeats});
        Self {
            verdict: found.verdict.name(),
            summary: found.summary.clone(),
            error_before: found.error_before,
            chi2_per_value: found.chi2_per_value,
            nothing_missing: found.nothing_missing,
            candidates: found.candidates.iter().map(candidate_json).collect(),
            indistinguishable: found.indistinguishable.clone(),
            held_out: found.held_out.map(|h| json!({"before": h.before, "after": h.after})),
            advice: found.advice.iter().map(advice).collect(),
            remarks: found.remarks.clone(),
            noise: entitled::noise_json(&found.scatter),
            determined: entitled::determined_json(&found.determined),
            unknown: found.unknown.as_ref().map(entitled::unknown_json),
            refuted_runs: entitled::refuted_json(&found.refuted),
        }
    }
}

/// A candidate as JSON; parameters by name, phasors as `[real, imaginary]`.
pub fn candidate_json(c: &Candidate) -> Value {
    let (mut parameters, mut uncertainty, mut units) = (Map::new(), Map::new(), Map::new());
    for p in &c.parameters {
        let value = if p.value.len() == 1 { json!(p.value[0]) } else { json!(p.value) };
        // the vectors of several probes, numbered, become one list
        match p.name.split_once(' ') {
            Some((name, _)) => {
                push(&mut parameters, name, value);
                push(&mut uncertainty, name, json!(p.sd));
                units.insert(name.into(), json!(p.unit));
            }
            None => {
                parameters.insert(p.name.clone(), value);
                uncertainty.insert(p.name.clone(), json!(p.sd));
                units.insert(p.name.clone(), json!(p.unit));
            }
        }
    }
    json!({
        "effect": c.effect,
        "at": c.at,
        "probability": c.probability,
        "delta_bic": c.support,
        "error_after": c.error_after,
        "chi2_per_value": c.chi2_per_value,
        "parameters": parameters,
        "uncertainty": uncertainty,
        "units": units,
        "disqualified": c.disqualified,
        "explanation": c.explanation(),
    })
}

fn push(map: &mut Map<String, Value>, name: &str, value: Value) {
    if let Value::Array(list) = map.entry(name.to_string()).or_insert_with(|| json!([])) {
        list.push(value);
    }
}
