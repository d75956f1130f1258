//! Numbers of the model, as sliders.

use rotor_edge_desktop::machine::drawing::Rotor;
use serde::Serialize;

use crate::session::Session;
use crate::session::parameters::{self, ParameterId};

#[derive(Debug, Serialize)]
pub struct ParameterView {
    id: ParameterId,
    owner: String,
    name: String,
    /// The number with its unit.
    text: String,
    /// As fitted.
    fitted: String,
    /// Where on the slider it is, 0 to 1.
    share: f64,
    can_hold: bool,
    is_held: bool,
}

/// Every number of a fitted model, those moved where they were moved to.
pub fn all(session: &Session, fitted: &Rotor) -> Vec<ParameterView> {
    let moved = session.moved.as_ref().map(parameters::all).unwrap_or_default();
    let view = |p: parameters::Parameter| {
        let value = moved.iter().find(|m| m.id == p.id).map_or(p.value, |m| m.value);
        ParameterView {
            text: p.text(value),
            fitted: p.text(p.value),
            share: p.share(value),
            can_hold: p.id.held().is_some(),
            is_held: session.held.contains(&p.id),
            owner: p.owner,
            name: p.name,
            id: p.id,
        }
    };
    parameters::all(fitted).into_iter().map(view).collect()
}
