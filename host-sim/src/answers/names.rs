//! Names of coefficients, methods and events, as text, JSON and CSV share them.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::track::{Instrument, Method, SamplerKind, Scope};

/// Names of the eight coefficients, in the order of phase I.
pub fn coefficient_names(rotor: &Rotor) -> Vec<String> {
    let of = |kind: &str| {
        let axes = |b: &rotor_edge_desktop::machine::drawing::Bearing| {
            ["xx", "yy"].map(|a| format!("{}_{kind}_{a}", b.name))
        };
        rotor.bearing.iter().flat_map(axes).collect::<Vec<_>>()
    };
    [of("k"), of("c")].concat()
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
    let bearings = rotor.bearing.iter().zip(scope.bearings).filter(|(_, changed)| *changed);
    let mut parts: Vec<String> = bearings.map(|(b, _)| format!("bearing {}", b.name)).collect();
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
