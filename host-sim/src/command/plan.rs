//! `plan`: what measurements could show before they are made.

mod request;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::plan::{PlanRequest, plan_telling};
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::plan::PlanAnswer;
use crate::command::shell;
use crate::render;
use crate::terminal;
use request::{Speeds, speeds, unbalance};

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Speeds of every run, rpm, as in 1000..6000:51, a range and the number of readings over it
    #[arg(long, value_name = "A..B:N", value_parser = speeds)]
    speeds: Speeds,
    /// Trial weights of every run, a table run,plane,magnitude_g_mm,angle_deg; a run without weights is added [default: the
    /// runs of the rotor's file]
    #[arg(long, value_name = "FILE")]
    runs: Option<PathBuf>,
    /// Assumed unbalance, g·mm and degrees: of all planes, or by plane as in A=300@45,B=200@120
    /// [default: that of the rotor's file, else what its balance grade permits]
    #[arg(long, value_name = "[PLANE=]X[@DEG]", value_delimiter = ',', value_parser = unbalance)]
    unbalance: Vec<(Option<String>, f64, f64)>,
    /// Effect that a further measurement is to tell from others, as in rub@"disk 1"; to be stated for each of them
    #[arg(long, value_name = "EFFECT[@PLACE]")]
    between: Vec<String>,
    /// Effects to list
    #[arg(long)]
    top: Option<usize>,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    if let [alone] = &arguments.between[..] {
        bail!(
            "--between names {alone} alone, expected two effects or more: those that a diagnosis cannot tell apart"
        );
    }
    let rotor = rotor_file::read(&arguments.rotor)?;
    let request = PlanRequest {
        runs: arguments.runs.as_ref().map(|path| request::runs(path, &rotor)).transpose()?,
        unbalance_kg_m: request::by_plane(&arguments.unbalance, &rotor)?,
        between: arguments.between.clone(),
        ..PlanRequest::at(arguments.speeds.all_rpm())
    };
    let (working, told) = listener.search("effects and measurements");
    let found = output::about(&arguments.rotor, plan_telling(&rotor, &request, &told));
    working.finish_and_clear();
    let answer = PlanAnswer::of(&rotor.name, &found?);
    if let Some(path) = &arguments.form.report {
        let story = render::plan::story(&answer, next(arguments, &answer));
        let title = format!("{}: what these measurements could show", rotor.name);
        output::story(path, &title, &story, render::plan::sections(&answer))?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::plan::text(&answer, arguments.top.unwrap_or(usize::MAX)));
    output::say_next(&next(arguments, &answer));
    Ok(None)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, answer: &PlanAnswer) -> output::Next {
    let rotor = shell::path(&arguments.rotor);
    let diagnose = Some(format!("rotor-edge diagnose {rotor} measured.csv"));
    let decides = answer.between.as_ref().and_then(|decision| decision.measurement.as_ref());
    let helps = || answer.next.first().filter(|best| best.gain >= render::plan::WORTH_MAKING);
    match decides.or_else(|| helps().map(|best| &best.measurement)) {
        Some(best) => {
            (format!("measure, if you can with {best} as well; then learn what is missing"), diagnose)
        }
        None => ("measure, then learn what is missing".into(), diagnose),
    }
}
