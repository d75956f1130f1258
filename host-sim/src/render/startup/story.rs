//! The first screen of a page of `startup`, and its first sentence on a terminal.

use nalgebra::Complex;
use rotor_edge_desktop::units::rpm as to_rpm;

use super::tables::own_lines;
use super::{models, series};
use crate::answers::startup::{EvaluatedStartup, ImprovedStartup, StageAnswer, StartupAnswer};
use crate::render::bode::bode_of;
use crate::render::text::capital;
use crate::render::{Curve, Figure, Story};
use crate::scale::{number, three_digits};

type C = Complex<f64>;

/// What is missing in the simple model, and by how much its error falls, in one sentence.
pub fn verdict(answer: &StartupAnswer) -> String {
    let (Some(first), Some(last)) = (answer.stages.first(), answer.stages.last()) else {
        return "No model could be fitted.".into();
    };
    let percent = |stage: &StageAnswer| three_digits(stage.largest_error_percent_of_clearance);
    let Some(improved) = &answer.improved else {
        return format!(
            "The two-degree model is up to {} % of the clearance off; no rotor model could be fitted.",
            percent(first)
        );
    };
    let rest = match improved.model_adequate {
        true => "and the rest is noise",
        false => "and noise does not explain the rest",
    };
    let added: Vec<String> = improved.effects.iter().map(|e| e.fitted.words()).collect();
    match &added[..] {
        [] => format!(
            "The rotor model needs no further effect: it is up to {} % of the clearance off, the two-degree model {} %, {rest}.",
            percent(last),
            percent(first)
        ),
        _ => {
            let (were, them) = if added.len() > 1 { ("were", "them") } else { ("was", "it") };
            format!(
                "{} {were} missing: with {them} the model is up to {} % of the clearance off instead of {} %, {rest}.",
                capital(&added.join(" and ")),
                percent(last),
                percent(first)
            )
        }
    }
}

/// The first screen of the page; `evaluated` is the start-up that the answer is made from.
pub fn story(answer: &StartupAnswer, evaluated: &EvaluatedStartup, next: (String, Option<String>)) -> Story {
    let mut answers = vec![("Resonance", resonance(answer))];
    answers.extend(answer.improved.as_ref().map(|improved| ("What is wrong", wrong(improved))));
    answers.extend(
        own_lines(answer).into_iter().rfind(|line| line.starts_with("Own")).map(|own| ("Unbalance", own)),
    );
    let chi2 = |stage: &StageAnswer| stage.chi2_per_value.map(|chi2| number(chi2, 2));
    let ends = [answer.stages.first(), answer.stages.last().filter(|_| answer.stages.len() > 1)];
    let chi2: Vec<String> = ends.into_iter().flatten().filter_map(chi2).collect();
    let sure = format!("χ² per value {} (noise: 1).", chi2.join(" → "));
    answers.push(("How sure", sure));
    answers.extend((!answer.remarks.is_empty()).then(|| ("Remarks", answer.remarks.join(" "))));
    Story {
        verdict: verdict(answer),
        answers,
        next,
        beside: measured_and_models(evaluated).into_iter().collect(),
        below: Vec::new(),
    }
}

/// Natural speed and damping ratio in each direction.
fn resonance(answer: &StartupAnswer) -> String {
    let one = |(direction, natural): (&str, &Option<f64>)| {
        let natural = number((*natural)?, 0);
        let ratio = answer.damping_ratio.get(direction).copied().flatten();
        let ratio = ratio.map_or(String::new(), |ratio| format!(", damping ratio {ratio:.3}"));
        Some(format!("{direction}: {natural} rpm{ratio}."))
    };
    answer.natural_rpm.iter().filter_map(one).collect::<Vec<_>>().join(" ")
}

fn wrong(improved: &ImprovedStartup) -> String {
    match improved.effects.is_empty() {
        true => improved.summary.clone(),
        false => improved.effects.iter().map(|e| e.fitted.what).collect::<Vec<_>>().join(" "),
    }
}

/// The run and direction that move most, as measured and by the simple and the last model.
fn measured_and_models(evaluated: &EvaluatedStartup) -> Option<Figure> {
    let found = &evaluated.found;
    let size = |(run, d): &(usize, usize)| {
        let points = series(&evaluated.readings, &found.noise, &found.runs[*run], &found.directions[*d]);
        points.iter().map(|p| p.motion_m.norm()).fold(0.0, f64::max)
    };
    let all = (0..found.runs.len()).flat_map(|run| (0..found.directions.len()).map(move |d| (run, d)));
    let (run, d) = all.max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let (run, direction) = (&found.runs[run], &found.directions[d]);
    let measured: Vec<(f64, C)> = series(&evaluated.readings, &found.noise, run, direction)
        .iter()
        .map(|p| (to_rpm(p.speed_rad_s), p.motion_m))
        .collect();
    let curve = |(label, stage): (&str, usize)| {
        let point = |row: &usize| {
            Some((evaluated.readings[*row].speed_rpm, evaluated.stages[stage].motion[*row][d]?))
        };
        Curve { label: label.into(), points: run.rows.iter().filter_map(point).collect() }
    };
    let curves: Vec<Curve> = models(evaluated).into_iter().map(curve).collect();
    Some(Figure::new(
        format!("Measured and predicted {}, run {}", direction.label, run.label()),
        "The run and direction that move most.",
        bode_of("measured", &measured, &curves),
    ))
}
