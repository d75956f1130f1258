//! Bearings that follow the speed, as the controller holds them: straight lines between a few knots.

use std::sync::Arc;

use rotor_edge_core::model::{Knot, KnotRange, MAX_KNOTS};
use rotor_edge_desktop::bearing::curve::{Curve, Interpolation, Knots};
use rotor_edge_desktop::bearing::dynamic_coefficients::DynamicCoefficients;
use rotor_edge_desktop::model::Model;

use super::{SPEED_RANGE, rows};

/// Slowest speed at which a curve is met, relative to the fastest in the data; below it stays. Most of what a bearing
/// does at a slow roll does not show, and every knot there is missing where it does.
const SLOWEST: f64 = 0.2;

/// The model with every curve replaced by straight lines between as many knots as there is room for.
pub fn straightened(mut model: Model, fastest_rad_s: f64) -> Model {
    let curves = model.supports.iter().filter(|s| s.law.curve.is_some()).count();
    let room = MAX_KNOTS.checked_div(curves).unwrap_or(0).max(2);
    for support in &mut model.supports {
        if let Some(curve) = &support.law.curve {
            let knots = Arc::new(on_straight_lines(curve, fastest_rad_s, room));
            support.law.curve = Some(Curve::Knots { knots, factors: DynamicCoefficients::ones() });
        }
    }
    model
}

/// At its own knots where there is room for them, else at speeds that grow by one factor: where coefficients follow
/// a power of the speed, as those of films do, straight lines then miss them by the same part everywhere.
fn on_straight_lines(curve: &Curve, fastest_rad_s: f64, room: usize) -> Knots {
    let (lowest, highest) = (SLOWEST * fastest_rad_s, SPEED_RANGE[1] * fastest_rad_s);
    let geometric = |low: f64, high: f64| -> Vec<f64> {
        (0..room).map(|i| low * (high / low).powf(i as f64 / (room - 1) as f64)).collect()
    };
    let within = |slowest: f64, fastest: f64| {
        let (first, last) = (slowest.max(lowest), fastest.min(highest));
        if first < last { geometric(first, last) } else { geometric(lowest, highest) }
    };
    let speeds = match curve {
        Curve::Knots { knots, .. } if knots.speeds_rad_s().len() <= room => knots.speeds_rad_s().to_vec(),
        Curve::Knots { knots, .. } => within(knots.speeds_rad_s()[0], knots.last_rad_s()),
        Curve::Film(film) => {
            let [slowest, fastest] = film.range_rad_s();
            within(slowest, fastest)
        }
        Curve::Logarithmic { .. } => geometric(lowest, highest),
    };
    let values = speeds.iter().map(|speed| curve.at(*speed)).collect();
    Knots::new(speeds, values, Interpolation::Straight)
}

/// The tables of a straightened model's supports, and the knots of all in turn.
pub fn tables(model: &Model) -> (Vec<Option<KnotRange>>, Vec<Knot>) {
    let mut all = Vec::new();
    let mut table = |curve: &Option<Curve>| {
        let Some(Curve::Knots { knots, .. }) = curve else { return None };
        let first = all.len() as u8;
        all.extend(knots.speeds_rad_s().iter().zip(knots.values()).map(|(speed, pair)| Knot {
            speed_rad_s: *speed as f32,
            stiffness_n_m: rows(&pair.stiffness),
            damping_n_s_m: rows(&pair.damping),
        }));
        Some(KnotRange { first, count: all.len() as u8 - first })
    };
    let tables = model.supports.iter().map(|s| table(&s.law.curve)).collect();
    (tables, all)
}
