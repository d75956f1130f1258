//! `compare`: model against measurement.

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::compare::Adequacy;
use rotor_edge_desktop::diagnose::judged_fit;
use rotor_edge_desktop::significance::percent;

use super::diagnose::fitted::{self, Fitted};
use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::compare::ComparisonAnswer;
use crate::command::shell;
use crate::render::{self, findings};
use crate::{say, terminal};

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
    let (best, sure) = arguments.measured.named(judged_fit(&rotor, &readings))?;
    working.finish_and_clear();
    let mut fit = Fitted::of("model", &rotor, &readings, best);
    fit.model.comparison = fit.model.comparison.judged_by(sure);
    let (words, command) = next(arguments, fit.model.comparison.verdict, sure);
    let answer = ComparisonAnswer::of(&fit.model.comparison, &fit.best);
    if let Some(path) = &arguments.form.report {
        let drawn = fitted::curves(std::slice::from_ref(&fit), &readings);
        let story = render::fitted::of_model(&drawn, sure, (words.clone(), Some(command.clone())));
        let mut sections = render::fitted::compared(&rotor, &drawn);
        sections.push(findings::section(&answer.noise, &answer.determined, Vec::new(), None));
        output::story(path, &format!("{}: model against measurement", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&text(&answer));
    say!("\nNext: {words}\n  {command}");
    Ok(None)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, verdict: Adequacy, sure: f64) -> (String, String) {
    let output::Measured { rotor, data, runout } = &arguments.measured;
    let words = match verdict {
        Adequacy::Adequate => format!(
            "noise explains the misfit ({} probable); see whether the data determine the unbalance",
            percent(sure)
        ),
        Adequacy::Misses => "learn which physical effect is missing".into(),
    };
    (words, format!("rotor-edge diagnose {} {}{runout}", shell::path(rotor), shell::path(data)))
}

fn text(c: &ComparisonAnswer) -> String {
    let mut text = String::new();
    text += &format!(
        "{}: error {:.2} %, χ² per value {:.2} (noise: 1), neighbouring speeds correlated by {:.2} (noise: 0)\n",
        c.verdict,
        c.relative_error * 100.0,
        c.chi2_per_value,
        c.neighbours.correlation
    );
    for remark in &c.remarks {
        text += &format!("  {remark}\n");
    }
    text += &format!(
        "  {} readings; residual {:.2} µm 0-pk a reading, {:.2} % of the features\n",
        c.readings,
        c.residual_um.mean,
        c.residual_ratio * 100.0
    );
    if let Some(w) = &c.worst {
        let run = w.run.as_ref().map_or(String::new(), |r| format!(" in run {r}"));
        text += &format!(
            "  worst at probe {}, {:.0} rpm{run}: {:.2} µm 0-pk, {:.1} times its noise\n",
            w.probe, w.speed_rpm, w.error_um, w.error_sigmas
        );
    }
    text += &format!("\n  {}\n", findings::noise(&c.noise));
    findings::planes(&c.determined).iter().for_each(|line| text += &format!("  {line}\n"));
    text += "\n  probe     residual, µm 0-pk     error %   χ² per value\n";
    for p in &c.by_probe {
        text += &format!(
            "  {:<10} {:>16.2} {:>11.2} {:>14.2}\n",
            p.probe,
            p.residual_um,
            p.relative_error * 100.0,
            p.chi2_per_value
        );
    }
    text += "\n  whirl at bearing     measured      model, µm 0-pk   misfit, times its noise\n";
    for w in &c.whirl {
        for (name, part) in [("forward", &w.forward), ("backward", &w.backward)] {
            text += &format!(
                "  {:<10} {name:<9} {:>12.2} {:>11.2} {:>14.2}\n",
                w.bearing, part.measured_um, part.model_um, part.error_sigmas
            );
        }
    }
    text
}
