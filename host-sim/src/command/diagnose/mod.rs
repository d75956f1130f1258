//! `diagnose`: which physical effect is missing.

pub mod fitted;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, TooFast, add, diagnose_telling};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::diagnose::{CandidateAnswer, DiagnosisAnswer};
use crate::command::shell;
use crate::render;
use crate::say;
use crate::terminal;
use fitted::Fitted;

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
    let found = arguments.measured.named(diagnose_telling(&rotor, &readings, &told));
    working.finish_and_clear();
    let found = found?;
    let answer = DiagnosisAnswer::from(&found);
    if let Some(path) = &arguments.form.report {
        let fits = fits(&rotor, &readings, &answer)?;
        let drawn = fitted::curves(&fits, &readings);
        let story = render::diagnose::story(&answer, &drawn, next(arguments, &found));
        let sections = render::diagnose::sections(&answer, &rotor, &drawn);
        let title = format!("{}: what is missing in the model", rotor.name);
        output::story(path, &title, &story, sections)?;
    }
    if arguments.form.json {
        return output::answer_in_order(&answer);
    }
    terminal::print(&render::diagnose::text(&answer, arguments.top));
    let (words, command) = next(arguments, &found);
    say!("\nNext: {words}{}", command.map_or(String::new(), |command| format!("\n  {command}")));
    Ok(None)
}

/// The model as it is, and with the best candidate, if one is claimed.
fn fits(rotor: &Rotor, readings: &[Reading], answer: &DiagnosisAnswer) -> Result<Vec<Fitted>> {
    let mut fits = vec![Fitted::new("model", rotor, readings)?];
    let is_claimed = |c: &&CandidateAnswer| c.disqualified.is_none() && c.twice_log_bayes_factor > 0.0;
    if let Some(best) = answer.named.as_ref().filter(is_claimed) {
        let better = add(rotor, readings, best.effect, best.at.as_deref())?.rotor;
        fits.push(Fitted::new(format!("with {}", best.fitted.words()), &better, readings)?);
    }
    Ok(fits)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, found: &Diagnosis) -> (String, Option<String>) {
    let output::Measured { rotor, data, runout } = &arguments.measured;
    let (rotor, data) = (shell::path(rotor), shell::path(data));
    let with = |words: &str, command: String| (words.to_string(), Some(format!("rotor-edge {command}")));
    if let Some(probe) = found.bad_probe.as_deref().map(shell::word) {
        return with(
            "inspect the probe, and go on without it",
            format!("improve {rotor} {data}{runout} --without {probe} -o better.toml"),
        );
    }
    if found.mistake.is_some() {
        return with(
            "correct the rotor's file or the measurement, and diagnose it again",
            format!("diagnose {rotor} {data}{runout}"),
        );
    }
    if !found.together.is_empty() {
        return with(
            "add them, one after the other, and see the error fall",
            format!("improve {rotor} {data}{runout} -o better.toml"),
        );
    }
    match (found.verdict, found.candidates.first()) {
        (DiagnosisVerdict::Undecided, _) if found.too_fast == Some(TooFast::Times) => {
            ("measure a slower run-up, at the rate stated above.".into(), None)
        }
        (DiagnosisVerdict::Undecided, _) if found.too_fast == Some(TooFast::Beats) => with(
            "state the times of the readings in a column time_d, days, and diagnose the run again as a transient",
            format!("diagnose {rotor} {data}{runout}"),
        ),
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
            "measure a run with a known trial weight in each plane, or speeds nearer to and beyond a resonance; see what \
             correction weights would achieve",
            format!("balance {rotor} {data}{runout}"),
        ),
        (DiagnosisVerdict::Unknown, _) => with(
            "see at which speeds and probes the model is wrong, and inspect the machine",
            format!("compare {rotor} {data}{runout} --report compare.html"),
        ),
        (DiagnosisVerdict::Adequate, _) => {
            with("follow the unbalance through a record of days", format!("track {rotor} RECORD.csv"))
        }
        _ => with(
            "take a measurement that is listed above, or see where the model is wrong",
            format!("compare {rotor} {data}{runout}"),
        ),
    }
}
