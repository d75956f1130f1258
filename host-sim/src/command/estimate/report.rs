//! What `estimate --report` says.

use rotor_edge_desktop::estimate::Estimates;

use super::rows::{COLUMNS, rows};
use crate::report::{Section, Table};

/// All sections.
pub fn sections(found: &Estimates, planes: &[&str]) -> Vec<Section> {
    let table = Table {
        caption: super::legend(found),
        columns: COLUMNS.map(String::from).to_vec(),
        rows: rows(found, planes).into_iter().map(|r| r.to_vec()).collect(),
    };
    let mut paragraphs = vec![super::conditions(found)];
    paragraphs.extend(found.determined.words.iter().cloned());
    paragraphs.extend(super::refuted(found, planes));
    paragraphs.extend(found.remarks.iter().cloned());
    vec![Section { heading: "Unbalance by run".into(), paragraphs, tables: vec![table], figures: vec![] }]
}
