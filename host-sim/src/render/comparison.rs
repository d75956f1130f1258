//! The report of `compare`: verdict, tables, and figures for every probe and bearing.

mod errors;
mod figures;
mod prediction;
mod tables;

pub use prediction::Prediction;

use rotor_edge_desktop::compare::{Adequacy, Comparison, SIGNIFICANCE};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::document::Section;
use crate::scale::{number, rpm, three_digits};
use figures::ReadingRun;

/// A model of the data, and what it leaves of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedModel {
    pub prediction: Prediction,
    /// How far that is from the measurement.
    pub comparison: Comparison,
}

impl ComparedModel {
    /// Standard deviation of a component of a probe's reading as this model leaves it, m; `None` where the reading was lost.
    fn sd_m(&self, readings: &[Reading], row: usize, probe: usize) -> Option<f64> {
        let off_m = (self.prediction.predicted_m[row][probe] - readings[row].probes[probe]?).norm();
        let sigmas = self.comparison.standardised[row][probe]?.norm();
        (sigmas > 0.0).then(|| off_m / sigmas)
    }
}

/// Relative error that noise alone leaves, as this model sees it: sqrt(Σ 2 sd² / Σ|Y|²).
pub fn noise_error(model: &ComparedModel, readings: &[Reading]) -> f64 {
    let (mut noise, mut signal) = (0.0, 0.0);
    for (row, reading) in readings.iter().enumerate() {
        for (probe, y) in reading.probes.iter().enumerate() {
            let (Some(y), Some(sd)) = (y, model.sd_m(readings, row, probe)) else { continue };
            noise += 2.0 * sd * sd;
            signal += y.norm_sqr();
        }
    }
    if signal > 0.0 { (noise / signal).sqrt() } else { 0.0 }
}

/// Where models fail, what they say of every probe, and the numbers: of one model, or of one before and after.
///
/// The first model is the one that is judged; the last is the better one.
pub fn comparison_sections(rotor: &Rotor, readings: &[Reading], models: &[ComparedModel]) -> Vec<Section> {
    let runs = ReadingRun::of(readings);
    let mut sections = vec![places(rotor, readings, models, &runs)];
    for run in &runs {
        sections.extend(run.sections(rotor, readings, models));
    }
    sections.extend(numbers(models));
    sections
}

/// Errors over speed beside the noise, and the maps of all models beside each other.
fn places(rotor: &Rotor, readings: &[Reading], models: &[ComparedModel], runs: &[ReadingRun]) -> Section {
    let of = |i: usize| match (models.len(), i) {
        (1, _) => "",
        (_, 0) => " before",
        _ => " after",
    };
    let figures = runs.iter().flat_map(|run| {
        let errors = errors::figures(run, rotor, readings, models);
        let map = |(i, m): (usize, &ComparedModel)| run.residual_map(of(i), rotor, readings, &m.comparison);
        errors.into_iter().chain(models.iter().enumerate().map(map)).collect::<Vec<_>>()
    });
    Section {
        heading: "Where it fails".into(),
        paragraphs: vec![
            "A model that misses physics leaves the band of the noise, and neighbouring speeds together: noise does not know its \
             neighbour."
                .into(),
        ],
        tables: Vec::new(),
        figures: figures.collect(),
    }
}

/// The verdict on the first model in its numbers, and every table.
fn numbers(models: &[ComparedModel]) -> Vec<Section> {
    let Some(first) = models.first() else { return Vec::new() };
    let mut tables = match models {
        [before, .., after] => vec![tables::change(&before.comparison, &after.comparison)],
        _ => vec![tables::summary(&first.comparison)],
    };
    tables.extend(tables::places(&first.comparison));
    let heading = if models.len() > 1 { "The model before, in numbers" } else { "The model in numbers" };
    vec![Section {
        heading: heading.into(),
        paragraphs: verdict(&first.comparison),
        tables,
        figures: Vec::new(),
    }]
}

pub fn verdict(c: &Comparison) -> Vec<String> {
    let mut said = vec![match c.verdict {
        Adequacy::Adequate => format!(
            "The model is adequate: noise explains its misfit of {} %. χ² per value is {} where noise \
             gives 1, and neighbouring speeds are correlated by {} where noise gives 0.",
            three_digits(100.0 * c.relative_error),
            number(c.chi2_per_value, 2),
            number(c.neighbours.correlation, 2),
        ),
        Adequacy::Misses => format!(
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
            "Furthest off is probe {} at {}{run}: {} µm 0-pk, {} standard deviations.",
            worst.probe,
            rpm(worst.speed_rpm),
            three_digits(worst.error_um),
            three_digits(worst.error_sigmas),
        ));
    }
    if c.verdict == Adequacy::Misses {
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
