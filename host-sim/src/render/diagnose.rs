//! Text, story and sections of an answer of `diagnose`.

use std::fmt::Write as _;

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::significance::percent;

use super::bars::{Bar, bars};
use super::findings::{self, OUTSIDE};
use super::fitted::{self, FittedCurves, Unnamed};
use super::text::capital;
use super::{Figure, PageTable, Section, Story};
use crate::answers::diagnose::{AdviceAnswer, CandidateAnswer, DiagnosisAnswer, FittedAnswer};

/// Candidates that are drawn.
const DRAWN: usize = 10;

/// What is odd in bearings, runs and data, a sentence each.
pub fn remarks(found: &DiagnosisAnswer) -> impl Iterator<Item = String> {
    let refuted = found.refuted_runs.iter().map(|r| r.words.clone());
    findings::not_as_stated(&found.not_as_stated).chain(refuted).chain(found.remarks.iter().cloned())
}

/// The whole answer on a terminal, with the first `top` candidates.
pub fn text(found: &DiagnosisAnswer, top: usize) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {}", found.verdict, found.summary);
    for line in remarks(found) {
        let _ = writeln!(text, "  {line}");
    }
    let _ = writeln!(
        text,
        "\n  model as it is: error {:.2} %, χ² per value {:.2}",
        found.error_before * 100.0,
        found.chi2_per_value
    );
    let _ = writeln!(text, "  {}", findings::noise(&found.noise));
    findings::planes(&found.determined).iter().for_each(|line| text += &format!("  {line}\n"));
    if let Some(cause) = &found.unknown {
        let _ = writeln!(text, "\n  {}", findings::unknown(cause));
    }
    let _ = writeln!(
        text,
        "\n  candidate                           probability   evidence   error after   χ² per value"
    );
    if let Some(cause) = &found.unknown {
        let _ = writeln!(text, "  {:<36} {:>9.1} %", OUTSIDE, cause.probability * 100.0);
    }
    for c in found.candidates.iter().take(top) {
        let _ = writeln!(
            text,
            "  {:<36} {:>9.1} % {:>10.1} {:>11.2} % {:>14.2}{}",
            c.fitted.label,
            c.probability * 100.0,
            c.twice_log_bayes_factor,
            c.error_after * 100.0,
            c.chi2_per_value,
            if c.disqualified.is_some() { "   ruled out" } else { "" }
        );
    }
    let _ = writeln!(
        text,
        "  (evidence: twice the logarithm of the odds over the model alone; above 10 is strong)"
    );
    if let Some(best) = &found.named {
        let _ = writeln!(text, "\n{}", best.fitted.label);
        for p in findings::parameters(&best.fitted) {
            let _ = writeln!(text, "  {p}");
        }
        let _ = writeln!(text, "\n  {}", best.explanation);
        if let Some(h) = found.held_out {
            let _ = writeln!(
                text,
                "\n  On speeds that were left out: χ² per value {:.2} without it, {:.2} with it.",
                h.before, h.after
            );
        }
    }
    for group in &found.indistinguishable {
        let _ = writeln!(text, "\nThese data cannot tell apart: {}", group.join(", "));
    }
    if !found.advice.is_empty() {
        let _ = writeln!(text, "\nMeasurements that would tell them apart, least effort first");
        for a in found.advice.iter().take(5) {
            let repeats =
                if a.repeats > 1 { format!(", so repeat it {} times", a.repeats) } else { String::new() };
            let _ = writeln!(
                text,
                "  {} (they differ by {:.1} standard deviations, most at {:.0} rpm{repeats})",
                a.measurement, a.separation_sd, a.speed_rpm
            );
        }
    }
    text + &findings::fitted_text(&found.bearings, &found.dimensions, found.determined.model_adequate)
}

/// The first screen of the page; the models are the one as it is, and that with the best candidate, if one is claimed.
pub fn story(found: &DiagnosisAnswer, drawn: &FittedCurves, next: (String, Option<String>)) -> Story {
    let named = found.named.as_ref();
    let how_sure = match (named, found.indistinguishable.first()) {
        (_, Some(group)) if found.verdict == "undecided" => {
            format!("The data cannot tell these apart: {}.", group.join(", "))
        }
        (Some(best), _) => format!(
            "{} probable; {} chance that the model is complete.",
            capital(&percent(best.probability)),
            percent(found.nothing_missing)
        ),
        _ => fitted::how_complete(found.nothing_missing),
    };
    let unplaced = |wrong: &str| Unnamed::of(wrong, "The position cannot be determined.");
    let unnamed = match (&found.unknown, found.verdict) {
        (Some(cause), _) => Unnamed::cause(cause),
        (None, "adequate" | "not_determined") => Unnamed::complete(),
        (None, "unknown") => unplaced("No single known effect explains the misfit."),
        _ => unplaced("The data cannot tell whether an effect is missing, or which."),
    };
    let main: Vec<&FittedAnswer> = named.map(|best| &best.fitted).into_iter().collect();
    fitted::story(&found.summary, (&main, &unnamed), &found.candidates, drawn, how_sure, next)
}

/// The page below the story; `rotor` is the machine as its file has it.
pub fn sections(answer: &DiagnosisAnswer, rotor: &Rotor, drawn: &FittedCurves) -> Vec<Section> {
    let unknown = answer.unknown.as_ref();
    let tables =
        findings::fitted_tables(&answer.bearings, &answer.dimensions, answer.determined.model_adequate);
    let findings = findings::section(&answer.noise, &answer.determined, tables, unknown);
    let mut sections = vec![verdict(answer), candidates(answer), findings];
    sections.extend(fitted::compared(rotor, drawn));
    sections
}

/// The verdict and what would tell rivals apart.
fn verdict(found: &DiagnosisAnswer) -> Section {
    let mut paragraphs = vec![found.summary.clone()];
    paragraphs.extend(remarks(found));
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
        caption: "Measurements that would tell them apart, least effort first".into(),
        columns: ["measurement", "rivals differ by, σ", "most at, rpm", "times"].map(String::from).to_vec(),
        rows: found.advice.iter().map(row).collect(),
    };
    let tables = if table.rows.is_empty() { Vec::new() } else { vec![table] };
    Section { heading: "Diagnosis".into(), paragraphs, tables, figures: Vec::new() }
}

/// Every candidate with its probability.
fn candidates(found: &DiagnosisAnswer) -> Section {
    let shown = || found.candidates.iter().take(DRAWN);
    let share = |p: f64| format!("{:.1} %", p * 100.0);
    let bar = |c: &CandidateAnswer| Bar {
        label: c.fitted.label.clone(),
        share: c.probability,
        value: share(c.probability),
        emphasised: c.probability >= 0.05,
        floor: None,
    };
    let row = |c: &CandidateAnswer| {
        let numbers = [
            share(c.probability),
            format!("{:.1}", c.twice_log_bayes_factor),
            format!("{:.2} %", c.error_after * 100.0),
        ];
        let last = format!("{:.2}", c.chi2_per_value);
        [c.fitted.label.clone()].into_iter().chain(numbers).chain([last]).collect::<Vec<_>>()
    };
    let outside = found.unknown.as_ref().map(|cause| Bar {
        label: OUTSIDE.into(),
        share: cause.probability,
        value: share(cause.probability),
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
            "The model as it is: error {:.2} %, χ² per value {:.2}; {} chance that it is complete.",
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
