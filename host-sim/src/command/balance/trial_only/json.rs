//! What `balance --trial-only --json` says.

use nalgebra::Complex;
use rotor_edge_desktop::balance::alone::{Basis, Left, PlaneWeight};
use rotor_edge_desktop::balance::optimum::Criterion;
use rotor_edge_desktop::balance::places::Piece;
use serde_json::{Value, json};

use super::answer::TrialBalanceResult;
use crate::command::balance::placed;

/// µm of the units of displacement.
fn um_of(unit: &str) -> Option<f64> {
    match unit {
        "um" => Some(1.0),
        "mil" => Some(25.4),
        "mm" => Some(1e3),
        "m" => Some(1e6),
        _ => None,
    }
}

pub fn json(answer: &TrialBalanceResult) -> Value {
    let found = &answer.correction;
    let vector = |u: Complex<f64>| json!({"magnitude_g_mm": u.norm(), "angle_deg": answer.told_deg(u)});
    let piece = |p: &Piece| placed(p, answer.told_deg(p.unbalance_g_mm));
    let weight = |(w, line): (&PlaneWeight, &String)| {
        json!({
            "plane": w.plane,
            "magnitude_g_mm": w.wanted_g_mm.norm(),
            "angle_deg": answer.told_deg(w.wanted_g_mm),
            "interval_95": w.interval_95.map(|(magnitude, _)| magnitude),
            "angle_95_deg": w.interval_95.map(|(_, half)| half),
            "placed": w.filling.pieces.iter().map(piece).collect::<Vec<_>>(),
            "text": line,
        })
    };
    let um = um_of(&found.unit);
    let left = |l: &Left| {
        json!({
            "probe": l.probe,
            "speed_rpm": l.speed_rpm,
            "before_um": um.map(|um| um * l.before),
            "after_um": um.map(|um| um * l.after),
            "after_at_most_um": um.zip(l.after_at_most).map(|(um, after)| um * after),
            "before": l.before,
            "after": l.after,
            "after_at_most": l.after_at_most,
        })
    };
    let lines = answer.shop_lines();
    json!({
        "angles": answer.direction(),
        "unit": found.unit,
        "criterion": match answer.criterion {
            Criterion::LeastSquares => "least_squares",
            Criterion::MinMax => "min_max",
        },
        "onto": answer.onto,
        "noise": match found.basis {
            Basis::Stated => "stated",
            Basis::Runs(_) => "runs",
            Basis::Readings(_) => "readings",
            Basis::Unknown => "unknown",
        },
        "weights": found.weights.iter().zip(&lines).map(weight).collect::<Vec<_>>(),
        "static_couple": answer.static_and_couple().map(|[all, couple]| json!({
            "static": vector(all), "couple": vector(couple),
        })),
        "left": found.left.iter().map(left).collect::<Vec<_>>(),
        "doubts": found.doubts,
    })
}
