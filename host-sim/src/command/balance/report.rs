//! What `balance --report` says: the weights, and the vibration with and without them.

use super::answer::BalanceResult;
use crate::render::trend::{Trend, trend};
use crate::render::{Figure, PageTable, Section, identifier};

pub fn sections(answer: &BalanceResult) -> Vec<Section> {
    let weights = PageTable {
        caption: format!(
            "Unbalance to add to the machine without trial weights; angles from the keyphasor mark, {}",
            answer.direction()
        ),
        columns: BalanceResult::COLUMNS.map(String::from).to_vec(),
        rows: answer.rows().into_iter().map(|r| r.to_vec()).collect(),
    };
    let line = |what: fn(&rotor_edge_desktop::balance::AtSpeed) -> f64, way: usize| {
        answer.ways[way].1.vibration.iter().map(|v| (v.speed_rpm, what(v) * 1e6)).collect::<Vec<_>>()
    };
    let mut curves = vec![("as found".to_string(), line(|v| v.before_m, 0))];
    for (way, (name, _)) in answer.ways.iter().enumerate() {
        curves.push((format!("with weights by the {name}"), line(|v| v.after_m, way)));
    }
    let title = "Vibration by speed";
    let drawn =
        Trend { along: "speed, rpm".into(), quantity: "µm zero to peak".into(), curves, ..Trend::default() };
    let figure = Figure {
        id: identifier(title),
        drawing: trend(&drawn).into(),
        title: title.into(),
        caption: "Root mean square over the probes; with weights as predicted.".into(),
    };
    let mut paragraphs = answer.effect_lines();
    paragraphs.push(answer.legend());
    paragraphs.extend(answer.remarks.iter().cloned());
    vec![Section { heading: "Weights".into(), paragraphs, tables: vec![weights], figures: vec![figure] }]
}
