//! The report of `compare`: verdict, tables, and figures for every probe and bearing.

mod figures;
mod prediction;
mod tables;

pub use prediction::Prediction;

use rotor_edge_desktop::compare::{Comparison, SIGNIFICANCE, Verdict};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::document::Section;
use super::scale::{number, rpm, three_digits};
use figures::Run;

/// Everything that `compare --report` shows.
///
/// `models[0]` is the model that `comparison` judged; others are drawn beside it.
pub fn comparison_sections(
    rotor: &Rotor,
    readings: &[Reading],
    models: &[Prediction],
    comparison: &Comparison,
) -> Vec<Section> {
    let runs = Run::of(readings);
    let mut sections = vec![Section {
        heading: "Verdict".into(),
        paragraphs: verdict(comparison),
        tables: vec![tables::summary(comparison)],
        figures: vec![],
    }];
    sections.push(Section {
        heading: "Where it fails".into(),
        paragraphs: vec![
            "χ² per value is 1 where noise explains the misfit. Neighbouring speeds that are correlated by \
             more than about 3 σ are physics: noise does not know its neighbour."
                .into(),
        ],
        tables: tables::places(comparison),
        figures: runs.iter().map(|run| run.residual_map("", rotor, readings, comparison)).collect(),
    });
    for run in &runs {
        sections.extend(run.sections(rotor, readings, models, comparison));
    }
    sections
}

/// What became of the misfit: numbers and maps of two models beside each other.
pub fn before_and_after(
    rotor: &Rotor,
    readings: &[Reading],
    after: &str,
    [before, then]: [&Comparison; 2],
) -> Section {
    let runs = Run::of(readings);
    let maps = |run: &Run| {
        [(" before", before), (" after", then)].map(|(of, c)| run.residual_map(of, rotor, readings, c))
    };
    Section {
        heading: "Before and after".into(),
        paragraphs: vec![format!(
            "With {after} the model is {} % off where it was {} %, and χ² per value is {} where it was {} and noise gives 1.",
            three_digits(100.0 * then.relative_error),
            three_digits(100.0 * before.relative_error),
            three_digits(then.chi2_per_value),
            three_digits(before.chi2_per_value),
        )],
        tables: vec![tables::change(before, then)],
        figures: runs.iter().flat_map(maps).collect(),
    }
}

/// The verdict in sentences.
fn verdict(c: &Comparison) -> Vec<String> {
    let mut said = vec![match c.verdict {
        Verdict::Adequate => format!(
            "The model is adequate: noise explains its misfit of {} %. χ² per value is {} where noise \
             gives 1, and neighbouring speeds are correlated by {} where noise gives 0.",
            three_digits(100.0 * c.relative_error),
            number(c.chi2_per_value, 2),
            number(c.neighbours.correlation, 2),
        ),
        Verdict::Misses => format!(
            "The model misses physics: it is {} % off, and noise does not do that. {}.",
            three_digits(100.0 * c.relative_error),
            reasons(c).join(", and "),
        ),
    }];
    if c.reversed {
        said.push(
            "The phases are reversed: at every bearing the shaft is measured to whirl against its rotation \
             where the model goes with it. Check the sign of the sine components, the direction of rotation \
             and whether the X and Y probes are exchanged before anything else."
                .into(),
        );
    }
    if let Some(worst) = &c.worst {
        let run = worst.run.as_ref().map_or(String::new(), |r| format!(" of run {r}"));
        said.push(format!(
            "Furthest off is probe {} at {}{run}: {} µm, {} standard deviations.",
            worst.probe,
            rpm(worst.speed_rpm),
            three_digits(worst.error_um),
            three_digits(worst.error_sigmas),
        ));
    }
    if c.verdict == Verdict::Misses {
        let parts = c.whirl.iter().flat_map(|w| {
            [("forward", &w.forward), ("backward", &w.backward)].map(|(way, part)| (way, &w.bearing, part))
        });
        if let Some((way, bearing, part)) = parts.max_by(|a, b| a.2.error_sigmas.total_cmp(&b.2.error_sigmas))
        {
            said.push(format!(
                "It stands out most in the {way} whirl at bearing {bearing}: {} times what noise does.",
                number(part.error_sigmas, 1)
            ));
        }
    }
    said
}

fn reasons(c: &Comparison) -> Vec<String> {
    let mut reasons = Vec::new();
    if c.chi2_p_value < SIGNIFICANCE {
        reasons.push(format!(
            "χ² per value is {} where noise gives 1 (chance {})",
            three_digits(c.chi2_per_value),
            chance(c.chi2_p_value)
        ));
    }
    if c.neighbours.p_value < SIGNIFICANCE {
        reasons.push(format!(
            "the residual of neighbouring speeds is correlated by {} where noise gives 0 (chance {})",
            number(c.neighbours.correlation, 2),
            chance(c.neighbours.p_value)
        ));
    }
    if let Some(first) = reasons.first_mut()
        && let Some(letter) = first.strip_prefix('t')
    {
        *first = format!("T{letter}");
    }
    reasons
}

/// A probability, without pretending to know a tiny one.
fn chance(p: f64) -> String {
    if p < 1e-6 { "under one in a million".into() } else { format!("{} %", three_digits(100.0 * p)) }
}
