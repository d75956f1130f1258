//! `estimate`: the unbalance of each run relative to a base run.

use anyhow::{Context, Result};
use clap::Args;
use rotor_edge_desktop::balance::estimate::{EstimateOptions, estimate};
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use super::shell;
use crate::answers::estimate::EstimatesAnswer;
use crate::render;
use crate::terminal;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    /// The run that the others are compared with [default: the one without weights]
    #[arg(long)]
    base: Option<String>,
    /// Estimate each run, and check its stated weights, without using those weights
    #[arg(long)]
    leave_one_out: bool,
    /// Take all stated weights as true
    #[arg(long)]
    trust_weights: bool,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let rotor = rotor_file::read(&arguments.measured.rotor)?;
    let data = &arguments.measured.data;
    let readings = arguments.measured.runout.read_with_blind_runs(data, &rotor)?;
    let options = EstimateOptions {
        base: arguments.base.clone(),
        leave_one_out: arguments.leave_one_out,
        trust_weights: arguments.trust_weights,
    };
    let working = listener.spinner("learning from the runs");
    let found = estimate(&rotor, &readings, &options).with_context(|| data.display().to_string());
    working.finish_and_clear();
    let found = found?;
    let planes: Vec<&str> = rotor.plane.iter().map(|p| p.name.as_str()).collect();
    let answer = EstimatesAnswer::of(&found, &planes);
    if let Some(path) = &arguments.form.report {
        let story = render::estimate::story(&answer, arguments.next());
        let sections = vec![render::estimate::section(&answer)];
        output::story(path, &format!("{}: unbalance by run", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::estimate::text(&answer));
    output::say_next(&arguments.next());
    Ok(None)
}

impl Arguments {
    /// What to do with the estimates, and the command for it.
    fn next(&self) -> output::Next {
        let output::Measured { rotor, data, runout } = &self.measured;
        let files = format!("{} {}{runout}", shell::path(rotor), shell::path(data));
        ("see what correction weights would achieve".into(), Some(format!("rotor-edge balance {files}")))
    }
}
