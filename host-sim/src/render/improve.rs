//! Text, story and sections of an answer of `improve`.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::significance::percent;

use super::findings;
use super::fitted::{self, FittedCurves, Unnamed};
use super::text::capital;
use super::waterfall::{Stage, waterfall};
use super::{ComparedModel, PageTable, Section, Story};
use crate::answers::diagnose::{Addition, FittedAnswer, ImprovementAnswer, StepAnswer};
use crate::scale::three_digits;

/// What is odd in bearings, runs and data, a sentence each.
fn remarks(answer: &ImprovementAnswer) -> impl Iterator<Item = String> {
    let refuted = answer.refuted_runs.iter().map(|r| r.words.clone());
    findings::not_as_stated(&answer.not_as_stated).chain(refuted).chain(answer.remarks.iter().cloned())
}

/// The verdict, the parameters and what the data determine; the steps are told before, each by [`step_text`].
pub fn text(answer: &ImprovementAnswer) -> String {
    let mut lines: Vec<String> = remarks(answer).collect();
    lines.push(findings::noise(&answer.noise));
    lines.extend(findings::planes(&answer.determined));
    let lines: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    let unknown = answer.unknown.as_ref();
    let unknown = unknown.map_or_else(String::new, |cause| format!("\n  {}\n", findings::unknown(cause)));
    let effect = |step: &StepAnswer| {
        let parameters = findings::parameters(&step.fitted);
        let parameters: String = parameters.iter().map(|line| format!("    {line}\n")).collect();
        format!("  {}\n{parameters}", step.fitted.label)
    };
    let effects: String = answer.steps.iter().map(effect).collect();
    let effects = match answer.steps.is_empty() {
        true => effects,
        false => format!("\nEffects as fitted (± is a 95 % half-width)\n{effects}"),
    };
    let fitted =
        findings::fitted_text(&answer.bearings, &answer.dimensions, answer.determined.model_adequate);
    format!("{}: {}\n{lines}{unknown}{effects}{fitted}", answer.verdict, answer.summary)
}

/// The effect that `add` added, with the bearings, as a section of a page.
pub fn addition(answer: &Addition) -> Section {
    let mut paragraphs = vec![format!("{} added.", capital(&answer.fitted.words()))];
    paragraphs.extend(findings::parameters(&answer.fitted));
    Section {
        heading: "What was added".into(),
        paragraphs,
        tables: findings::fitted_tables(&answer.bearings, &answer.dimensions, answer.model_adequate),
        ..Section::default()
    }
}

/// The first screen of `add`; the models are those before and after.
pub fn story_of_addition(answer: &Addition, drawn: &FittedCurves, next: (String, Option<String>)) -> Story {
    let error = |model: Option<&ComparedModel>| {
        three_digits(100.0 * model.map_or(f64::NAN, |model| model.comparison.relative_error))
    };
    let left = match answer.model_adequate {
        true => "and noise can explain the rest",
        false => "and noise does not explain the rest",
    };
    let sentence = format!(
        "With {} the model is {} % off instead of {} %, {left}.",
        answer.fitted.words(),
        error(drawn.models.last()),
        error(drawn.models.first()),
    );
    let how_sure = "The effect was chosen by hand; `diagnose` compares it with all others at all places.";
    let named = (&[&answer.fitted][..], &Unnamed::default());
    let mut story = fitted::story(&sentence, named, &[], drawn, how_sure.into(), next);
    let fitted = findings::parameters(&answer.fitted);
    story.answers.extend((!fitted.is_empty()).then(|| ("As fitted", format!("{}.", fitted.join(", ")))));
    story
}

/// A step in words, a line each.
pub fn step_text(step: &StepAnswer) -> String {
    let mut text = format!(
        "+ {:<36} error {:.2} %, χ² per value {:.2}\n",
        step.fitted.label,
        step.error_after * 100.0,
        step.chi2_per_value
    );
    if !step.group.is_empty() {
        text += &format!("    the data cannot tell apart: {}\n", step.group.join(", "));
    }
    text
}

/// The first screen of the page; the first of the models is that before, then comes one for each step.
pub fn story(answer: &ImprovementAnswer, drawn: &FittedCurves, next: (String, Option<String>)) -> Story {
    let main: Vec<&FittedAnswer> = answer.steps.iter().map(|s| &s.fitted).collect();
    let added: Vec<String> = main.iter().map(|c| c.words()).collect();
    let group = answer.steps.last().map(|s| &s.group[..]).filter(|group| group.len() > 1);
    let alone = |c: &FittedAnswer| answer.candidates_before.iter().find(|b| b.fitted.label == c.label);
    let how_sure = match (&main[..], group) {
        ([], _) => match &answer.unknown {
            Some(cause) => format!(
                "{} probable that an unknown effect is missing.",
                capital(&percent(cause.probability))
            ),
            None => "–".into(),
        },
        (_, Some(group)) => format!("The data cannot tell these apart: {}.", group.join(", ")),
        ([only], None) => {
            let probability = alone(only).map_or(f64::NAN, |c| c.probability);
            format!("{} probable among all effects at all places.", capital(&percent(probability)))
        }
        _ => "No other set of effects explains the data as well.".into(),
    };
    let sentence = if added.is_empty() {
        answer.summary.clone()
    } else {
        let (were, it) = if added.len() > 1 { ("were", "them") } else { ("was", "it") };
        let after = drawn.models.last().map_or(f64::NAN, |model| model.comparison.relative_error);
        let left = match answer.verdict {
            "adequate" | "not_determined" => "and the rest is noise",
            _ => "and noise does not explain the rest",
        };
        format!(
            "{} {were} missing: with {it} the model is {} % off instead of {} %, {left}.",
            capital(&added.join(" and ")),
            three_digits(100.0 * after),
            three_digits(100.0 * drawn.models[0].comparison.relative_error),
        )
    };
    let unnamed = match (&answer.unknown, answer.verdict) {
        (Some(cause), _) => Unnamed::cause(cause),
        (None, "adequate" | "not_determined") => Unnamed::complete(),
        _ => Unnamed::of(
            "The data cannot tell whether an effect is missing, or which.",
            "The position cannot be determined.",
        ),
    };
    let named = (&main[..], &unnamed);
    let mut story = fitted::story(&sentence, named, &answer.candidates_before, drawn, how_sure, next);
    if !added.is_empty() {
        story.answers.push(("Rest", answer.summary.clone()));
    }
    story
}

/// The page below the story; `rotor` is the machine as its file has it.
pub fn sections(
    answer: &ImprovementAnswer,
    stages: &[Stage],
    rotor: &Rotor,
    drawn: &FittedCurves,
) -> Vec<Section> {
    let mut sections = vec![Section { figures: waterfall(stages).into_iter().collect(), ..found(answer) }];
    sections.extend(fitted::compared(rotor, drawn));
    sections.push(findings::section(
        &answer.noise,
        &answer.determined,
        findings::fitted_tables(&answer.bearings, &answer.dimensions, answer.determined.model_adequate),
        answer.unknown.as_ref(),
    ));
    sections
}

/// The verdict, and what was added.
fn found(answer: &ImprovementAnswer) -> Section {
    let seen = answer.steps.iter().map(|s| format!("{}: {}", s.fitted.label, s.explanation));
    let row = |s: &StepAnswer| {
        let line = |line: String| vec![s.fitted.label.clone(), line];
        findings::parameters(&s.fitted).into_iter().map(line).collect::<Vec<_>>()
    };
    let added = PageTable {
        caption: "What was added, each with its parameters (± is a 95 % half-width)".into(),
        columns: ["effect", "parameter"].map(String::from).to_vec(),
        rows: answer.steps.iter().flat_map(row).collect(),
    };
    Section {
        heading: "What was found".into(),
        paragraphs: [format!("{}: {}", answer.verdict, answer.summary)]
            .into_iter()
            .chain(remarks(answer))
            .chain(seen)
            .collect(),
        tables: if added.rows.is_empty() { Vec::new() } else { vec![added] },
        figures: Vec::new(),
    }
}
