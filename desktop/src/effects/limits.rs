//! How large a number of an effect may be in a file: its bounds, and a little beyond.

use nalgebra::Complex;

use super::{Parameter, Scale, Unknown};

/// How far beyond a bound a number may lie, of the size in which it is searched.
pub const SLACK: f64 = 0.1;
/// No number exceeds the size in which it is searched by more than this, nor a mass that of the rotor.
pub const BEYOND: f64 = 1e4;

/// Whether a file may state a number.
///
/// # Errors
/// One clause on what was expected.
pub fn allowed(p: &Parameter, value: f64) -> Result<(), String> {
    let [from, to] = limits(p);
    let ([least, most], largest) = (with_slack(p), largest(p));
    let is_positive = p.scale != Scale::Logarithmic || value > 0.0;
    if least <= value && value <= most && value.abs() <= largest && is_positive {
        return Ok(());
    }
    Err(format!("the parameter {} is {value:e}, expected {from:.3e} to {to:.3e} {}", p.name, p.unit))
}

/// The number that a file states for a fitted one: that itself, or the bound that it lies beyond. A fit that may end there by chance does
/// not tell the two apart.
pub fn nearest_allowed(p: &Parameter, value: f64) -> f64 {
    let [from, to] = limits(p);
    if allowed(p, value).is_ok() || value.is_nan() { value } else { value.clamp(from, to) }
}

/// The same of a linear unknown.
pub fn nearest_carried(unknown: &Unknown, value: Complex<f64>) -> Complex<f64> {
    let size = value.norm();
    if size <= unknown.largest * (1.0 + SLACK) { value } else { value * (unknown.largest / size) }
}

/// What a file is told to state at least and at most.
fn limits(p: &Parameter) -> [f64; 2] {
    let [low, high] = p.bounds;
    [low.max(-largest(p)), high.min(largest(p))]
}

fn with_slack(p: &Parameter) -> [f64; 2] {
    let [low, high] = p.bounds;
    match p.scale {
        Scale::Linear(size) => [low - SLACK * size.abs(), high + SLACK * size.abs()],
        Scale::Logarithmic => [low * (1.0 - SLACK), high * (1.0 + SLACK)],
    }
}

/// The largest size of a number of this kind.
fn largest(p: &Parameter) -> f64 {
    match p.scale {
        Scale::Linear(size) => BEYOND * size.abs(),
        Scale::Logarithmic => largest_on_earth(p.unit),
    }
}

/// Upper limit for each unit. Above it, a fitted value is rejected as unphysical.
fn largest_on_earth(unit: &str) -> f64 {
    match unit {
        "N/m" => 1e15,
        "N·s/m" => 1e12,
        "kg" => 1e8,
        "m" | "s" => 10.0,
        _ => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fitted_numbers_beyond_a_bound_are_stated_as_the_bound() {
        let of = |scale, bounds| Parameter { name: "k", unit: "N/m", scale, bounds };
        let logarithmic = of(Scale::Logarithmic, [0.0, f64::INFINITY]);
        let linear = of(Scale::Linear(2.0), [0.0, 1.0]);
        for (parameter, fitted, expected) in [
            // stiffer than anything on earth: rigid
            (&logarithmic, 1e35, 1e15),
            (&logarithmic, 3e7, 3e7),
            (&linear, 2.9, 1.0),
            // a little beyond, by chance
            (&linear, 1.1, 1.1),
            (&linear, -0.9, 0.0),
        ] {
            let stated = nearest_allowed(parameter, fitted);
            assert_eq!(stated, expected, "{fitted}");
            assert!(allowed(parameter, stated).is_ok());
        }
    }
}
