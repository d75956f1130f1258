//! What a tired engineer asks first, answered: what is wrong, where, how sure, how much better, and what now.

use rotor_edge_desktop::diagnose::{Candidate, Diagnosis, DiagnosisVerdict, ImprovementOutcome};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::fitted::Fitted;
use super::machine;
use crate::render::bars::{Bar, bars};
use crate::render::{Figure, Story, noise_error, verdict};
use crate::scale::{number, three_digits};

pub fn of_diagnosis(
    found: &Diagnosis,
    readings: &[Reading],
    fits: &[Fitted],
    next: (String, Option<String>),
) -> Story {
    let main: Vec<&Candidate> = found.named().into_iter().collect();
    let how_sure = match (&main[..], found.indistinguishable.first()) {
        (_, Some(group)) if found.verdict == DiagnosisVerdict::Undecided => {
            format!("Not: these data cannot tell apart {}.", group.join(", "))
        }
        ([best], _) => format!(
            "{}; nothing missing at all: {}.",
            percent(best.probability),
            percent(found.nothing_missing)
        ),
        _ => {
            format!("{} that nothing is missing which these data would show.", percent(found.nothing_missing))
        }
    };
    story(&found.summary, &main, &found.candidates, readings, fits, how_sure, next)
}

/// Of `improve`; the first of the fits is the model before, then one for each step.
pub fn of_improvement(
    outcome: &ImprovementOutcome,
    readings: &[Reading],
    fits: &[Fitted],
    next: (String, Option<String>),
) -> Story {
    let main: Vec<&Candidate> = outcome.steps.iter().map(|s| &s.added).collect();
    let added: Vec<String> = main.iter().map(|c| machine::words(c)).collect();
    let group = outcome.steps.last().map(|s| &s.group[..]).filter(|group| group.len() > 1);
    let alone = |c: &Candidate| outcome.candidates_before.iter().find(|b| b.label() == c.label());
    let how_sure = match (&main[..], group) {
        ([], _) => outcome.summary.clone(),
        (_, Some(group)) => format!("Not which of these: {}. All explain the data alike.", group.join(", ")),
        ([only], None) => {
            let probability = alone(only).map_or(f64::NAN, |c| c.probability);
            format!("{} among all effects at all places.", percent(probability))
        }
        _ => "No other set of effects explains the data as well.".into(),
    };
    let sentence = if added.is_empty() {
        outcome.summary.clone()
    } else {
        let (were, it) = if added.len() > 1 { ("were", "them") } else { ("was", "it") };
        let after = fits.last().map_or(f64::NAN, |fit| fit.model.comparison.relative_error);
        let left = match outcome.verdict {
            DiagnosisVerdict::Adequate => "and what is left is noise",
            _ => "and something is left",
        };
        format!(
            "{} {were} missing: with {it} the model is {} % off instead of {} %, {left}.",
            capital(&added.join(" and ")),
            three_digits(100.0 * after),
            three_digits(100.0 * fits[0].model.comparison.relative_error),
        )
    };
    let mut story = story(&sentence, &main, &outcome.candidates_before, readings, fits, how_sure, next);
    if !added.is_empty() {
        story.answers.push(("What is left", outcome.summary.clone()));
    }
    story
}

/// Of one model and nothing else.
pub fn of_model(readings: &[Reading], fit: &Fitted, sure: f64, next: (String, Option<String>)) -> Story {
    let said = verdict(&fit.model.comparison);
    let how_sure = format!("{} that nothing is missing which these data would show.", percent(sure));
    let mut story = story(&said[0], &[], &[], readings, std::slice::from_ref(fit), how_sure, next);
    story.answers[1].1 = said[1..].join(" ");
    story
}

fn story(
    sentence: &str,
    main: &[&Candidate],
    candidates: &[Candidate],
    readings: &[Reading],
    fits: &[Fitted],
    how_sure: String,
    next: (String, Option<String>),
) -> Story {
    let rotor = &fits[0].best.rotor;
    let wrong = match main {
        [] => "Nothing that these data would single out.".into(),
        _ => main.iter().map(|c| c.knowledge.what).collect::<Vec<_>>().join(" "),
    };
    let inspect: Vec<&str> = main.iter().map(|c| c.knowledge.inspect).collect();
    let inspect = (!inspect.is_empty()).then(|| ("Inspect", inspect.join(" ")));
    let noise = noise_error(&fits[fits.len() - 1].model, readings);
    let worst = fits[0].model.comparison.worst.as_ref().map(|w| w.speed_rpm);
    let shafts: Vec<_> = ends(fits).map(|f| (f.model.prediction.label.clone(), &f.best)).collect();
    let deflection = worst.and_then(|speed_rpm| machine::deflection(&shafts, speed_rpm));
    Story {
        verdict: sentence.into(),
        answers: [
            ("What is wrong", wrong),
            ("Where", places(rotor, main)),
            ("How sure", how_sure),
            ("How much better", how_much(fits, noise)),
        ]
        .into_iter()
        .chain(inspect)
        .collect(),
        next: (capital(&next.0), next.1),
        beside: vec![machine::figure(rotor, candidates, main), steps(fits, noise)],
        below: deflection.into_iter().collect(),
    }
}

/// The first and the last of the fits, once if they are one.
fn ends(fits: &[Fitted]) -> impl Iterator<Item = &Fitted> {
    fits.first().into_iter().chain(fits.last().filter(|_| fits.len() > 1))
}

fn places(rotor: &Rotor, main: &[&Candidate]) -> String {
    let place = |c: &&Candidate| match &c.at {
        Some(at) => match machine::position_m(rotor, at) {
            Some(z) => format!("{at}, {z:.3} m from the left end"),
            None => at.clone(),
        },
        None => "the machine as a whole".into(),
    };
    if main.is_empty() { "–".into() } else { main.iter().map(place).collect::<Vec<_>>().join("; ") }
}

fn how_much(fits: &[Fitted], noise: f64) -> String {
    let each = |of: &dyn Fn(&Fitted) -> String| ends(fits).map(of).collect::<Vec<_>>().join(" → ");
    format!(
        "Error {} (noise alone: {} %), χ² per value {} (noise: 1).",
        each(&|f| format!("{} %", three_digits(100.0 * f.model.comparison.relative_error))),
        three_digits(100.0 * noise),
        each(&|f| number(f.model.comparison.chi2_per_value, 2)),
    )
}

/// How the error falls from model to model.
fn steps(fits: &[Fitted], noise: f64) -> Figure {
    let error = |f: &Fitted| f.model.comparison.relative_error;
    let largest = fits.iter().map(error).fold(noise, f64::max).max(f64::MIN_POSITIVE);
    let bar = |(i, f): (usize, &Fitted)| Bar {
        label: f.model.prediction.label.clone(),
        share: error(f) / largest,
        value: format!("{} %", three_digits(100.0 * error(f))),
        emphasised: i + 1 == fits.len(),
        floor: Some(noise / largest),
    };
    Figure::new(
        "The fall of the error",
        format!(
            "Error of all probes and speeds, of each model's most probable fit. Hatched: {} %, what noise alone leaves.",
            three_digits(100.0 * noise)
        ),
        bars(&fits.iter().enumerate().map(bar).collect::<Vec<_>>()),
    )
}

fn percent(share: f64) -> String {
    match share {
        p if p > 0.999 => "over 99.9 %".into(),
        p if p < 0.001 => "under 0.1 %".into(),
        p => format!("{} %", three_digits(100.0 * p)),
    }
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
