//! `compare`: model against measurement.

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::compare::{Adequacy, Comparison};
use rotor_edge_desktop::diagnose::{BestFit, nothing_missing};
use serde_json::{Value, json};

use super::diagnose::fitted::Fitted;
use super::diagnose::report;
use super::diagnose::story;
use super::entitled;
use super::listener::Listener;
use super::output::{self, Json};
use crate::command::shell;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    measured: output::Measured,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let (rotor, readings) = arguments.measured.read()?;
    let working = listener.spinner("fitting bearings and planes");
    let mut fit = Fitted::new("model", &rotor, &readings)?;
    let sure = nothing_missing(&rotor, &readings)?;
    working.finish_and_clear();
    fit.model.comparison = fit.model.comparison.judged_by(sure);
    let (words, command) = next(arguments, fit.model.comparison.verdict, sure);
    if let Some(path) = &arguments.form.report {
        let story = story::of_model(&readings, &fit, sure, (words.clone(), Some(command.clone())));
        let mut sections = report::compared(&rotor, &readings, std::slice::from_ref(&fit));
        sections.push(entitled::section(&fit.best.scatter, &fit.best.determined, None));
        output::story(path, &format!("{}: model against measurement", rotor.name), Some(&story), sections)?;
    }
    let Fitted { best, model } = fit;
    let comparison = model.comparison;
    if arguments.form.json {
        return output::as_json(&summary(&comparison, &best));
    }
    print(&comparison, &best);
    println!("\nNext: {words}\n  {command}");
    Ok(None)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, verdict: Adequacy, sure: f64) -> (String, String) {
    let output::Measured { rotor, data, runout } = &arguments.measured;
    let words = match verdict {
        Adequacy::Adequate => format!(
            "noise explains it, {:.0} % sure; whether the data determine what the model is for is said by",
            100.0 * sure
        ),
        Adequacy::Misses => "learn which physical effect is missing".into(),
    };
    (words, format!("rotor-edge diagnose {} {}{runout}", shell::path(rotor), shell::path(data)))
}

fn verdict(c: &Comparison) -> &'static str {
    match c.verdict {
        Adequacy::Adequate => "adequate",
        Adequacy::Misses => "misses",
    }
}

fn print(c: &Comparison, best: &BestFit) {
    println!(
        "{}: error {:.2} %, χ² per value {:.2} (noise: 1), neighbouring speeds correlated by {:.2} (noise: 0)",
        verdict(c),
        c.relative_error * 100.0,
        c.chi2_per_value,
        c.neighbours.correlation
    );
    for remark in &best.remarks {
        println!("  {remark}");
    }
    println!(
        "  {} readings; residual {:.2} µm a reading, {:.2} % of the features",
        c.readings,
        c.residual_um.mean,
        c.residual_ratio * 100.0
    );
    if let Some(w) = &c.worst {
        let run = w.run.as_ref().map_or(String::new(), |r| format!(" in run {r}"));
        println!(
            "  worst at probe {}, {:.0} rpm{run}: {:.2} µm, {:.1} times its noise",
            w.probe, w.speed_rpm, w.error_um, w.error_sigmas
        );
    }
    println!("\n  {}", entitled::noise(&best.scatter));
    entitled::planes(&best.determined).iter().for_each(|line| println!("  {line}"));
    println!("\n  probe        residual µm     error %   χ² per value");
    for p in &c.by_probe {
        println!(
            "  {:<10} {:>13.2} {:>11.2} {:>14.2}",
            p.probe,
            p.residual_um,
            p.relative_error * 100.0,
            p.chi2_per_value
        );
    }
    println!("\n  whirl at bearing      measured µm    model µm   misfit, times its noise");
    for w in &c.whirl {
        for (name, part) in [("forward", &w.forward), ("backward", &w.backward)] {
            println!(
                "  {:<10} {name:<9} {:>12.2} {:>11.2} {:>14.2}",
                w.bearing, part.measured_um, part.model_um, part.error_sigmas
            );
        }
    }
}

/// What `compare --json` prints.
fn summary(c: &Comparison, best: &BestFit) -> Value {
    let whirl = |p: &rotor_edge_desktop::compare::WhirlPart| json!({"measured_um": p.measured_um, "model_um": p.model_um, "error_um": p.error_um, "error_sigmas": p.error_sigmas});
    json!({
        "readings": c.readings,
        "residual_um": {"sum": c.residual_um.sum, "mean": c.residual_um.mean},
        "residual_ratio": c.residual_ratio,
        "relative_error": c.relative_error,
        "chi2_per_value": c.chi2_per_value,
        "chi2_p_value": c.chi2_p_value,
        "neighbours": {"correlation": c.neighbours.correlation, "z_score": c.neighbours.z_score, "p_value": c.neighbours.p_value},
        "verdict": verdict(c),
        "noise": entitled::noise_json(&best.scatter),
        "determined": entitled::determined_json(&best.determined),
        "reversed": c.reversed,
        "worst": c.worst.as_ref().map(|w| json!({
            "probe": w.probe, "speed_rpm": w.speed_rpm, "run": w.run, "error_um": w.error_um, "error_sigmas": w.error_sigmas,
        })),
        "by_probe": c.by_probe.iter().map(|p| json!({
            "probe": p.probe, "residual_um": p.residual_um, "relative_error": p.relative_error, "chi2_per_value": p.chi2_per_value,
        })).collect::<Vec<_>>(),
        "by_speed": c.by_speed.iter().map(|s| json!({
            "run": s.run, "speed_rpm": s.speed_rpm, "readings": s.readings, "residual_um": s.residual_um, "chi2_per_value": s.chi2_per_value,
        })).collect::<Vec<_>>(),
        "by_run": c.by_run.iter().map(|r| json!({
            "run": r.run, "readings": r.readings, "residual_um": r.residual_um, "relative_error": r.relative_error, "chi2_per_value": r.chi2_per_value,
        })).collect::<Vec<_>>(),
        "whirl": c.whirl.iter().map(|w| json!({
            "bearing": w.bearing, "forward": whirl(&w.forward), "backward": whirl(&w.backward),
        })).collect::<Vec<_>>(),
        "remarks": best.remarks,
        "nothing_missing": c.nothing_missing,
    })
}
