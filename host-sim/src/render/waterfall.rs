//! How the probabilities of the candidates change as effects are added: a row for each candidate, a column for each model.

use maud::{Markup, html};
use rotor_edge_desktop::diagnose::{Candidate, Diagnosis, ImprovementOutcome};

use super::Figure;

/// Candidates that are shown of each model.
const SHOWN_OF_EACH: usize = 3;
/// Less than this is not worth a row.
const LEAST: f64 = 0.01;

const COMPLETE: &str = "no missing effect";
const OTHERS: &str = "other effects";

/// What a diagnosis of one model says.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// The effect that this model has more than the one before; none of the first.
    pub added: Option<String>,
    /// Probability that no effect is missing.
    pub complete: f64,
    /// Label and probability of each candidate, most probable first.
    pub candidates: Vec<(String, f64)>,
}

impl Stage {
    fn of(added: Option<String>, complete: f64, candidates: &[Candidate]) -> Self {
        let candidates = candidates.iter().map(|c| (c.label(), c.probability)).collect();
        Self { added, complete, candidates }
    }

    /// The model of one step, by a diagnosis of it.
    pub fn between(added: String, diagnosis: &Diagnosis) -> Self {
        Self::of(Some(added), diagnosis.nothing_missing, &diagnosis.candidates)
    }

    /// The models before all steps and after them.
    pub fn ends(outcome: &ImprovementOutcome) -> [Self; 2] {
        let [before, after] = outcome.nothing_missing;
        let added = outcome.steps.last().map(|step| step.added.label());
        [Self::of(None, before, &outcome.candidates_before), Self::of(added, after, &outcome.candidates)]
    }

    fn probability(&self, label: &str) -> f64 {
        self.candidates.iter().find(|(of, _)| of == label).map_or(0.0, |(_, p)| *p)
    }
}

/// What stands in a cell.
#[derive(Debug, Clone, PartialEq)]
enum Cell {
    Probability(f64),
    /// The effect is added to this model.
    Added,
    /// The effect was added to an earlier model.
    Kept,
}

/// Rows with a cell for each stage.
fn rows(stages: &[Stage]) -> Vec<(String, Vec<Cell>)> {
    let mut labels: Vec<&str> = Vec::new();
    for stage in stages {
        let likely = stage.candidates.iter().take(SHOWN_OF_EACH).filter(|(_, p)| *p >= LEAST);
        for label in stage.added.iter().chain(likely.map(|(label, _)| label)) {
            if !labels.contains(&label.as_str()) {
                labels.push(label);
            }
        }
    }
    let cell = |(k, stage): (usize, &Stage), label: &str| match stages[..=k]
        .iter()
        .position(|s| s.added.as_deref() == Some(label))
    {
        Some(at) if at == k => Cell::Added,
        Some(_) => Cell::Kept,
        None => Cell::Probability(stage.probability(label)),
    };
    let row = |label: &&str| {
        let cells = stages.iter().enumerate().map(|stage| cell(stage, label)).collect();
        ((*label).to_string(), cells)
    };
    let complete = stages.iter().map(|s| Cell::Probability(s.complete)).collect();
    let rest = |stage: &Stage| {
        let shown: f64 = labels.iter().map(|label| stage.probability(label)).sum();
        Cell::Probability((1.0 - stage.complete - shown).max(0.0))
    };
    labels
        .iter()
        .map(row)
        .chain([(OTHERS.to_string(), stages.iter().map(rest).collect()), (COMPLETE.to_string(), complete)])
        .collect()
}

fn percent(probability: f64) -> String {
    match probability {
        p if p < 0.001 => "< 0.1 %".into(),
        p if p > 0.999 => "> 99.9 %".into(),
        p => format!("{:.1} %", 100.0 * p),
    }
}

/// The figure; nothing where no effect was added.
pub fn waterfall(stages: &[Stage]) -> Option<Figure> {
    if stages.len() < 2 {
        return None;
    }
    Some(Figure::new(
        "Probabilities as effects are added",
        "Probability that one effect is missing, and that none is, by a diagnosis of each model. Columns: the number of added effects.",
        drawn(stages),
    ))
}

fn drawn(stages: &[Stage]) -> Markup {
    html! {
        div class="waterfall" role="table" style=(format!("--stages:{}", stages.len())) {
            div role="row" {
                span role="columnheader" { "missing effect" }
                @for effects in 0..stages.len() {
                    b role="columnheader" { (effects) @if effects == 1 { " effect" } @else { " effects" } }
                }
            }
            @for (label, cells) in rows(stages) {
                div role="row" class=[(label == COMPLETE).then_some("complete")] {
                    span role="rowheader" { (label) }
                    @for cell in cells {
                        span role="cell" { @match cell {
                            Cell::Added => b { "added" },
                            Cell::Kept => i { "✓" },
                            Cell::Probability(p) => {
                                (percent(p))
                                div { div style=(format!("width:{:.2}%", 100.0 * p.clamp(0.0, 1.0))) {} }
                            },
                        } }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(added: Option<&str>, complete: f64, candidates: &[(&str, f64)]) -> Stage {
        let candidates = candidates.iter().map(|(label, p)| ((*label).to_string(), *p)).collect();
        Stage { added: added.map(String::from), complete, candidates }
    }

    #[test]
    fn waterfall_columns_sum_to_one_and_name_added_effects() {
        let stages = [
            stage(
                None,
                0.0,
                &[("seal@disk 3", 0.7), ("rub@disk 3", 0.2), ("shaft_bow", 0.06), ("runout", 0.04)],
            ),
            stage(Some("seal@disk 3"), 0.1, &[("shaft_bow", 0.8), ("runout", 0.1)]),
            stage(Some("shaft_bow"), 0.95, &[("runout", 0.02)]),
        ];
        let rows = rows(&stages);
        let labels: Vec<&str> = rows.iter().map(|(label, _)| &label[..]).collect();
        assert_eq!(labels, ["seal@disk 3", "rub@disk 3", "shaft_bow", "runout", OTHERS, COMPLETE]);
        for k in 0..stages.len() {
            let value = |cell: &Cell| if let Cell::Probability(p) = cell { *p } else { 0.0 };
            let sum: f64 = rows.iter().map(|(_, cells)| value(&cells[k])).sum();
            assert!((sum - 1.0).abs() < 1e-12, "column {k}: {sum}");
        }
        assert_eq!(rows[0].1[1..], [Cell::Added, Cell::Kept]);
        assert_eq!(rows[2].1, [Cell::Probability(0.06), Cell::Probability(0.8), Cell::Added]);
    }

    #[test]
    fn waterfall_without_added_effects_is_left_out() {
        assert_eq!(waterfall(&[stage(None, 0.9, &[("seal@disk 3", 0.1)])]).map(|_| ()), None);
    }
}
