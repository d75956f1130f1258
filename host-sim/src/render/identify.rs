//! Text of an answer of `identify`.

use std::fmt::Write as _;

use rotor_edge_desktop::identify::Identifiability;

use super::{Section, findings};
use crate::answers::identify::Identification;

/// Planes and bearings as a section of a page.
pub fn section(found: &Identification) -> Section {
    let adequate = found.determined.model_adequate;
    Section {
        heading: "Identified bearings and planes".into(),
        paragraphs: findings::planes(&found.determined),
        tables: findings::bearings_table(&found.bearings, adequate).into_iter().collect(),
        ..Section::default()
    }
}

/// Planes, and bearings as a table.
pub fn text(found: &Identification) -> String {
    let mut text: String =
        findings::planes(&found.determined).iter().map(|line| format!("  {line}\n")).collect();
    if let Some(why) = found.determined.why.filter(|_| found.determined.planes.is_none()) {
        for p in &found.planes {
            let _ = writeln!(
                text,
                "  Unbalance of {}: {:.0} g·mm at {:.0}°; no interval: {why}",
                p.name, p.unbalance_g_mm, p.angle_deg
            );
        }
    }
    let _ = writeln!(
        text,
        "  Residual {:.2} µm 0-pk, {:.2} % of the features; χ² per value {:.2} (noise: 1)",
        found.residual_um,
        found.residual_ratio * 100.0,
        found.chi2_per_value
    );
    text += &findings::bearings_text(&found.bearings, found.determined.model_adequate);
    if found.bearings.iter().any(|p| p.origin == Identifiability::StayedAtStart) {
        text += "  Some parameters stayed at their start: these data do not determine them. A run-up can (--runup).\n";
    }
    text
}
