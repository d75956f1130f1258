//! `balance`: correction weights from the identified model and from the trial runs alone; without a rotor's file from those.

mod fitting;
mod trial_only;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::Error;
use rotor_edge_desktop::balance::model::from_model;
use rotor_edge_desktop::balance::trial_runs::from_trial_runs;
use rotor_edge_desktop::balance::{BalancePlan, Balanced};
use rotor_edge_desktop::units::SAME_SPEED;

use super::listener::Listener;
use super::output::{self, Json};
use super::startup::range;
use crate::answers::balance::{AngleSense, BalanceAnswer, LEAST_CHANCE, WayAnswer};
use crate::answers::shared::ZERO_TO_PEAK;
use crate::render;
use crate::terminal;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml, preferably written by `improve` or `startup`
    #[arg(required_unless_present = "trial_only")]
    rotor: Option<PathBuf>,
    /// Runs of this rotor with trial weights, measured.csv
    #[arg(required_unless_present = "trial_only")]
    data: Option<PathBuf>,
    /// Planes to put weights into [default: all]
    #[arg(long, value_delimiter = ',')]
    planes: Vec<String>,
    #[command(flatten)]
    fitting: fitting::Fitting,
    /// Speeds at which vibration is minimised, rpm, as in 600..4200 [default: all measured speeds]
    #[arg(long, value_parser = range)]
    range: Option<[f64; 2]>,
    /// Relative difference up to which speeds of two runs count as equal
    #[arg(long, value_name = "RELATIVE", default_value_t = SAME_SPEED)]
    same_speed: f64,
    /// Interpolate trial runs at different speeds, such as run-ups, to the speeds of the run with the fewest
    #[arg(long, conflicts_with = "coefficients")]
    interpolate: bool,
    /// Speed at which the balance grade is stated, rpm [default: the fastest that was measured]
    #[arg(long, conflicts_with = "trial_only")]
    service_rpm: Option<f64>,
    /// Count angles against the rotation, as the degree marks of many couplings do
    #[arg(long)]
    against_rotation: bool,
    #[command(flatten)]
    alone: trial_only::Options,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    if let Some(value) = arguments.service_rpm.filter(|v| !(*v > 0.0 && v.is_finite())) {
        bail!("--service-rpm must be a positive number, not {value}");
    }
    if !(0.0..0.5).contains(&arguments.same_speed) {
        bail!("--same-speed must be from 0 to 0.5, as in 0.01 for 1 %, not {}", arguments.same_speed);
    }
    match (&arguments.rotor, &arguments.data) {
        (Some(rotor), Some(data)) => by_rotor(rotor, data, arguments, listener),
        _ => trial_only::run(arguments),
    }
}

fn by_rotor(rotor: &Path, data: &Path, arguments: &Arguments, listener: Listener) -> Result<Json> {
    let (rotor, readings) = output::read(rotor, data, &arguments.runout)?;
    let speeds = || readings.iter().map(|r| r.speed_rpm);
    let fastest_rpm = speeds().fold(0.0, f64::max);
    let planes = BalancePlan::planes_named(&rotor, &arguments.planes)?;
    let wanted = arguments.fitting.wanted(arguments.against_rotation)?;
    wanted.check(&rotor.plane.iter().map(|plane| plane.name.clone()).collect::<Vec<_>>())?;
    let plan = BalancePlan {
        wanted,
        range_rpm: arguments.range.unwrap_or([speeds().fold(f64::INFINITY, f64::min), fastest_rpm]),
        service_rpm: arguments.service_rpm.unwrap_or(fastest_rpm),
        same_speed: arguments.same_speed,
        interpolate: arguments.interpolate,
        planes,
    };
    let working = listener.spinner("fitting the model");
    let tried = [
        ("identified model", from_model(&rotor, &readings, &plan)),
        ("trial runs alone", from_trial_runs(&rotor, &readings, &plan)),
    ];
    working.finish_and_clear();
    let (mut ways, mut remarks) = (Vec::new(), Vec::new());
    for (name, found) in tried {
        match found {
            Ok(found) => {
                remarks.extend(found.remarks.iter().cloned().chain(doubt(name, &found)));
                ways.push((name, found));
            }
            // by whatever way it shows, all others are as wrong
            Err(why @ Error::ReversedPhases(_)) => bail!("{}: no weights: {why}", data.display()),
            Err(why) => remarks.push(format!("No weights by the {name}: {why}.")),
        }
    }
    if ways.is_empty() {
        bail!("{}: {}", data.display(), remarks.join(" "));
    }
    let planes: Vec<String> = plan.planes.iter().map(|p| rotor.plane[*p].name.clone()).collect();
    let sense = AngleSense::of(arguments.against_rotation);
    let answer = BalanceAnswer {
        angles: sense.words(),
        range_rpm: plan.range_rpm,
        service_rpm: plan.service_rpm,
        amplitude_convention: ZERO_TO_PEAK,
        ways: ways.iter().map(|(name, found)| WayAnswer::of(name, found, &planes, sense)).collect(),
        remarks,
    };
    if let Some(path) = &arguments.form.report {
        let story = render::balance::story(&answer, plan.wanted.holes.as_ref());
        let sections = vec![render::balance::section(&answer)];
        output::story(path, &format!("{}: balance", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::balance::text(&answer));
    Ok(None)
}

/// What speaks against believing a way.
fn doubt(name: &str, found: &Balanced) -> Option<String> {
    let chi2 = found.misfit.filter(|misfit| misfit.chance() < LEAST_CHANCE)?.chi2_per_value;
    Some(match name {
        "identified model" => {
            format!(
                "The model misses (χ² per value {chi2:.2}, noise would be 1): `rotor-edge improve` it before balancing by it."
            )
        }
        _ => format!(
            "The trial runs contradict each other (χ² per value {chi2:.2}, noise would be 1): the machine changed between \
             them or is not linear."
        ),
    })
}
