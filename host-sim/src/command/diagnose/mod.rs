//! `diagnose`: which physical effect is missing.

pub mod fitted;
pub mod machine;
pub mod report;
pub mod story;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, diagnose_telling};

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::diagnose::DiagnosisAnswer;
use crate::command::shell;
use crate::render::findings;

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
    let answer = DiagnosisAnswer::from(&found);
    if let Some(path) = &arguments.form.report {
        let (story, sections) = report::page(&rotor, &readings, &found, &answer, next(arguments, &found))?;
        let title = format!("{}: what is missing in the model", rotor.name);
        output::story(path, &title, Some(&story), sections)?;
    }
    if arguments.form.json {
        return output::answer_in_order(&answer);
    }
    print(&answer, arguments.top);
    let (words, command) = next(arguments, &found);
    println!("\nNext: {words}{}", command.map_or(String::new(), |command| format!("\n  {command}")));
    Ok(None)
}

fn print(found: &DiagnosisAnswer, top: usize) {
    println!("{}: {}", found.verdict, found.summary);
    for line in found.refuted_runs.iter().map(|r| &r.words).chain(&found.remarks) {
        println!("  {line}");
    }
    println!(
        "\n  model as it is: error {:.2} %, χ² per value {:.2}",
        found.error_before * 100.0,
        found.chi2_per_value
    );
    println!("  {}", findings::noise(&found.noise));
    findings::planes(&found.determined).iter().for_each(|line| println!("  {line}"));
    if let Some(cause) = &found.unknown {
        println!("\n  {}", findings::unknown(cause));
    }
    println!("\n  candidate                           probability   evidence   error after   χ² per value");
    if let Some(cause) = &found.unknown {
        println!("  {:<36} {:>9.1} %", findings::OUTSIDE, cause.probability * 100.0);
    }
    for c in found.candidates.iter().take(top) {
        println!(
            "  {:<36} {:>9.1} % {:>10.1} {:>11.2} % {:>14.2}{}",
            c.fitted.label,
            c.probability * 100.0,
            c.twice_log_bayes_factor,
            c.error_after * 100.0,
            c.chi2_per_value,
            if c.disqualified.is_some() { "   ruled out" } else { "" }
        );
    }
    println!("  (evidence: twice the logarithm of the odds over the model alone; above 10 is strong)");
    if let Some(best) = &found.named {
        println!("\n{}", best.fitted.label);
        for p in findings::parameters(&best.fitted) {
            println!("  {p}");
        }
        println!("\n  {}", best.explanation);
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
