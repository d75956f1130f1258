//! Text of an answer of `identify`.

use std::fmt::Write as _;

use rotor_edge_desktop::identify::Identifiability;

use super::findings;
use crate::answers::identify::Identification;

/// Bearings and planes as a table.
pub fn text(found: &Identification) -> String {
    let width = found.bearings.iter().map(|p| p.symbol.chars().count()).fold(11, usize::max);
    let mut text = format!("  bearing  {:<width$}  identified         start     ± %   from\n", "coefficient");
    for p in &found.bearings {
        let _ = writeln!(
            text,
            "  {:<8} {:<width$} {:>11.4e} {:>13.4e} {:>7.1}   {}",
            p.bearing,
            p.symbol,
            p.value,
            p.start,
            p.relative_sd * 100.0,
            origin(p.origin)
        );
    }
    findings::planes(&found.determined).iter().for_each(|line| text += &format!("  {line}\n"));
    if let Some(why) = found.determined.why {
        for p in &found.planes {
            let _ = writeln!(
                text,
                "  unbalance of {}: {:.0} g·mm at {:.0}°; no interval: {why}",
                p.name, p.unbalance_g_mm, p.angle_deg
            );
        }
    }
    let _ = writeln!(
        text,
        "  residual {:.2} µm, {:.2} % of the features",
        found.residual_um,
        found.residual_ratio * 100.0
    );
    if found.bearings.iter().any(|p| p.origin == Identifiability::StayedAtStart) {
        text += "  Some coefficients stayed at their start: these data do not determine them; add a run-up (--runup).\n";
    }
    text
}

fn origin(identified: Identifiability) -> &'static str {
    match identified {
        Identifiability::FromData => "the data",
        Identifiability::StayedAtStart => "its start, not determined by the data",
        Identifiability::AtBound => "the bound of [identify]",
    }
}
