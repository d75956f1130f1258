//! What is assumed of a machine: its file, and the effects it might have, as a vector of unknowns.

use nalgebra::Complex;

use crate::bearing::support::SupportLaw;
use crate::effects::{Effect, Parameter, Place, Scale, Scales, Unknown, add_unknown};
use crate::machine::drawing::Rotor;
use crate::machine::terms::Terms;

/// Direct bearing coefficients: k_xx k_yy of each bearing, then c_xx c_yy of each.
pub const COEFFICIENTS: usize = 8;
/// How far the file's bearing coefficients are trusted: standard deviation of their logarithms.
pub const PRIOR_LOG_SD: f64 = 0.5;

/// An effect at its place.
#[derive(Clone, Copy)]
pub struct Assumed {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Where it sits.
    pub place: Place,
}

impl Assumed {
    /// `effect@place`, or the effect alone where it concerns the whole machine.
    pub fn label(&self, rotor: &Rotor) -> String {
        match self.place.name(rotor) {
            Some(at) => format!("{}@{at}", self.effect.name()),
            None => self.effect.name().to_string(),
        }
    }
}

/// A rotor with some effects assumed. Unknowns `x` that enter nonlinearly: logarithms of the bearing
/// coefficients, then the parameters of each effect in their own scales.
#[derive(Clone)]
pub struct Hypothesis<'a> {
    /// The machine as its file states it.
    pub rotor: &'a Rotor,
    /// Sizes for scaling.
    pub scales: Scales,
    /// What it is assumed to have beside.
    pub effects: Vec<Assumed>,
}

impl<'a> Hypothesis<'a> {
    /// The machine as drawn.
    pub fn drawn(rotor: &'a Rotor, scales: Scales) -> Self {
        Self { rotor, scales, effects: Vec::new() }
    }

    /// The same with one more effect.
    pub fn with(&self, effect: Assumed) -> Self {
        let mut more = self.clone();
        more.effects.push(effect);
        more
    }

    /// Logarithms of the file's bearing coefficients. Damping of zero starts from a loss of one
    /// millionth, as a logarithm needs a number.
    pub fn drawn_bearings(&self) -> [f64; COEFFICIENTS] {
        std::array::from_fn(|i| {
            let (bearing, axis, damping) = coefficient(i);
            let b = &self.rotor.bearing[bearing];
            let of = |c: &crate::machine::drawing::Coefficients| if axis == 0 { c.xx } else { c.yy };
            let value = if damping { of(&b.damping_n_s_m) } else { of(&b.stiffness_n_m) };
            value.max(1e-6 * of(&b.stiffness_n_m)).ln()
        })
    }

    /// Parameters of all effects that are searched, in order.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.effects.iter().flat_map(|a| a.effect.parameters(&self.scales)).collect()
    }

    /// Parameters of all effects that are solved for, in order.
    pub fn unknowns(&self) -> Vec<Unknown> {
        self.effects.iter().flat_map(|a| a.effect.unknowns(self.rotor, a.place)).collect()
    }

    /// Search coordinates of the file's bearings, everything of the effects at zero.
    pub fn origin(&self) -> Vec<f64> {
        let mut x = self.drawn_bearings().to_vec();
        x.resize(self.size(), 0.0);
        x
    }

    /// Length of `x`.
    pub fn size(&self) -> usize {
        COEFFICIENTS + self.parameters().len()
    }

    /// Supports, readings and physics at `x`; the linear unknowns are left out.
    pub fn terms(&self, x: &[f64]) -> Terms {
        let mut terms = Terms::drawn(self.rotor);
        for (i, log) in x.iter().take(COEFFICIENTS).enumerate() {
            let (bearing, axis, damping) = coefficient(i);
            let law: &mut SupportLaw = &mut terms.supports[bearing].1;
            let matrix = if damping { &mut law.damping_n_s_m } else { &mut law.stiffness_n_m };
            matrix[(axis, axis)] = log.exp();
        }
        let mut at = COEFFICIENTS;
        for assumed in &self.effects {
            let parameters = assumed.effect.parameters(&self.scales);
            let si: Vec<f64> = parameters.iter().zip(&x[at..]).map(|(p, v)| to_si(p, *v)).collect();
            assumed.effect.apply(assumed.place, &si, &self.scales, &mut terms);
            at += parameters.len();
        }
        terms
    }

    /// Everything at `x` with the linear unknowns at `values`.
    pub fn whole_terms(&self, x: &[f64], values: &[Complex<f64>]) -> Terms {
        let mut terms = self.terms(x);
        for (unknown, value) in self.unknowns().iter().zip(values) {
            add_unknown(unknown, *value, &mut terms);
        }
        terms
    }
}

/// Bearing, axis (0 for x) of coefficient `i`, and whether it is damping.
pub fn coefficient(i: usize) -> (usize, usize, bool) {
    ((i / 2) % 2, i % 2, i >= COEFFICIENTS / 2)
}

/// A parameter in SI units from its search coordinate.
pub fn to_si(parameter: &Parameter, x: f64) -> f64 {
    match parameter.scale {
        Scale::Linear(unit) => unit * x,
        Scale::Logarithmic => x.exp(),
    }
}

/// The search coordinate of a parameter in SI units.
pub fn from_si(parameter: &Parameter, value: f64) -> f64 {
    match parameter.scale {
        Scale::Linear(unit) => value / unit,
        Scale::Logarithmic => value.ln(),
    }
}
