//! The table of estimates.

use nalgebra::Complex;
use rotor_edge_desktop::balance::estimate::RunEstimates;
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};

pub const COLUMNS: [&str; 7] =
    ["run", "plane", "unbalance, g·mm", "95 %", "angle", "stated", "by influence coefficients"];

/// Magnitude and angle of an unbalance in g·mm.
pub fn polar(unbalance_g_mm: Complex<f64>) -> [f64; 2] {
    g_mm_deg(unbalance_g_mm / G_MM)
}

fn at(unbalance_g_mm: Complex<f64>) -> String {
    let [size, angle_deg] = polar(unbalance_g_mm);
    if size == 0.0 { "0".into() } else { format!("{size:.1} at {angle_deg:.0}°") }
}

/// One unbalance a plane, in words.
pub fn placed(unbalance_g_mm: &[Complex<f64>], planes: &[&str]) -> String {
    let each = unbalance_g_mm.iter().zip(planes).map(|(u, plane)| format!("{} in {plane}", at(*u)));
    each.collect::<Vec<_>>().join(", ")
}

/// Its rows, one a run and plane.
pub fn rows(found: &RunEstimates, planes: &[&str]) -> Vec<[String; COLUMNS.len()]> {
    let mut rows = Vec::new();
    for e in &found.runs {
        for (j, p) in e.planes.iter().enumerate() {
            let [size, angle_deg] = polar(p.unbalance_g_mm);
            let [low, high] = p.magnitude_95_g_mm();
            let of = |all: &Option<Vec<Complex<f64>>>| all.as_ref().map_or("–".into(), |u| at(u[j]));
            rows.push([
                e.run.clone(),
                planes[j].into(),
                format!("{size:.1}"),
                format!("{low:.1} to {high:.1}"),
                format!("{angle_deg:.0}°"),
                of(&e.stated_g_mm),
                of(&e.influence_g_mm),
            ]);
        }
    }
    rows
}
