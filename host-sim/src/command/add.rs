//! `add`: one effect more.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::diagnose::add;

use super::diagnose::fitted::{self, Fitted};
use super::output::{self, Json};
use crate::answers::diagnose::Addition;
use crate::command::shell;
use crate::render::{self, findings};
use crate::{say, terminal};

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// The effect, and the bearing, disk or probe it sits at, as in seal@"disk 3"
    effect: String,
    /// Measurements of this rotor, measured.csv
    #[arg(long)]
    data: PathBuf,
    /// Where to write the better model
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments) -> Result<Json> {
    let (rotor, readings) = output::read(&arguments.rotor, &arguments.data, &arguments.runout)?;
    let (kind, at) = match arguments.effect.split_once('@') {
        Some((kind, at)) => (kind, Some(at)),
        None => (arguments.effect.as_str(), None),
    };
    let better = add(&rotor, &readings, kind, at)?;
    let answer = Addition::from(&better);
    let models = || -> Result<_> {
        let before = Fitted::new("as it was", &rotor, &readings)?;
        let after = Fitted::new(format!("with {}", answer.fitted.words()), &better.rotor, &readings)?;
        Ok([before, after])
    };
    let models = arguments.form.report.as_ref().map(|_| models()).transpose()?;
    let next = arguments.next();
    output::model_of_its_data(&arguments.output, &better.rotor, &readings)?;
    if let (Some(path), Some(models)) = (&arguments.form.report, &models) {
        let drawn = fitted::curves(models, &readings);
        let story = render::improve::story_of_addition(&answer, &drawn, next.clone());
        let mut sections = vec![render::improve::addition(&answer)];
        sections.extend(render::fitted::compared(&rotor, &drawn));
        output::story(path, &format!("{}: before and after", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    say!("{} added", answer.fitted.label);
    findings::parameters(&answer.fitted).iter().for_each(|line| say!("  {line}"));
    say!("  error          {:>8.2} %  →  {:.2} %", answer.error_before * 100.0, answer.error_after * 100.0);
    say!("  χ² per value   {:>8.2}    →  {:.2}", answer.chi2_per_value_before, answer.chi2_per_value_after);
    terminal::print(&findings::fitted_text(&answer.bearings, &answer.dimensions, answer.model_adequate));
    say!("\nWritten to {}.", arguments.output.display());
    output::say_next(&next);
    Ok(None)
}

impl Arguments {
    /// What to do with the better model, and the command for it.
    fn next(&self) -> output::Next {
        let [rotor, data] = [&self.output, &self.data].map(|path| shell::path(path));
        (
            "see whether anything else is missing".into(),
            Some(format!("rotor-edge diagnose {rotor} {data}{}", self.runout)),
        )
    }
}
