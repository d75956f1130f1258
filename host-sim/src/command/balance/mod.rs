//! `balance`: correction weights from the identified model and from the trial runs alone; without a rotor's file from those.

mod answer;
mod fitting;
mod report;
mod trial_only;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::Error;
use rotor_edge_desktop::balance::model::from_model;
use rotor_edge_desktop::balance::places::{Filling, Piece};
use rotor_edge_desktop::balance::speeds::SAME_SPEED;
use rotor_edge_desktop::balance::trial_runs::from_trial_runs;
use rotor_edge_desktop::balance::{Balanced, Plan};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use serde_json::{Value, json};

use super::listener::Listener;
use super::output::{self, Json};
use super::startup::range;
use answer::BalanceResult;

/// Chance of a misfit from noise alone below which it is not noise.
const CHANCE: f64 = 1e-3;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, best as `improve` or `startup` wrote it, rotor.toml
    #[arg(required_unless_present = "trial_only")]
    rotor: Option<PathBuf>,
    /// Its runs with trial weights, measured.csv
    #[arg(required_unless_present = "trial_only")]
    data: Option<PathBuf>,
    /// Planes to put weights into [default: all]
    #[arg(long, value_delimiter = ',')]
    planes: Vec<String>,
    #[command(flatten)]
    fitting: fitting::Fitting,
    /// Speeds at which vibration counts, rpm, as in 600..4200 [default: all that were measured]
    #[arg(long, value_parser = range)]
    range: Option<[f64; 2]>,
    /// Speeds of runs that differ by no more than this, relative, are one
    #[arg(long, value_name = "RELATIVE", default_value_t = SAME_SPEED)]
    same_speed: f64,
    /// Trial runs at unlike speeds, as run-ups, are interpolated to the speeds of the one with the fewest
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
    let planes = Plan::planes_named(&rotor, &arguments.planes)?;
    let wanted = arguments.fitting.wanted(arguments.against_rotation)?;
    wanted.check(&rotor.plane.iter().map(|plane| plane.name.clone()).collect::<Vec<_>>())?;
    let plan = Plan {
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
    let answer = BalanceResult {
        ways,
        planes: plan.planes.iter().map(|p| rotor.plane[*p].name.clone()).collect(),
        range_rpm: plan.range_rpm,
        service_rpm: plan.service_rpm,
        against_rotation: arguments.against_rotation,
        remarks,
    };
    if let Some(path) = &arguments.form.report {
        output::report(path, &format!("{}: balance", rotor.name), report::sections(&answer))?;
    }
    if arguments.form.json {
        return output::as_json(&answer.json());
    }
    answer.print();
    Ok(None)
}

/// What speaks against believing a way.
fn doubt(name: &str, found: &Balanced) -> Option<String> {
    let chi2 = found.misfit.filter(|misfit| misfit.chance() < CHANCE)?.chi2_per_value;
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

impl BalanceResult {
    /// The direction in which angles count.
    pub fn direction(&self) -> &'static str {
        if self.against_rotation { "against the rotation" } else { "with the rotation" }
    }

    /// Columns of the table of weights.
    pub const COLUMNS: [&str; 5] = ["by", "plane", "unbalance to add, g·mm", "angle", "weight"];

    /// Rows of the table of weights.
    pub fn rows(&self) -> Vec<[String; 5]> {
        let mut rows = Vec::new();
        for (way, found) in &self.ways {
            for (plane, weight) in self.weights(found).into_iter().enumerate() {
                rows.push([
                    (*way).to_string(),
                    self.planes[plane].clone(),
                    format!("{:.3} ± {:.3}", weight.wanted_g_mm, weight.sd_g_mm),
                    format!("{:.1}° ± {:.1}°", weight.angle_deg, weight.angle_sd_deg),
                    self.pieces(weight.filling),
                ]);
            }
        }
        rows
    }

    /// What is put in, in words.
    fn pieces(&self, filling: &Filling) -> String {
        let piece = |p: &Piece| {
            let mass =
                p.mass_and_radius.map(|[mass_g, radius_mm]| format!("{mass_g:.3} g at {radius_mm} mm"));
            match (mass, p.hole) {
                (Some(mass), Some(hole)) => format!("{mass} in hole {hole}"),
                (Some(mass), None) => mass,
                (None, Some(hole)) => format!("{:.3} g·mm in hole {hole}", p.unbalance_g_mm.norm()),
                (None, None) => "–".into(),
            }
        };
        match &filling.pieces[..] {
            [] => "nothing".into(),
            pieces => pieces.iter().map(piece).collect::<Vec<_>>().join(", "),
        }
    }

    /// What the weights do, one sentence a way.
    pub fn effect_lines(&self) -> Vec<String> {
        let line = |(way, found): &(&str, Balanced)| {
            let (overall, grade) = (&found.overall, &found.grade);
            format!(
                "By the {way}: {:.2} µm become {:.2} ± {:.2} µm, {:.1} % less; balance grade G {:.2} becomes G {:.2}, at most G {:.2}.",
                overall.before_m * 1e6,
                overall.after_m * 1e6,
                overall.after_sd_m * 1e6,
                100.0 * overall.reduction(),
                grade.before_mm_s,
                grade.after_mm_s,
                grade.after_at_most_mm_s
            )
        };
        self.ways.iter().map(line).collect()
    }

    /// What the figures of [`effect_lines`](Self::effect_lines) are.
    pub fn legend(&self) -> String {
        let [from, to] = self.range_rpm;
        format!(
            "Amplitudes zero to peak, root mean square over probes and speeds from {from:.0} to {to:.0} rpm; grades of \
             ISO 21940-11 at {:.0} rpm, in mm/s.",
            self.service_rpm
        )
    }

    fn weights<'a>(&self, found: &'a Balanced) -> Vec<PlaneCorrection<'a>> {
        let told = |((wanted, filling), sd): ((&_, &'a Filling), &f64)| {
            let [wanted_g_mm, with_deg] = g_mm_deg(*wanted);
            let sd_g_mm = sd * G_MM;
            PlaneCorrection {
                wanted_g_mm,
                sd_g_mm,
                angle_deg: told_deg(with_deg, self.against_rotation),
                angle_sd_deg: (sd_g_mm / wanted_g_mm).atan().to_degrees(),
                filling,
            }
        };
        found.wanted_kg_m.iter().zip(&found.placed).zip(&found.sd_kg_m).map(told).collect()
    }

    fn placed(&self, piece: &Piece) -> Value {
        placed(piece, told_deg(piece.unbalance_g_mm.arg().to_degrees(), self.against_rotation))
    }

    fn print(&self) {
        println!(
            "Correction weights for the machine without trial weights; angles from the keyphasor mark, {}",
            self.direction()
        );
        output::table(&Self::COLUMNS, &self.rows());
        println!();
        self.effect_lines().iter().for_each(|line| println!("{line}"));
        println!("{}", self.legend());
        if !self.remarks.is_empty() {
            println!();
        }
        self.remarks.iter().for_each(|remark| println!("{remark}"));
    }

    fn json(&self) -> Value {
        let way = |(name, found): &(&str, Balanced)| {
            let weights = self.weights(found);
            json!({
                "by": name,
                "weights": weights.iter().zip(&self.planes).map(|(w, plane)| json!({
                    "plane": plane,
                    "unbalance_g_mm": w.wanted_g_mm,
                    "sd_g_mm": w.sd_g_mm,
                    "angle_deg": w.angle_deg,
                    "angle_sd_deg": w.angle_sd_deg,
                    "mass_g": w.mass_and_radius().map(|[mass_g, _]| mass_g),
                    "radius_mm": w.mass_and_radius().map(|[_, radius_mm]| radius_mm),
                    "placed_g_mm": w.filling.sum_g_mm().norm(),
                    "placed": w.filling.pieces.iter().map(|p| self.placed(p)).collect::<Vec<_>>(),
                })).collect::<Vec<_>>(),
                "vibration_um": {
                    "before": found.overall.before_m * 1e6,
                    "after": found.overall.after_m * 1e6,
                    "after_sd": found.overall.after_sd_m * 1e6,
                    "reduction": found.overall.reduction(),
                },
                "by_speed": found.vibration.iter().map(|v| json!({
                    "speed_rpm": v.speed_rpm,
                    "before_um": v.before_m * 1e6,
                    "after_um": v.after_m * 1e6,
                    "after_sd_um": v.after_sd_m * 1e6,
                })).collect::<Vec<_>>(),
                "grade_mm_s": {
                    "before": found.grade.before_mm_s,
                    "after": found.grade.after_mm_s,
                    "after_at_most": found.grade.after_at_most_mm_s,
                },
                "chi2_per_value": found.misfit.map(|m| m.chi2_per_value),
                "chance": found.misfit.map(|m| m.chance()),
            })
        };
        json!({
            "angles": self.direction(),
            "range_rpm": self.range_rpm,
            "service_rpm": self.service_rpm,
            "ways": self.ways.iter().map(way).collect::<Vec<_>>(),
            "remarks": self.remarks,
        })
    }
}

/// An angle with the rotation as it is told, degrees from 0 to 360.
fn told_deg(with_deg: f64, against_rotation: bool) -> f64 {
    let angle_deg = if against_rotation { -with_deg } else { with_deg };
    // an angle of −1e-15 is 0, not 360
    (angle_deg.rem_euclid(360.0) * 1e9).round() / 1e9 % 360.0
}

/// A weight in its place as JSON has it.
fn placed(piece: &Piece, angle_deg: f64) -> Value {
    json!({
        "hole": piece.hole,
        "magnitude_g_mm": piece.unbalance_g_mm.norm(),
        "angle_deg": angle_deg,
        "mass_g": piece.mass_and_radius.map(|[mass_g, _]| mass_g),
        "radius_mm": piece.mass_and_radius.map(|[_, radius_mm]| radius_mm),
    })
}

/// A weight as it is told.
struct PlaneCorrection<'a> {
    wanted_g_mm: f64,
    sd_g_mm: f64,
    angle_deg: f64,
    angle_sd_deg: f64,
    filling: &'a Filling,
}

impl PlaneCorrection<'_> {
    /// Of one piece; none where a weight is split, or no radius is known.
    fn mass_and_radius(&self) -> Option<[f64; 2]> {
        match &self.filling.pieces[..] {
            [one] => one.mass_and_radius,
            _ => None,
        }
    }
}
