//! `improve`: diagnose and add until adequate.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{RefutedRun, Step, Verdict, improve};
use serde_json::{Value, json};

use super::diagnose::{self, report};
use super::{entitled, output};

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
pub fn run(arguments: &Arguments) -> Result<()> {
    let (rotor, readings) = arguments.measured.read()?;
    let outcome = improve(&rotor, &readings, |step| {
        if !arguments.form.json {
            print(step);
        }
    })?;
    output::model(&arguments.output, &outcome.rotor, &readings)?;
    if let Some(path) = &arguments.form.report {
        let labels: Vec<String> = outcome.steps.iter().map(|s| s.added.label()).collect();
        let better = (!labels.is_empty()).then(|| (labels.join(" and "), outcome.rotor.clone()));
        let mut sections =
            vec![entitled::section(&outcome.scatter, &outcome.determined, outcome.unknown.as_ref())];
        sections.extend(report::before_and_after(&rotor, &readings, better.as_ref())?);
        output::report(path, &format!("{}: before and after", rotor.name), sections)?;
    }
    if arguments.form.json {
        return output::json(&json!({
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
            "Next: send it to the controller, here the simulated one\n  rotor-edge replay --identified --rotor {path} --record …"
        ),
        _ => println!(
            "Next: see what is left, and what to measure\n  rotor-edge diagnose {path} {}{}",
            arguments.measured.data.display(),
            arguments.measured.runout
        ),
    }
    Ok(())
}

fn print(step: &Step) {
    println!(
        "+ {:<36} error {:.2} %, χ² per value {:.2}",
        step.added.label(),
        step.error_after * 100.0,
        step.chi2_per_value
    );
    for line in diagnose::parameter_lines(&step.added) {
        println!("    {line}");
    }
    if !step.group.is_empty() {
        println!("    the data cannot tell apart: {}", step.group.join(", "));
    }
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
