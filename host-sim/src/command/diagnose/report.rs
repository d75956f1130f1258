//! What `diagnose --report` says: the candidates, the best one explained, before and after.

use rotor_edge_desktop::compare::Comparison;
use rotor_edge_desktop::diagnose::{Candidate, Diagnosis, RefutedRun, add, best_fit};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use crate::command::entitled::{self, OUTSIDE};
use crate::report::bars::{Bar, bars};
use crate::report::{self, Figure, Prediction, Section, Table, comparison_sections};

/// Candidates that are drawn.
const DRAWN: usize = 10;

/// All sections of a diagnosis' report.
///
/// # Errors
/// If the model, or the model with the best candidate, cannot be fitted again.
pub fn sections(
    rotor: &Rotor,
    readings: &[Reading],
    found: &Diagnosis,
) -> Result<Vec<Section>, rotor_edge_desktop::Error> {
    let best = found.named().filter(|c| c.disqualified.is_none() && c.support > 0.0);
    let better =
        best.map(|best| Ok((best.label(), add(rotor, readings, best.effect, best.at.as_deref())?.rotor)));
    let entitled = entitled::section(&found.scatter, &found.determined, found.unknown.as_ref());
    let mut sections = vec![verdict(found), entitled, candidates(found)];
    sections.extend(before_and_after(rotor, readings, better.transpose()?.as_ref())?);
    Ok(sections)
}

/// The comparison of a model with the data, and of a better one, by label, beside it.
///
/// # Errors
/// If one of them cannot be fitted.
pub fn before_and_after(
    rotor: &Rotor,
    readings: &[Reading],
    better: Option<&(String, Rotor)>,
) -> Result<Vec<Section>, rotor_edge_desktop::Error> {
    let before = best_fit(rotor, readings)?;
    let comparison =
        Comparison::new(rotor, readings, &before.predicted_m, &before.noise, before.free_parameters);
    let mut models = vec![Prediction { label: "model".into(), predicted_m: before.predicted_m }];
    let mut sections = Vec::new();
    if let Some((label, better)) = better {
        let after = best_fit(better, readings)?;
        let then = Comparison::new(better, readings, &after.predicted_m, &after.noise, after.free_parameters);
        sections.push(report::before_and_after(rotor, readings, label, [&comparison, &then]));
        models.push(Prediction { label: format!("with {label}"), predicted_m: after.predicted_m });
    }
    sections.extend(comparison_sections(rotor, readings, &models, &comparison));
    Ok(sections)
}

fn verdict(found: &Diagnosis) -> Section {
    let mut paragraphs = vec![found.summary.clone()];
    paragraphs.extend(found.refuted.iter().map(RefutedRun::words).chain(found.remarks.iter().cloned()));
    if let Some(best) = found.named() {
        paragraphs.push(format!("{}: {}", best.label(), best.explanation()));
    }
    for group in &found.indistinguishable {
        paragraphs.push(format!("These data cannot tell apart: {}.", group.join(", ")));
    }
    let row = |a: &rotor_edge_desktop::diagnose::Advice| {
        vec![
            a.measurement.clone(),
            format!("{:.1}", a.separation_sd),
            format!("{:.0}", a.speed_rpm),
            a.repeats.to_string(),
        ]
    };
    let table = Table {
        caption: "What would tell them apart, least effort first".into(),
        columns: ["measurement", "rivals differ by, σ", "most at, rpm", "times"].map(String::from).to_vec(),
        rows: found.advice.iter().map(row).collect(),
    };
    let tables = if table.rows.is_empty() { Vec::new() } else { vec![table] };
    Section { heading: "Diagnosis".into(), paragraphs, tables, figures: Vec::new() }
}

fn candidates(found: &Diagnosis) -> Section {
    let shown = || found.candidates.iter().take(DRAWN);
    let percent = |p: f64| format!("{:.1} %", p * 100.0);
    let bar = |c: &Candidate| Bar {
        label: c.label(),
        share: c.probability,
        value: percent(c.probability),
        emphasised: c.probability >= 0.05,
    };
    let row = |c: &Candidate| {
        let numbers =
            [percent(c.probability), format!("{:.1}", c.support), format!("{:.2} %", c.error_after * 100.0)];
        let last = format!("{:.2}", c.chi2_per_value);
        [c.label()].into_iter().chain(numbers).chain([last]).collect::<Vec<_>>()
    };
    let outside = found.unknown.as_ref().map(|cause| Bar {
        label: OUTSIDE.into(),
        share: cause.probability,
        value: percent(cause.probability),
        emphasised: true,
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
        tables: vec![Table {
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
            svg: bars("Probability of each candidate", &bars_of_all),
        }],
    }
}
