//! What a tired engineer asks first of fitted models, answered: what is wrong, where, how sure, how much better, and what now.

use rotor_edge_desktop::compare::Adequacy;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::significance::percent;

use super::bars::{Bar, bars};
use super::comparison::{ComparedModel, comparison_sections, noise_error, verdict};
use super::sketch::{Mark, sketch};
use super::text::capital;
use super::trend::{Trend, trend};
use super::{Figure, Section, Story, findings};
use crate::answers::diagnose::{CandidateAnswer, FittedAnswer};
use crate::answers::findings::UnknownCauseAnswer;
use crate::scale::{number, rpm, three_digits};

/// Places less probable than this are not marked.
const WORTH_MARKING: f64 = 0.01;

/// What the page of fitted models draws beside the answer.
pub struct FittedCurves<'a> {
    /// The machine as the first model has it.
    pub rotor: &'a Rotor,
    pub readings: &'a [Reading],
    /// The first is judged; the last is the best.
    pub models: Vec<ComparedModel>,
    /// Where the first model is furthest off; nothing where a model cannot say.
    pub motion: Option<ShaftMotion>,
}

/// How far the whole shaft moves at one speed, without trial weights.
#[derive(Debug, Clone, PartialEq)]
pub struct ShaftMotion {
    pub speed_rpm: f64,
    /// By model, place along the shaft, m, and longest diameter of the orbit, µm pk-pk.
    pub shafts: Vec<(String, Vec<(f64, f64)>)>,
    /// Place, m, and whole clearance, µm, of oil films.
    pub clearances: Vec<(f64, f64)>,
    pub bearings: Vec<(f64, String)>,
}

/// Where the first and the last of some models fail; `rotor` is the machine as its file has it.
pub fn compared(rotor: &Rotor, drawn: &FittedCurves) -> Vec<Section> {
    let models: Vec<ComparedModel> = ends(&drawn.models).cloned().collect();
    comparison_sections(rotor, drawn.readings, &models)
}

/// Of one model and nothing else; `sure` is the probability that nothing is missing.
pub fn of_model(drawn: &FittedCurves, sure: f64, next: (String, Option<String>)) -> Story {
    let said = verdict(&drawn.models[0].comparison);
    let unnamed = match drawn.models[0].comparison.verdict {
        Adequacy::Adequate => Unnamed::complete(),
        Adequacy::Misses => Unnamed::of("An effect is missing; the diagnosis looks for it.", ""),
    };
    let mut story = story(&said[0], (&[], &unnamed), &[], drawn, how_complete(sure), next);
    story.answers[1].1 = said[1..].join(" ");
    story
}

/// What is said where no effect is named.
#[derive(Default)]
pub(super) struct Unnamed {
    pub wrong: String,
    pub place: String,
    /// More that is known of a cause.
    pub more: Vec<(&'static str, String)>,
    /// Where along the shaft it acts, where that is known.
    pub mark: Option<Mark>,
}

impl Unnamed {
    /// Of a model that lacks nothing visible.
    pub fn complete() -> Self {
        Self::of("No missing effect is visible in these data.", "–")
    }

    pub fn of(wrong: &str, place: &str) -> Self {
        Self { wrong: wrong.into(), place: place.into(), ..Self::default() }
    }

    /// Of a cause that no known effect is.
    pub fn cause(cause: &UnknownCauseAnswer) -> Self {
        let growth = findings::growth(cause).map(|growth| ("How it grows", growth));
        let looks_like = ("What looks like it", format!("{}.", capital(cause.looks_like)));
        let is_marked = cause.drawing.is_none() && findings::is_placed(cause);
        Self {
            wrong: findings::nature(cause, false),
            place: format!("{}.", capital(&findings::place(cause))),
            more: growth.into_iter().chain([looks_like]).collect(),
            mark: is_marked.then(|| Mark {
                position_m: cause.position_m,
                text: format!("unknown, {:.0} %", 100.0 * cause.place_probability),
                is_main: true,
            }),
        }
    }
}

/// The probability that a model lacks nothing visible, in a sentence.
pub(super) fn how_complete(probability: f64) -> String {
    format!("{} chance that the model is complete.", capital(&percent(probability)))
}

/// Of the effects in `main` among `candidates`, or of no named effect; `sentence` is the verdict.
pub(super) fn story(
    sentence: &str,
    (main, unnamed): (&[&FittedAnswer], &Unnamed),
    candidates: &[CandidateAnswer],
    drawn: &FittedCurves,
    how_sure: String,
    next: (String, Option<String>),
) -> Story {
    let models = &drawn.models;
    let wrong = match main {
        [] => unnamed.wrong.clone(),
        _ => main.iter().map(|c| c.what).collect::<Vec<_>>().join(" "),
    };
    let inspect: Vec<&str> = main.iter().map(|c| c.inspect).collect();
    let inspect = (!inspect.is_empty()).then(|| ("Inspect", inspect.join(" ")));
    let noise = noise_error(&models[models.len() - 1], drawn.readings);
    let known = unnamed.more.iter().filter(|_| main.is_empty()).cloned();
    let mark = unnamed.mark.as_ref().filter(|_| main.is_empty());
    let place = if main.is_empty() { unnamed.place.clone() } else { places(drawn.rotor, main) };
    let how_much_is = if models.len() > 1 { "How much better" } else { "How large the error" };
    Story {
        verdict: sentence.into(),
        answers: [("What is wrong", wrong), ("Where", place)]
            .into_iter()
            .chain(known)
            .chain([("How sure", how_sure), (how_much_is, how_much(models, noise))])
            .chain(inspect)
            .collect(),
        next,
        beside: vec![machine(drawn.rotor, candidates, main, mark), steps(models, noise)],
        below: drawn.motion.iter().map(deflection).collect(),
    }
}

/// Where a bearing, a disk, a probe or an end of this name is, m from the left end.
pub fn position_m(rotor: &Rotor, name: &str) -> Option<f64> {
    let bearing = rotor.bearing.iter().map(|b| (&b.name, b.position_m));
    let disk = rotor.disk.iter().map(|d| (&d.name, d.position_m));
    let probe = rotor.probe.iter().map(|p| (&p.name, p.position_m));
    let named = bearing.chain(disk).chain(probe).find(|(own, _)| *own == name).map(|(_, z)| z);
    named.or_else(|| (name == "left end").then_some(0.0))
}

/// The machine with every place that something may be missing at; `main` are the effects that the page is about.
pub fn machine(
    rotor: &Rotor,
    candidates: &[CandidateAnswer],
    main: &[&FittedAnswer],
    unknown: Option<&Mark>,
) -> Figure {
    let is_main = |at: &str| main.iter().any(|c| c.at.as_deref() == Some(at));
    let mut marks: Vec<Mark> = Vec::new();
    let mut elsewhere = Vec::new();
    for c in main {
        match c.at.as_deref().and_then(|at| position_m(rotor, at)) {
            Some(position_m) => {
                marks.push(Mark { position_m, text: c.effect.replace('_', " "), is_main: true })
            }
            None => elsewhere.push(c.words()),
        }
    }
    let mut places: Vec<&str> = candidates.iter().filter_map(|c| c.at.as_deref()).collect();
    places.sort_unstable();
    places.dedup();
    for at in places {
        let here = candidates.iter().filter(|c| c.at.as_deref() == Some(at));
        let probability: f64 = here.map(|c| c.probability).filter(|p| p.is_finite()).sum();
        let Some(position_m) = position_m(rotor, at).filter(|_| probability >= WORTH_MARKING) else {
            continue;
        };
        marks.push(Mark { position_m, text: format!("{:.0} %", 100.0 * probability), is_main: is_main(at) });
    }
    let mut caption = String::from("To scale; triangles are bearings, arrows probes, dashed lines planes.");
    if !marks.is_empty() {
        caption += " Rings: where one missing effect alone would be, with its probability there.";
    }
    if let Some(unknown) = unknown {
        marks.push(unknown.clone());
        caption += " Thick ring: where the unknown effect acts.";
    }
    if !elsewhere.is_empty() {
        caption += &format!(" Of the machine as a whole, or of a run: {}.", elsewhere.join(", "));
    }
    Figure::new("Machine", caption, sketch("The machine to scale", rotor, &marks))
}

fn deflection(motion: &ShaftMotion) -> Figure {
    let clearances = &motion.clearances;
    Figure::new(
        format!("How the shaft moves at {}", rpm(motion.speed_rpm)),
        "Longest diameter of the orbit along the shaft, from the fitted unbalance alone; circles: the whole clearance of \
         oil films, where the file states it.",
        trend(&Trend {
            along: "along the shaft, m".into(),
            quantity: "µm pk-pk".into(),
            measured: (!clearances.is_empty()).then(|| ("clearance".into(), clearances.clone())),
            curves: motion.shafts.clone(),
            events: motion.bearings.clone(),
            is_curved: true,
            ..Trend::default()
        }),
    )
}

/// The first and the last of the models, once if they are one.
fn ends(models: &[ComparedModel]) -> impl Iterator<Item = &ComparedModel> {
    models.first().into_iter().chain(models.last().filter(|_| models.len() > 1))
}

fn places(rotor: &Rotor, main: &[&FittedAnswer]) -> String {
    let place = |c: &&FittedAnswer| match &c.at {
        Some(at) => match position_m(rotor, at) {
            Some(z) => format!("{at}, {z:.3} m from the left end"),
            None => at.clone(),
        },
        None => "the machine as a whole".into(),
    };
    main.iter().map(place).collect::<Vec<_>>().join("; ")
}

fn how_much(models: &[ComparedModel], noise: f64) -> String {
    let each = |of: &dyn Fn(&ComparedModel) -> String| ends(models).map(of).collect::<Vec<_>>().join(" → ");
    format!(
        "Error {} (noise alone: {} %), χ² per value {} (noise: 1).",
        each(&|m| format!("{} %", three_digits(100.0 * m.comparison.relative_error))),
        three_digits(100.0 * noise),
        each(&|m| number(m.comparison.chi2_per_value, 2)),
    )
}

/// How the error falls from model to model.
pub fn steps(models: &[ComparedModel], noise: f64) -> Figure {
    let error = |m: &ComparedModel| m.comparison.relative_error;
    let largest = models.iter().map(error).fold(noise, f64::max).max(f64::MIN_POSITIVE);
    let bar = |(i, m): (usize, &ComparedModel)| Bar {
        label: m.prediction.label.clone(),
        share: error(m) / largest,
        value: format!("{} %", three_digits(100.0 * error(m))),
        emphasised: i + 1 == models.len(),
        floor: Some(noise / largest),
    };
    Figure::new(
        if models.len() > 1 { "The fall of the error" } else { "The error" },
        format!(
            "Error of all probes and speeds, of each model's most probable fit. Hatched: {} %, what noise alone leaves.",
            three_digits(100.0 * noise)
        ),
        bars(&models.iter().enumerate().map(bar).collect::<Vec<_>>()),
    )
}
