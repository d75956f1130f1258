//! Correction weights of every plane on one polar plot.

use nalgebra::Complex;

use super::chart::{Chart, Column, Look};
use super::ground::{Turn, polar_paper};

/// The weight of one plane, g·mm.
pub struct Weight {
    pub plane: String,
    pub wanted: Complex<f64>,
    /// What is put in, piece by piece.
    pub placed: Vec<Complex<f64>>,
}

/// All weights; the keyphasor mark is to the right, the shaft turns counter-clockwise.
pub fn weights(all: &[Weight], against_rotation: bool) -> Chart {
    let turn = if against_rotation { Turn::Lag } else { Turn::WithRotation };
    let sizes = all.iter().flat_map(|w| w.placed.iter().chain([&w.wanted])).map(|u| u.norm());
    let (mut chart, _) = polar_paper(sizes, "g·mm", turn);
    let columns = unbalance_columns();
    for (i, weight) in all.iter().enumerate() {
        let vector = [Complex::from(0.0), weight.wanted];
        chart.draw(0, &weight.plane, Look::Model(i), &columns, vector.map(unbalance_row));
        let placed = weight.placed.iter().copied().map(unbalance_row);
        chart.draw(0, &format!("{}, placed", weight.plane), Look::Rings(i), &columns, placed);
    }
    chart
}

/// What is told of an unbalance.
pub(super) fn unbalance_columns() -> [Column; 4] {
    let part = |name: &str| Column::new(name, "g·mm");
    [part("to the right"), part("upwards"), part("size"), Column::new("angle with the rotation", "°")]
}

pub(super) fn unbalance_row(u: Complex<f64>) -> [f64; 4] {
    [u.re, u.im, u.norm(), u.arg().to_degrees().rem_euclid(360.0)]
}
