//! `improve`: diagnose and add until adequate.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, ImprovementOutcome, diagnose, improve_telling};
use rotor_edge_desktop::machine::drawing::{Rotor, UnusedProbe};
use rotor_edge_desktop::measurement::Reading;

use super::diagnose::fitted::{self, Fitted};
use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::diagnose::ImprovementAnswer;
use crate::command::shell;
use crate::edge::Redundancy;
use crate::render;
use crate::render::waterfall::Stage;
use crate::say;
use crate::terminal;

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
    /// Write the model even if the missing effect is unknown
    #[arg(long)]
    even_so: bool,
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
            let text = terminal::fit(&render::improve::step_text(&step.into()), terminal::columns());
            let _ = std::io::stdout().write_all(text.as_bytes());
        }
    });
    working.finish_and_clear();
    let outcome = arguments.measured.named(outcome)?;
    let mut answer = ImprovementAnswer::from(&outcome);
    answer.remarks.extend(not_used(&rotor));
    answer.written =
        arguments.even_so || outcome.verdict != DiagnosisVerdict::Unknown && outcome.mistake.is_none();
    let next = next(arguments, &outcome);
    let fits =
        arguments.form.report.as_ref().map(|_| fits(&rotor, &readings, &outcome, &answer)).transpose()?;
    if answer.written {
        output::model_of_its_data(&arguments.output, &outcome.rotor, &readings)?;
    }
    if let (Some(path), Some(fits)) = (&arguments.form.report, &fits) {
        let drawn = fitted::curves(fits, &readings);
        let (words, command) = next.clone();
        let story = render::improve::story(&answer, &drawn, (words, Some(command)));
        let sections = render::improve::sections(&answer, &stages(&outcome, &readings)?, &rotor, &drawn);
        output::story(path, &format!("{}: before and after", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::improve::text(&answer));
    let (words, command) = next;
    if answer.written {
        say!("\nWritten to {}.", arguments.output.display());
    } else if answer.mistake.is_some() {
        say!(
            "\nNothing is written: correct the mistake first. --even-so writes the model with the mistake in it."
        );
    } else {
        say!(
            "\nNothing is written: without the unknown cause no model predicts this machine. --even-so writes it as far as it goes."
        );
    }
    say!("Next: {words}\n  {command}");
    Ok(None)
}

/// The probes that are not used, and what is left without them.
fn not_used(rotor: &Rotor) -> Option<String> {
    let names: Vec<&str> = rotor.unused.iter().map(UnusedProbe::name).collect();
    let words = Redundancy::of(rotor).words();
    (!names.is_empty()).then(|| format!("Not used: {}. Readings have {words}.", names.join(", ")))
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, outcome: &ImprovementOutcome) -> (String, String) {
    let path = shell::path(&arguments.output);
    let diagnose = |path: String| {
        format!(
            "rotor-edge diagnose {path} {}{}",
            shell::path(&arguments.measured.data),
            arguments.measured.runout
        )
    };
    if outcome.mistake.is_some() {
        let words = "correct the rotor's file or the measurement, and diagnose it again";
        return (words.into(), diagnose(shell::path(&arguments.measured.rotor)));
    }
    match outcome.verdict {
        DiagnosisVerdict::Adequate => (
            "follow the unbalance through a record of days".into(),
            format!("rotor-edge track {path} RECORD.csv"),
        ),
        DiagnosisVerdict::Unknown if !arguments.even_so => (
            "inspect what the unknown cause points at, and see what to measure".into(),
            diagnose(shell::path(&arguments.measured.rotor)),
        ),
        _ => ("see what the model still lacks, and what to measure".into(), diagnose(path)),
    }
}

/// What a diagnosis says of the model as it was and with every step; of those between, which `improve` does not need, it is
/// made here.
fn stages(outcome: &ImprovementOutcome, readings: &[Reading]) -> Result<Vec<Stage>> {
    let [before, after] = Stage::ends(outcome);
    let Some((_, between)) = outcome.steps.split_last() else { return Ok(vec![before]) };
    let mut stages = vec![before];
    for step in between {
        stages.push(Stage::between(step.added.label(), &diagnose(&step.rotor, readings)?));
    }
    stages.push(after);
    Ok(stages)
}

/// The model as it was, and with every step.
fn fits(
    rotor: &Rotor,
    readings: &[Reading],
    outcome: &ImprovementOutcome,
    answer: &ImprovementAnswer,
) -> Result<Vec<Fitted>> {
    let mut fits = vec![Fitted::new("as it was", rotor, readings)?];
    for (step, told) in outcome.steps.iter().zip(&answer.steps) {
        fits.push(Fitted::new(format!("with {}", told.fitted.words()), &step.rotor, readings)?);
    }
    Ok(fits)
}
