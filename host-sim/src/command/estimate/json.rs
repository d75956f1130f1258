//! What `estimate --json` prints.

use nalgebra::Complex;
use rotor_edge_desktop::balance::estimate::RunEstimates;
use rotor_edge_desktop::unbalance::region::UnbalanceRegion;
use serde_json::{Value, json};

use super::rows::polar;

pub fn json(found: &RunEstimates, planes: &[&str]) -> Value {
    let point = |(u, name): (&Complex<f64>, &&str)| {
        let [unbalance_g_mm, angle_deg] = polar(*u);
        json!({"name": name, "unbalance_g_mm": unbalance_g_mm, "angle_deg": angle_deg})
    };
    let points = |all: &[Complex<f64>]| all.iter().zip(planes).map(point).collect::<Vec<_>>();
    json!({
        "base": found.base,
        "estimates": found.runs.iter().map(|e| json!({
            "run": e.run,
            "speed_rpm": e.speeds_rpm,
            "planes": e.planes.iter().zip(planes).map(|(p, name)| plane(p, name)).collect::<Vec<_>>(),
            "influence": {"planes": e.influence_g_mm.as_deref().map(points)},
            "stated": e.stated_g_mm.as_deref().map(points),
        })).collect::<Vec<_>>(),
        "condition": found.determined.conditions.iter().map(|c| json!({
            "speed_rpm": c.speed_rpm, "condition": finite(c.condition), "whitened": finite(c.whitened),
        })).collect::<Vec<_>>(),
        "determined": {
            "poorly": found.determined.poorly,
            "worst_sd_g_mm": finite(found.determined.worst_sd_g_mm),
            "words": found.determined.words,
        },
        "refuted_runs": found.refuted.iter().map(|r| json!({
            "run": r.run, "probability": r.probability, "stated": points(&r.stated_g_mm), "found": points(&r.found_g_mm),
        })).collect::<Vec<_>>(),
        "remarks": found.remarks,
    })
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn plane(p: &UnbalanceRegion, name: &str) -> Value {
    let [unbalance_g_mm, angle_deg] = polar(p.unbalance_g_mm);
    let c = p.covariance_g2_mm2;
    json!({
        "name": name,
        "unbalance_g_mm": unbalance_g_mm,
        "angle_deg": angle_deg,
        "interval_95": p.magnitude_95_g_mm(),
        "region": {
            "semi_axes_g_mm": p.semi_axes_g_mm,
            "major_deg": p.major_deg,
            "covariance_g2_mm2": [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]],
        },
    })
}
