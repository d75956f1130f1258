//! `estimate`: the unbalance of each run relative to a base run.

mod json;
mod report;
mod rows;

use anyhow::{Context, Result};
use clap::Args;
use rotor_edge_desktop::balance::estimate::{EstimateOptions, RunEstimates, estimate};
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use rows::{COLUMNS, rows};

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    /// The run that the others are compared with [default: the one without weights]
    #[arg(long)]
    base: Option<String>,
    /// Never use a run's own stated weights for it, nor to say whether they are true
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
    if let Some(path) = &arguments.form.report {
        output::report(
            path,
            &format!("{}: unbalance by run", rotor.name),
            report::sections(&found, &planes),
        )?;
    }
    if arguments.form.json {
        return output::as_json(&json::json(&found, &planes));
    }
    print(&found, &planes);
    Ok(None)
}

/// How the angles and magnitudes of the table are meant.
fn legend(found: &RunEstimates) -> String {
    format!(
        "Unbalance beyond that of run {}; angles from the keyphasor mark, with the rotation; intervals and regions hold it with 95 %.",
        found.base
    )
}

fn conditions(found: &RunEstimates) -> String {
    let each = found.determined.conditions.iter().map(|c| match c.speed_rpm {
        Some(speed_rpm) => format!("{:.1} at {speed_rpm:.0} rpm", c.condition),
        None => format!("{:.1} of all speeds together", c.condition),
    });
    format!("Condition of the influence of the planes: {}.", each.collect::<Vec<_>>().join(", "))
}

/// What cannot be true, one sentence a run.
fn refuted<'a>(found: &'a RunEstimates, planes: &'a [&str]) -> impl Iterator<Item = String> + 'a {
    found.refuted.iter().map(|r| {
        format!(
            "The stated weights of run {} cannot be true ({:.1} % sure): stated {}; found {}.",
            r.run,
            100.0 * r.probability,
            rows::placed(&r.stated_g_mm, planes),
            rows::placed(&r.found_g_mm, planes)
        )
    })
}

fn print(found: &RunEstimates, planes: &[&str]) {
    println!("{}", legend(found));
    output::table(&COLUMNS, &rows(found, planes));
    println!("\n{}", conditions(found));
    found.determined.words.iter().for_each(|words| println!("{words}"));
    refuted(found, planes).for_each(|line| println!("{line}"));
    found.remarks.iter().for_each(|remark| println!("{remark}"));
}
