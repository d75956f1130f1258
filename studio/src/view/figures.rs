//! The figures of the current model beside what is tried: those of the program's reports.

use std::sync::Arc;

use anyhow::Result;
use rotor_edge::render::chart::Chart;
use rotor_edge::render::{ComparedModel, Drawing, Figure, comparison_sections};
use rotor_edge_desktop::compare::probe_pairs;
use serde::Serialize;

use crate::session::analysis::{Analysis, moved};
use crate::session::{BRANCHES, Session};
use crate::workbench::Bench;

/// Heading of the section of errors, which a person looks at last.
const WHERE: &str = "Where it fails";

#[derive(Debug, Serialize)]
pub struct FiguresView {
    pub tab: String,
    pub figures: Vec<FigureView>,
    /// The error with numbers that were moved by hand.
    pub moved: Option<MovedView>,
}

#[derive(Debug, Serialize)]
pub struct FigureView {
    id: String,
    /// The element, to be made when the figure is new; `None` where it is there.
    markup: Option<String>,
    chart: Option<Chart>,
}

#[derive(Debug, Serialize)]
pub struct MovedView {
    pub error: String,
    pub chi2: String,
    /// Evaluations of the model that it took.
    pub evaluations: usize,
}

/// Headings of the sections, of the figures that there are for these readings.
pub fn tabs(session: &Session) -> Vec<String> {
    let sections = comparison_sections(&session.given, &session.readings, &[]);
    let has_orbits = !probe_pairs(&session.given).is_empty();
    let (mut places, mut tabs) = (Vec::new(), Vec::new());
    for heading in sections.into_iter().map(|s| s.heading) {
        let run = heading.strip_prefix("Polar").or_else(|| heading.strip_prefix("Amplitude over time"));
        match run.filter(|_| has_orbits) {
            // orbits are drawn beside a model alone
            Some(run) => tabs.extend([heading.clone(), format!("Orbits{run}")]),
            None if heading == WHERE => places.push(heading),
            None => tabs.push(heading),
        }
    }
    tabs.append(&mut places);
    tabs
}

/// The figures of one tab.
///
/// # Errors
/// If a model cannot be fitted.
pub fn of_tab(bench: &mut Bench, tab: &str) -> Result<FiguresView> {
    let (figures, moved) = drawn(bench, tab)?;
    let element = |figure: &Figure| Some(figure.markup().into_string());
    let figures = figures.iter().map(|figure| FigureView { markup: element(figure), ..numbers(figure) });
    Ok(FiguresView { tab: tab.into(), figures: figures.collect(), moved })
}

/// The same for a page that has their elements.
///
/// # Errors
/// If a model cannot be fitted.
pub fn again(bench: &mut Bench, tab: &str) -> Result<FiguresView> {
    let (figures, moved) = drawn(bench, tab)?;
    Ok(FiguresView { tab: tab.into(), figures: figures.iter().map(numbers).collect(), moved })
}

fn drawn(bench: &mut Bench, tab: &str) -> Result<(Vec<Figure>, Option<MovedView>)> {
    let session = bench.opened()?.clone();
    let step = session.current().clone();
    let current = bench.analysis(&step)?;
    let (models, told) = models(bench, &session, &current)?;
    let sections = comparison_sections(&session.given, &session.readings, &models);
    let section = sections.into_iter().find(|s| s.heading == tab);
    Ok((section.map(|s| s.figures).unwrap_or_default(), told))
}

/// The current model, and the one that is held beside it: numbers moved by hand, an effect that is looked at, or the other branch.
fn models(
    bench: &mut Bench,
    session: &Session,
    current: &Arc<Analysis>,
) -> Result<(Vec<ComparedModel>, Option<MovedView>)> {
    let first = current.whole.clone();
    if let Some(rotor) = &session.moved {
        let (model, evaluations) = moved(session, rotor, current)?;
        let told = MovedView {
            error: super::per_cent(model.comparison.relative_error),
            chi2: rotor_edge::scale::three_digits(model.comparison.chi2_per_value),
            evaluations,
        };
        return Ok((vec![first, model], Some(told)));
    }
    if let Some(step) = &session.preview {
        return Ok((vec![first, bench.analysis(step)?.whole.clone()], None));
    }
    let Some(other) = (0..session.branches.len()).find(|k| *k != session.branch) else {
        return Ok((vec![first], None));
    };
    let step = session.branches[other].current().clone();
    let mut models = vec![first, bench.analysis(&step)?.whole.clone()];
    for (model, branch) in models.iter_mut().zip([session.branch, other]) {
        let label = &model.prediction.label;
        model.prediction.label = format!("{}: {label}", BRANCHES[branch]);
    }
    Ok((models, None))
}

fn numbers(figure: &Figure) -> FigureView {
    let chart = match &figure.drawing {
        Drawing::Chart(chart) => Some(chart.clone()),
        Drawing::Markup(_) => None,
    };
    FigureView { id: figure.id.clone(), markup: None, chart }
}
