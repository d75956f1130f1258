//! What `estimate --report` says.

use rotor_edge_desktop::balance::estimate::{RunEstimate, RunEstimates};

use super::rows::{COLUMNS, rows};
use crate::report::regions::{Region, regions};
use crate::report::{Figure, Section, Table};

pub fn sections(found: &RunEstimates, planes: &[&str]) -> Vec<Section> {
    let table = Table {
        caption: super::legend(found),
        columns: COLUMNS.map(String::from).to_vec(),
        rows: rows(found, planes).into_iter().map(|r| r.to_vec()).collect(),
    };
    let mut paragraphs = vec![super::conditions(found)];
    paragraphs.extend(found.determined.words.iter().cloned());
    paragraphs.extend(super::refuted(found, planes));
    paragraphs.extend(found.remarks.iter().cloned());
    let figures = (0..planes.len()).map(|j| figure(found, j, planes[j])).collect();
    vec![Section { heading: "Unbalance by run".into(), paragraphs, tables: vec![table], figures }]
}

fn figure(found: &RunEstimates, j: usize, plane: &str) -> Figure {
    let region = |e: &RunEstimate| Region {
        found: e.planes[j].unbalance_g_mm,
        stated: e.stated_g_mm.as_ref().map(|stated| stated[j]),
        semi_axes: e.planes[j].semi_axes_g_mm,
        major_deg: e.planes[j].major_deg,
    };
    let title = format!("Unbalance in plane {plane}");
    Figure {
        id: format!("regions-{}", j + 1),
        caption:
            "Each run as estimated, in the ellipse that holds it with 95 %, and a line to what was stated."
                .into(),
        drawing: regions(&found.runs.iter().map(region).collect::<Vec<_>>()).into(),
        title,
    }
}
