//! Places of a machine, and the effects that can sit there.

use rotor_edge::answers::diagnose::CandidateAnswer;
use rotor_edge::render::fitted::position_m;
use rotor_edge::render::sketch::across;
use rotor_edge_desktop::effects::{ALL, Effect, Place};
use rotor_edge_desktop::machine::drawing::Rotor;
use serde::Serialize;

use super::{per_cent, probable};
use crate::session::Session;
use crate::session::step::Change;

#[derive(Debug, Serialize)]
pub struct PlaceView {
    /// The name in the file; `None` for the whole machine.
    name: Option<String>,
    label: String,
    kind: &'static str,
    /// Where it is on the drawing, as a share of its width.
    across: Option<f64>,
    /// That an effect here is what is missing.
    probability: Option<f64>,
    probable: String,
    effects: Vec<EffectView>,
}

#[derive(Debug, Serialize)]
struct EffectView {
    effect: &'static str,
    words: String,
    probability: Option<f64>,
    probable: String,
    /// The error with it.
    gain: String,
    what: &'static str,
    /// Why physics rules it out.
    disqualified: Option<String>,
    is_present: bool,
    is_chosen: bool,
}

/// Every place of the model where an effect can sit or sits, in the order of the file.
pub fn all(session: &Session, rotor: &Rotor, candidates: &[CandidateAnswer], error: f64) -> Vec<PlaceView> {
    let mut places: Vec<Place> =
        ALL.into_iter().flat_map(|effect: &'static dyn Effect| effect.places(rotor)).collect();
    places.sort_unstable();
    places.dedup();
    places.into_iter().map(|place| view(session, rotor, place, candidates, error)).collect()
}

fn view(
    session: &Session,
    rotor: &Rotor,
    place: Place,
    candidates: &[CandidateAnswer],
    error: f64,
) -> PlaceView {
    let name = place.name(rotor);
    let name = name.as_deref();
    let chosen = |effect: &str| {
        let change = session.preview.as_ref().map(|step| &step.change);
        matches!(change, Some(Change::Added { effect: e, at }) if e == effect && at.as_deref() == name)
    };
    let is_present = |effect: &str| rotor.effect.iter().any(|e| e.kind == effect && e.at.as_deref() == name);
    let can_sit =
        |effect: &&'static dyn Effect| is_present(effect.name()) || effect.places(rotor).contains(&place);
    let mut effects: Vec<EffectView> = ALL
        .into_iter()
        .filter(can_sit)
        .map(|effect| {
            let known = candidates.iter().find(|c| c.effect == effect.name() && c.at.as_deref() == name);
            EffectView {
                effect: effect.name(),
                words: effect.name().replace('_', " "),
                probability: known.map(|c| c.probability),
                probable: known.map_or_else(|| "–".into(), |c| probable(c.probability)),
                gain: known.map_or_else(String::new, |c| gain(error, c.error_after)),
                what: effect.knowledge().what,
                disqualified: known.and_then(|c| c.disqualified.clone()),
                is_present: is_present(effect.name()),
                is_chosen: chosen(effect.name()),
            }
        })
        .collect();
    // where nothing is known yet the order of the list stays
    effects.sort_by(|a, b| b.probability.unwrap_or(-1.0).total_cmp(&a.probability.unwrap_or(-1.0)));
    let probability = (!candidates.is_empty())
        .then(|| effects.iter().filter_map(|e| e.probability).filter(|p| p.is_finite()).sum::<f64>());
    PlaceView {
        name: name.map(String::from),
        label: name.map_or_else(|| "whole machine".into(), String::from),
        kind: kind(place),
        across: name.and_then(|name| position_m(rotor, name)).map(|z| across(rotor, z)),
        probability,
        probable: probability.map_or_else(String::new, probable),
        effects,
    }
}

fn kind(place: Place) -> &'static str {
    match place {
        Place::Machine => "machine",
        Place::Bearing(_) => "bearing",
        Place::Disk(_) => "disk",
        Place::Probe(_) => "probe",
        Place::LeftEnd => "end",
        Place::Run(_) => "run",
        Place::Span(_) | Place::Strain(..) => "length",
    }
}

fn gain(before: f64, after: f64) -> String {
    format!("{} → {}", per_cent(before), per_cent(after))
}
