//! Text, story and section of an answer of `identify`.

use std::fmt::Write as _;

use rotor_edge_desktop::identify::Identifiability;

use super::fitted::{self, FittedCurves};
use super::{Section, Story, findings, noise_error};
use crate::answers::identify::Identification;

/// Planes and bearings as a section of a page.
pub fn section(found: &Identification) -> Section {
    let adequate = found.determined.model_adequate;
    Section {
        heading: "Identified bearings and planes".into(),
        paragraphs: findings::planes(&found.determined)
            .into_iter()
            .chain(found.remarks.iter().cloned())
            .collect(),
        tables: findings::bearings_table(&found.bearings, adequate).into_iter().collect(),
        ..Section::default()
    }
}

/// The first screen of the page; the model that is drawn is the one identified.
pub fn story(found: &Identification, drawn: &FittedCurves, next: (String, Option<String>)) -> Story {
    let fitted = found.bearings.iter().filter(|p| p.identified).count();
    let verdict = format!(
        "The data fix {fitted} of {} bearing parameters; the model is {:.2} % off.",
        found.bearings.len(),
        100.0 * drawn.models[0].comparison.relative_error
    );
    let planes: Vec<String> = findings::planes(&found.determined)
        .iter()
        .map(|line| format!("{}.", line.trim_end_matches('.')))
        .collect();
    let fits = match found.determined.model_adequate {
        true => "noise explains the rest, so intervals hold",
        false => "noise does not explain the rest, so no interval is stated",
    };
    let mut answers = vec![
        ("Unbalance", planes.join(" ")),
        ("How sure", format!("χ² per value {:.2} (noise: 1): {fits}.", found.chi2_per_value)),
    ];
    let stayed: Vec<String> = (found.bearings.iter())
        .filter(|p| p.origin == Identifiability::StayedAtStart)
        .map(|p| format!("{} of {}", p.symbol, p.bearing))
        .collect();
    answers.extend((!stayed.is_empty()).then(|| {
        (
            "Not determined",
            format!("{}: these data do not fix them. A run-up can (--runup).", stayed.join(", ")),
        )
    }));
    let noise = noise_error(&drawn.models[0], drawn.readings);
    Story {
        verdict,
        answers,
        next,
        beside: vec![fitted::machine(drawn.rotor, &[], &[], None), fitted::steps(&drawn.models, noise)],
        below: Vec::new(),
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
    found.remarks.iter().for_each(|remark| text += &format!("  {remark}\n"));
    text += &findings::bearings_text(&found.bearings, found.determined.model_adequate);
    if found.bearings.iter().any(|p| p.origin == Identifiability::StayedAtStart) {
        text += "  Some parameters stayed at their start: these data do not determine them. A run-up can (--runup).\n";
    }
    text
}
