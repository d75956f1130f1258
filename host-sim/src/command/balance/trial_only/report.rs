//! What `balance --trial-only --report` says: the weights on a polar plot, and the vibration with and without them.

use super::answer::TrialBalanceResult;
use crate::answers::balance::AngleSense;
use crate::render::weights::{Weight, weights};
use crate::render::{Figure, PageTable, Section, identifier};

pub fn sections(answer: &TrialBalanceResult) -> Vec<Section> {
    let found = &answer.correction;
    let cells = |rows: Vec<Vec<String>>, columns: &[&str], caption: String| PageTable {
        caption,
        columns: columns.iter().map(|c| (*c).to_string()).collect(),
        rows,
    };
    let wanted = answer.weight_rows().into_iter().map(Vec::from).collect();
    let left = answer.left_rows().into_iter().map(Vec::from).collect();
    let title = "Weights around the shaft";
    let drawn: Vec<Weight> = found
        .weights
        .iter()
        .map(|w| Weight {
            plane: w.plane.clone(),
            wanted: w.wanted_g_mm,
            placed: w.filling.pieces.iter().map(|p| p.unbalance_g_mm).collect(),
        })
        .collect();
    let figure = Figure {
        id: identifier(title),
        drawing: weights(&drawn, answer.sense == AngleSense::AgainstRotation).into(),
        title: title.into(),
        caption: "Lines: the unbalance to add in each plane; circles: what is put in.".into(),
    };
    let mut paragraphs = answer.shop_lines();
    paragraphs.extend(answer.lines());
    paragraphs.extend(found.doubts.iter().cloned());
    let vibration = format!("Vibration, {} zero to peak", answer.unit());
    vec![Section {
        heading: "Weights".into(),
        paragraphs,
        tables: vec![
            cells(wanted, &TrialBalanceResult::WEIGHTS, answer.title()),
            cells(left, &TrialBalanceResult::LEFT, vibration),
        ],
        figures: vec![figure],
    }]
}
