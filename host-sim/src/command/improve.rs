//! `improve`: diagnose and add until adequate.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, ImprovementOutcome, improve_telling};
use rotor_edge_desktop::machine::drawing::{Rotor, UnusedProbe};
use rotor_edge_desktop::measurement::Reading;

use super::diagnose::fitted::Fitted;
use super::diagnose::report;
use super::diagnose::{machine, story};
use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::diagnose::{ImprovementAnswer, StepAnswer};
use crate::command::shell;
use crate::edge::Redundancy;
use crate::render::findings;
use crate::render::{PageTable, Section, Story};

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    /// Where to write the better model
    #[arg(short, long)]
    output: PathBuf,
    /// Leave out a probe that cannot be trusted, by its name; may be given several times. The written model has it with
    /// used = false: no command uses its readings, and the controller masks it
    #[arg(long, value_name = "PROBE")]
    without: Vec<String>,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let (rotor, readings) = arguments.measured.read_without(&arguments.without)?;
    let mut added = 0;
    let (working, hear) = listener.search("effects and sets of them tried");
    let outcome = improve_telling(&rotor, &readings, &hear, |step| {
        working.finish_and_clear();
        added += 1;
        listener.step(added, None);
        if !arguments.form.json {
            // nobody may be reading, and the model is to be written all the same
            let _ = std::io::stdout().write_all(step_text(&step.into()).as_bytes());
        }
    });
    working.finish_and_clear();
    let outcome = outcome?;
    let mut answer = ImprovementAnswer::from(&outcome);
    answer.remarks.extend(not_used(&rotor));
    let next = next(arguments, outcome.verdict);
    let page = arguments
        .form
        .report
        .as_ref()
        .map(|_| page(&rotor, &readings, &outcome, &answer, &next))
        .transpose()?;
    output::model_of_its_data(&arguments.output, &outcome.rotor, &readings)?;
    if let (Some(path), Some((story, sections))) = (&arguments.form.report, page) {
        output::story(path, &format!("{}: before and after", rotor.name), Some(&story), sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    println!("{}: {}", answer.verdict, answer.summary);
    for line in answer.refuted_runs.iter().map(|r| &r.words).chain(&answer.remarks) {
        println!("  {line}");
    }
    println!("  {}", findings::noise(&answer.noise));
    findings::planes(&answer.determined).iter().for_each(|line| println!("  {line}"));
    if let Some(cause) = &answer.unknown {
        println!("\n  {}", findings::unknown(cause));
    }
    let (words, command) = next;
    println!("\nWritten to {}.\nNext: {words}\n  {command}", arguments.output.display());
    Ok(None)
}

/// The probes that are not used, and what is left without them.
fn not_used(rotor: &Rotor) -> Option<String> {
    let names: Vec<&str> = rotor.unused.iter().map(UnusedProbe::name).collect();
    let words = Redundancy::of(rotor).words();
    (!names.is_empty()).then(|| format!("Not used: {}. Readings have {words}.", names.join(", ")))
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, verdict: DiagnosisVerdict) -> (String, String) {
    let path = shell::path(&arguments.output);
    match verdict {
        DiagnosisVerdict::Adequate => (
            "follow the unbalance through a record of days".into(),
            format!("rotor-edge track {path} RECORD.csv"),
        ),
        _ => (
            "see what is left, and what to measure".into(),
            format!(
                "rotor-edge diagnose {path} {}{}",
                shell::path(&arguments.measured.data),
                arguments.measured.runout
            ),
        ),
    }
}

fn page(
    rotor: &Rotor,
    readings: &[Reading],
    outcome: &ImprovementOutcome,
    answer: &ImprovementAnswer,
    (words, command): &(String, String),
) -> Result<(Story, Vec<Section>)> {
    let mut fits = vec![Fitted::new("as it was", rotor, readings)?];
    for step in &outcome.steps {
        fits.push(Fitted::new(format!("with {}", machine::words(&step.added)), &step.rotor, readings)?);
    }
    let story = story::of_improvement(outcome, readings, &fits, (words.clone(), Some(command.clone())));
    let mut sections = vec![found(outcome, answer)];
    if fits.len() > 2 {
        fits.drain(1..fits.len() - 1);
    }
    sections.extend(report::compared(rotor, readings, &fits));
    sections.push(findings::section(&answer.noise, &answer.determined, answer.unknown.as_ref()));
    Ok((story, sections))
}

/// The verdict, and what was added.
fn found(outcome: &ImprovementOutcome, answer: &ImprovementAnswer) -> Section {
    let lines = answer.refuted_runs.iter().map(|r| r.words.clone()).chain(answer.remarks.iter().cloned());
    let seen = outcome.steps.iter().map(|s| format!("{}: {}", s.added.label(), s.added.explanation()));
    let row = |s: &StepAnswer| {
        let line = |line: String| vec![s.fitted.label.clone(), line];
        findings::parameters(&s.fitted).into_iter().map(line).collect::<Vec<_>>()
    };
    let added = PageTable {
        caption: "What was added, each with its parameters ± one standard deviation".into(),
        columns: ["effect", "parameter"].map(String::from).to_vec(),
        rows: answer.steps.iter().flat_map(row).collect(),
    };
    Section {
        heading: "What was found".into(),
        paragraphs: [format!("{}: {}", answer.verdict, answer.summary)]
            .into_iter()
            .chain(lines)
            .chain(seen)
            .collect(),
        tables: if added.rows.is_empty() { Vec::new() } else { vec![added] },
        figures: Vec::new(),
    }
}

/// A step in words, a line each.
fn step_text(step: &StepAnswer) -> String {
    let mut text = format!(
        "+ {:<36} error {:.2} %, χ² per value {:.2}\n",
        step.fitted.label,
        step.error_after * 100.0,
        step.chi2_per_value
    );
    for line in findings::parameters(&step.fitted) {
        text += &format!("    {line}\n");
    }
    if !step.group.is_empty() {
        text += &format!("    the data cannot tell apart: {}\n", step.group.join(", "));
    }
    text
}
