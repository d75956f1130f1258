//! What `diagnose --report` says: the candidates, the best one explained, before and after.

use rotor_edge_desktop::diagnose::{Diagnosis, add};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::fitted::Fitted;
use super::{machine, story};
use crate::answers::diagnose::{AdviceAnswer, CandidateAnswer, DiagnosisAnswer};
use crate::render::bars::{Bar, bars};
use crate::render::findings::{self, OUTSIDE};
use crate::render::{ComparedModel, Figure, PageTable, Section, Story, comparison_sections};

/// Candidates that are drawn.
const DRAWN: usize = 10;

/// The page of a diagnosis.
///
/// # Errors
/// If the model, or the model with the best candidate, cannot be fitted again.
pub fn page(
    rotor: &Rotor,
    readings: &[Reading],
    found: &Diagnosis,
    answer: &DiagnosisAnswer,
    next: (String, Option<String>),
) -> Result<(Story, Vec<Section>), rotor_edge_desktop::Error> {
    let best = found.named().filter(|c| c.disqualified.is_none() && c.support > 0.0);
    let mut fits = vec![Fitted::new("model", rotor, readings)?];
    if let Some(best) = best {
        let better = add(rotor, readings, best.effect, best.at.as_deref())?.rotor;
        fits.push(Fitted::new(format!("with {}", machine::words(best)), &better, readings)?);
    }
    let findings = findings::section(&answer.noise, &answer.determined, answer.unknown.as_ref());
    let mut sections = vec![verdict(answer), candidates(answer), findings];
    sections.extend(compared(rotor, readings, &fits));
    Ok((story::of_diagnosis(found, readings, &fits, next), sections))
}

/// Where models fail, before and after.
pub fn compared(rotor: &Rotor, readings: &[Reading], fits: &[Fitted]) -> Vec<Section> {
    let models: Vec<ComparedModel> = fits.iter().map(|fit| fit.model.clone()).collect();
    comparison_sections(rotor, readings, &models)
}

/// The verdict and what would tell rivals apart.
pub fn verdict(found: &DiagnosisAnswer) -> Section {
    let mut paragraphs = vec![found.summary.clone()];
    paragraphs
        .extend(found.refuted_runs.iter().map(|r| r.words.clone()).chain(found.remarks.iter().cloned()));
    if let Some(best) = &found.named {
        paragraphs.push(format!("{}: {}", best.fitted.label, best.explanation));
    }
    for group in &found.indistinguishable {
        paragraphs.push(format!("These data cannot tell apart: {}.", group.join(", ")));
    }
    let row = |a: &AdviceAnswer| {
        vec![
            a.measurement.clone(),
            format!("{:.1}", a.separation_sd),
            format!("{:.0}", a.speed_rpm),
            a.repeats.to_string(),
        ]
    };
    let table = PageTable {
        caption: "What would tell them apart, least effort first".into(),
        columns: ["measurement", "rivals differ by, σ", "most at, rpm", "times"].map(String::from).to_vec(),
        rows: found.advice.iter().map(row).collect(),
    };
    let tables = if table.rows.is_empty() { Vec::new() } else { vec![table] };
    Section { heading: "Diagnosis".into(), paragraphs, tables, figures: Vec::new() }
}

/// Every candidate with its probability.
pub fn candidates(found: &DiagnosisAnswer) -> Section {
    let shown = || found.candidates.iter().take(DRAWN);
    let percent = |p: f64| format!("{:.1} %", p * 100.0);
    let bar = |c: &CandidateAnswer| Bar {
        label: c.fitted.label.clone(),
        share: c.probability,
        value: percent(c.probability),
        emphasised: c.probability >= 0.05,
        floor: None,
    };
    let row = |c: &CandidateAnswer| {
        let numbers = [
            percent(c.probability),
            format!("{:.1}", c.twice_log_bayes_factor),
            format!("{:.2} %", c.error_after * 100.0),
        ];
        let last = format!("{:.2}", c.chi2_per_value);
        [c.fitted.label.clone()].into_iter().chain(numbers).chain([last]).collect::<Vec<_>>()
    };
    let outside = found.unknown.as_ref().map(|cause| Bar {
        label: OUTSIDE.into(),
        share: cause.probability,
        value: percent(cause.probability),
        emphasised: true,
        floor: None,
    });
    let none = || ["", "", ""].map(String::from);
    let outside_row =
        outside.iter().map(|bar| [bar.label.clone(), bar.value.clone()].into_iter().chain(none()).collect());
    let rows = outside_row.chain(shown().map(row)).collect();
    let bars_of_all: Vec<Bar> = outside.into_iter().chain(shown().map(bar)).collect();
    let columns = ["candidate", "probability", "evidence (2 ln of odds)", "error after", "χ² per value"];
    Section {
        heading: "Candidates".into(),
        paragraphs: vec![format!(
            "The model as it is: error {:.2} %, χ² per value {:.2}; with a probability of {} nothing is missing that these data would show.",
            found.error_before * 100.0,
            found.chi2_per_value,
            percent(found.nothing_missing)
        )],
        tables: vec![PageTable {
            caption: "Every effect at every place, the most probable first".into(),
            columns: columns.map(String::from).to_vec(),
            rows,
        }],
        figures: vec![Figure {
            id: "candidates".into(),
            title: "Probability of each candidate".into(),
            caption:
                "A long bar alone is a diagnosis; several alike are rivals that these data cannot tell apart."
                    .into(),
            drawing: bars(&bars_of_all).into(),
        }],
    }
}
