//! The report of a session, as one page that needs nothing but itself.

use std::path::Path;

use anyhow::Result;
use rotor_edge::command::fitted::curves;
use rotor_edge::command::{fitted::Fitted, write_report};
use rotor_edge::render::{PageTable, Section, Story, diagnose, fitted, verdict};
use rotor_edge::scale::three_digits;

use crate::session::analysis::DiagnosisState;
use crate::view::commands;
use crate::workbench::Bench;

/// Writes the report of the current model: the verdict, the steps that led to it, figures before and after, and the command lines.
///
/// # Errors
/// If a model cannot be fitted, or the file cannot be written.
pub fn write(bench: &mut Bench, path: &Path) -> Result<()> {
    let session = bench.opened()?.clone();
    let step = session.current().clone();
    let model = session.fitted_to(&step)?;
    let taken = session.branches[session.branch].taken();
    let mut rows = Vec::new();
    let mut fits = Vec::new();
    for step in taken {
        let analysis = bench.analysis(step)?;
        let comparison = &analysis.fit.model.comparison;
        rows.push(vec![
            step.label(),
            format!("{} %", three_digits(100.0 * comparison.relative_error)),
            three_digits(comparison.chi2_per_value),
        ]);
        let to = session.fitted_to(step)?;
        fits.push(Fitted::of(step.words(), &to.rotor, &model.readings, analysis.fit.best.clone()));
    }
    let drawn = curves(&fits, &model.readings);
    let commands = commands::lines(&session);
    let next = ("see the command lines below".to_string(), commands.last().cloned());
    let steps = Section {
        heading: "Steps".into(),
        paragraphs: commands,
        tables: vec![PageTable {
            caption: "The fall of the error".into(),
            columns: ["step", "error", "χ² per value"].map(String::from).to_vec(),
            rows,
        }],
        figures: Vec::new(),
    };
    let title = format!("{}: effects that were tried", session.given.name);
    let (story, mut sections): (Story, Vec<Section>) = match bench.diagnosis(&step) {
        Some(DiagnosisState::Found(found)) => {
            (diagnose::story(&found, &drawn, next), diagnose::sections(&found, &session.given, &drawn))
        }
        _ => {
            let sure = f64::NAN;
            let said = verdict(&fits[fits.len() - 1].model.comparison);
            let story = fitted::of_model(&drawn, sure, next);
            let story = Story { verdict: said.into_iter().next().unwrap_or_default(), ..story };
            (story, fitted::compared(&session.given, &drawn))
        }
    };
    sections.insert(0, steps);
    write_report(path, &title, &story, sections)
}
