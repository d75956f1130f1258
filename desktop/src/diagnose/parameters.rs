//! Parameters of an effect with their uncertainty and physical bounds.

use nalgebra::Complex;

use crate::fit::Fit;
use crate::fit::hypothesis::Hypothesis;
use crate::statistics::interval::interval_95;

/// Standard deviations that a parameter must lie beyond its bound before the effect is ruled out.
const BEYOND: f64 = 3.0;

/// A parameter as fitted; phasors have two components.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// As in `[[effect]] parameters`; phasors of several probes are numbered.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// The number, or real and imaginary part of the phasor.
    pub value: Vec<f64>,
    /// Standard deviation of each component; `None` where it was not worked out.
    pub sd: Option<f64>,
    /// Ends of the 95 % interval of each component, of a positive number a factor either way; empty where it was not worked out.
    pub interval_95: Vec<[f64; 2]>,
    /// What physics allows: range of a real number, or of a phasor's magnitude.
    bounds: [f64; 2],
}

impl FittedParameter {
    /// A number or phasor with the standard deviation of each component and no bounds.
    pub fn new(name: &str, unit: &'static str, value: Vec<f64>, sd: f64) -> Self {
        let interval_95 = value.iter().map(|v| interval_95(*v, sd)).collect();
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        Self { name: name.into(), unit, value, sd: Some(sd), interval_95, bounds }
    }
}

/// Parameters of the last effect of a hypothesis.
pub fn of(with: &Hypothesis, fit: &Fit) -> Vec<FittedParameter> {
    of_each(with, fit).pop().unwrap_or_default()
}

/// Parameters of every effect of a hypothesis.
pub fn of_each(with: &Hypothesis, fit: &Fit) -> Vec<Vec<FittedParameter>> {
    let variance = |i: usize| fit.covariance.as_ref().map(|c| c[(i, i)].max(0.0));
    let (mut first, mut start) = (with.bearings.count(), with.rotor.plane.len());
    let mut each = Vec::new();
    for placed in &with.effects {
        let real = placed.effect.parameters(&with.scales);
        let mut all: Vec<FittedParameter> = real
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let value = p.scale.to_si(fit.x[first + k]);
                let own_sd = variance(first + k).map(f64::sqrt);
                let ends = |sd: f64| interval_95(fit.x[first + k], sd).map(|end| p.scale.to_si(end));
                let sd = own_sd.map(|sd| sd * p.scale.slope(value));
                FittedParameter {
                    name: p.name.to_string(),
                    unit: p.unit,
                    value: vec![value],
                    sd,
                    interval_95: own_sd.map(ends).into_iter().collect(),
                    bounds: p.bounds,
                }
            })
            .collect();
        let unknowns = placed.effect.unknowns(with.rotor, placed.place);
        for (k, u) in unknowns.iter().enumerate() {
            let value: Complex<f64> = fit.unknowns[start + k];
            let name = if unknowns.iter().filter(|other| other.name == u.name).count() > 1 {
                format!("{} {}", u.name, k + 1)
            } else {
                u.name.to_string()
            };
            let sd = variance(fit.x.len() + 2 * (start + k)).map(f64::sqrt);
            let bounds = [0.0, u.largest];
            let value = vec![value.re, value.im];
            let interval_95 = sd.iter().flat_map(|sd| value.iter().map(|v| interval_95(*v, *sd))).collect();
            all.push(FittedParameter { name, unit: u.unit, value, sd, interval_95, bounds });
        }
        first += real.len();
        start += unknowns.len();
        each.push(all);
    }
    each
}

/// Number of the first linear unknown of an effect, the planes' counted.
pub fn first_unknown(with: &Hypothesis, effect: usize) -> usize {
    let before = with.effects[..effect].iter().map(|a| a.effect.unknowns(with.rotor, a.place).len());
    with.rotor.plane.len() + before.sum::<usize>()
}

/// Bearing coefficients and effect parameters of a fit in SI units, effect by effect.
pub fn split<'f>(with: &Hypothesis, fit: &'f Fit) -> Vec<(Vec<f64>, &'f [Complex<f64>])> {
    let (mut at, mut unknown) = (with.bearings.count(), with.rotor.plane.len());
    let mut parts = Vec::new();
    for placed in &with.effects {
        let scaled = placed.effect.parameters(&with.scales);
        let real = scaled.iter().zip(&fit.x[at..]).map(|(p, v)| p.scale.to_si(*v)).collect();
        let count = placed.effect.unknowns(with.rotor, placed.place).len();
        parts.push((real, &fit.unknowns[unknown..unknown + count]));
        at += scaled.len();
        unknown += count;
    }
    parts
}

/// Why physics does not allow these parameters: one lies outside its bounds by more than chance.
pub fn beyond_physics(parameters: &[FittedParameter]) -> Option<String> {
    outside_bounds(parameters, BEYOND)
}

/// Why these parameters of an effect that the file states are not to be relied on: the most probable value of one is none that
/// physics allows, whatever its uncertainty.
pub fn at_bounds(parameters: &[FittedParameter]) -> Option<String> {
    outside_bounds(parameters, 0.0)
}

/// A parameter that lies outside its bounds by more than so many standard deviations.
fn outside_bounds(parameters: &[FittedParameter], deviations: f64) -> Option<String> {
    parameters.iter().find_map(|p| {
        let size = p.value.iter().map(|v| v * v).sum::<f64>().sqrt();
        let value = if p.value.len() == 1 { p.value[0] } else { size };
        let slack = deviations * p.sd.unwrap_or(0.0).min(f64::MAX);
        let [low, high] = p.bounds;
        let bound = if value + slack < low {
            low
        } else if value - slack > high {
            high
        } else {
            return None;
        };
        let side = if value < low { "below" } else { "above" };
        Some(format!(
            "{} = {value:.3e} {} lies {side} {bound:.3e}, which physics does not allow",
            p.name, p.unit
        ))
    })
}
