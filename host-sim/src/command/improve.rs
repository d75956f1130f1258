//! `improve`: diagnose and add until adequate.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{Outcome, RefutedRun, Step, Verdict, improve};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use serde_json::{Value, json};

use super::diagnose::{self, report};
use super::entitled;
use super::listener::Listener;
use super::output::{self, Json};
use crate::report::{Section, Table};

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    /// Where to write the better model
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    form: output::Form,
}

/// Runs the command.
pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let (rotor, readings) = arguments.measured.read()?;
    let mut added = 0;
    let outcome = improve(&rotor, &readings, |step| {
        added += 1;
        listener.step(added, None);
        if !arguments.form.json {
            // nobody may be reading, and the model is to be written all the same
            let _ = std::io::stdout().write_all(told(step).as_bytes());
        }
    })?;
    let page = arguments.form.report.as_ref().map(|_| sections(&rotor, &readings, &outcome)).transpose()?;
    output::model_of_its_data(&arguments.output, &outcome.rotor, &readings)?;
    if let (Some(path), Some(sections)) = (&arguments.form.report, page) {
        output::report(path, &format!("{}: before and after", rotor.name), sections)?;
    }
    if arguments.form.json {
        return output::as_json(&json!({
            "error_before": outcome.error_before,
            "chi2_per_value_before": outcome.chi2_per_value_before,
            "steps": outcome.steps.iter().map(step_json).collect::<Vec<_>>(),
            "verdict": outcome.verdict.name(),
            "summary": outcome.summary,
            "noise": entitled::noise_json(&outcome.scatter),
            "determined": entitled::determined_json(&outcome.determined),
            "unknown": outcome.unknown.as_ref().map(entitled::unknown_json),
            "refuted_runs": entitled::refuted_json(&outcome.refuted),
            "remarks": outcome.remarks,
        }));
    }
    println!("{}: {}", outcome.verdict.name(), outcome.summary);
    for line in outcome.refuted.iter().map(RefutedRun::words).chain(outcome.remarks.iter().cloned()) {
        println!("  {line}");
    }
    println!("  {}", entitled::noise(&outcome.scatter));
    entitled::planes(&outcome.determined).iter().for_each(|line| println!("  {line}"));
    if let Some(cause) = &outcome.unknown {
        println!("\n  {}", entitled::unknown(cause));
    }
    let path = arguments.output.display();
    println!("\nWritten to {path}.");
    match outcome.verdict {
        Verdict::Adequate => println!(
            "Next: play a record of days to it on the simulated controller\n  rotor-edge replay --identified --rotor {path} --record RECORD.csv"
        ),
        _ => println!(
            "Next: see what is left, and what to measure\n  rotor-edge diagnose {path} {}{}",
            arguments.measured.data.display(),
            arguments.measured.runout
        ),
    }
    Ok(None)
}

fn sections(rotor: &Rotor, readings: &[Reading], outcome: &Outcome) -> Result<Vec<Section>> {
    let labels: Vec<String> = outcome.steps.iter().map(|s| s.added.label()).collect();
    let better = (!labels.is_empty()).then(|| (labels.join(" and "), outcome.rotor.clone()));
    let entitled = entitled::section(&outcome.scatter, &outcome.determined, outcome.unknown.as_ref());
    let mut sections = vec![found(outcome), entitled];
    sections.extend(report::before_and_after(rotor, readings, better.as_ref())?);
    Ok(sections)
}

/// The verdict, and how the error fell with every effect.
fn found(outcome: &Outcome) -> Section {
    let lines = outcome.refuted.iter().map(RefutedRun::words).chain(outcome.remarks.iter().cloned());
    let added =
        |s: &Step| format!("{}: {}.", s.added.label(), diagnose::parameter_lines(&s.added).join("; "));
    let lines = lines.chain(outcome.steps.iter().map(added));
    let row = |what: String, error: f64, chi2: f64| {
        vec![what, format!("{:.2}", 100.0 * error), format!("{chi2:.2}")]
    };
    let before = row("as it was".into(), outcome.error_before, outcome.chi2_per_value_before);
    let steps = outcome
        .steps
        .iter()
        .map(|s| row(format!("with {}", s.added.label()), s.error_after, s.chi2_per_value));
    Section {
        heading: "What was found".into(),
        paragraphs: [format!("{}: {}", outcome.verdict.name(), outcome.summary)]
            .into_iter()
            .chain(lines)
            .collect(),
        tables: vec![Table {
            caption: "The error as effects are added, one after the other, of the fit that is closest in noise as stated".into(),
            columns: ["model", "error, %", "χ² per value (noise: 1)"].map(String::from).to_vec(),
            rows: std::iter::once(before).chain(steps).collect(),
        }],
        figures: Vec::new(),
    }
}

/// A step in words, a line each.
fn told(step: &Step) -> String {
    let mut text = format!(
        "+ {:<36} error {:.2} %, χ² per value {:.2}\n",
        step.added.label(),
        step.error_after * 100.0,
        step.chi2_per_value
    );
    for line in diagnose::parameter_lines(&step.added) {
        text += &format!("    {line}\n");
    }
    if !step.group.is_empty() {
        text += &format!("    the data cannot tell apart: {}\n", step.group.join(", "));
    }
    text
}

fn step_json(step: &Step) -> Value {
    let candidate = diagnose::candidate_json(&step.added);
    json!({
        "effect": step.added.effect,
        "at": step.added.at,
        "error_after": step.error_after,
        "chi2_per_value": step.chi2_per_value,
        "group": step.group,
        "parameters": candidate["parameters"],
        "uncertainty": candidate["uncertainty"],
    })
}
