//! Names of coefficients, methods and events, as text, JSON and CSV share them.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::track::{FollowedNumber, Instrument, Method, SamplerKind, Scope, followed};

/// Names of the bearings' followed numbers, in the order of phase I.
pub fn coefficient_names(rotor: &Rotor) -> Vec<String> {
    let name =
        |n: &FollowedNumber| format!("{}_{}", rotor.bearing[n.bearing].name, n.law.symbol.replace(' ', "_"));
    followed(rotor).iter().map(name).collect()
}

/// The method as the command line calls it.
pub fn method_name(method: Method) -> &'static str {
    match method {
        Method::Fixed => "fixed",
        Method::Adaptive => "adaptive",
        Method::Bayes => "bayes",
        Method::Joint => "joint",
    }
}

/// Kind of an event: `machine`, `restart`, `probe gain` or `keyphasor`.
pub fn kind_name(scope: Scope) -> &'static str {
    match scope.instrument {
        Some(Instrument::Gain(_)) => "probe gain",
        Some(Instrument::PhaseReference) => "keyphasor",
        None if scope.restart => "restart",
        None => "machine",
    }
}

/// What an event changed, in words.
pub fn scope_name(rotor: &Rotor, scope: Scope) -> String {
    let bearings = scope.bearings.iter().map(|b| &rotor.bearing[b].name);
    let mut parts: Vec<String> = bearings.map(|name| format!("bearing {name}")).collect();
    parts.extend(scope.unbalance.then(|| "the unbalance".to_string()));
    parts.extend(scope.elsewhere.then(|| "the machine between its bearings".to_string()));
    parts.extend(scope.instrument.map(|instrument| match instrument {
        Instrument::Gain(p) => format!("the gain of probe {}", rotor.probe[p].name),
        Instrument::PhaseReference => "the keyphasor".to_string(),
    }));
    parts.join(" and ")
}

/// The sampler of `bayes` in words.
pub fn sampler_name(sampler: SamplerKind) -> &'static str {
    match sampler {
        SamplerKind::Independence => "independence Metropolis",
        SamplerKind::Metropolis => "Metropolis",
    }
}
