//! Correction weights of every plane on one polar plot.

use nalgebra::Complex;
use rotor_edge_desktop::balance::places::Holes;

use super::chart::{Anchor, Chart, Column, Look};
use super::ground::{Turn, polar_paper};

/// Holes that are drawn around a plane at most: more would be a line.
const MOST_HOLES: usize = 72;

/// The weight of one plane, g·mm.
pub struct Weight {
    pub plane: String,
    pub wanted: Complex<f64>,
    /// What is put in, piece by piece, with the number of its hole.
    pub placed: Vec<(Complex<f64>, Option<usize>)>,
}

/// All weights and the holes around each plane; the keyphasor mark is to the right, the shaft turns counter-clockwise.
pub fn weights(all: &[Weight], holes: Option<&Holes>, against_rotation: bool) -> Chart {
    let turn = if against_rotation { Turn::Lag } else { Turn::WithRotation };
    let sizes = all.iter().flat_map(|w| w.placed.iter().map(|(u, _)| u).chain([&w.wanted])).map(|u| u.norm());
    let (mut chart, rim) = polar_paper(sizes, "g·mm", turn);
    let columns = unbalance_columns();
    if let Some(holes) = holes.filter(|holes| holes.count <= MOST_HOLES) {
        let columns = [columns[0].clone(), columns[1].clone(), Column::new("hole", ""), columns[3].clone()];
        let at = |k: usize| {
            let u = Complex::from_polar(rim, hole_rad(holes, k));
            [u.re, u.im, k as f64, unbalance_row(u)[3]]
        };
        chart.draw(0, "hole", Look::Measured, &columns, (1..=holes.count).map(at));
    }
    for (i, weight) in all.iter().enumerate() {
        let vector = [Complex::from(0.0), weight.wanted];
        let name = format!("{}, wanted", weight.plane);
        chart.draw(0, &name, Look::Model(i), &columns, vector.map(unbalance_row));
        let placed = || weight.placed.iter();
        let rows = placed().map(|(u, _)| unbalance_row(*u));
        chart.draw(0, &format!("{}, placed", weight.plane), Look::Rings(i), &columns, rows);
        if weight.placed.len() > 1 {
            let sum = unbalance_row(placed().map(|(u, _)| u).sum());
            chart.draw(0, &format!("{}, placed in all", weight.plane), Look::Dots(i), &columns, [sum]);
        }
        let named = placed().filter_map(|(u, hole)| Some(([u.re, u.im], format!("hole {}", (*hole)?))));
        for (at, word) in named {
            // towards the middle, where no angle is written
            let anchor = if at[0] < 0.0 { Anchor::Left } else { Anchor::Right };
            chart.write(0, anchor, [(at, word)]);
        }
    }
    chart
}

/// Where a hole is, with the rotation from the keyphasor mark.
fn hole_rad(holes: &Holes, number: usize) -> f64 {
    let sense = if holes.against_rotation { -1.0 } else { 1.0 };
    let step_deg = 360.0 / holes.count as f64;
    (holes.first_deg + sense * step_deg * (number - 1) as f64).to_radians()
}

/// What is told of an unbalance.
pub(super) fn unbalance_columns() -> [Column; 4] {
    let part = |name: &str| Column::new(name, "g·mm");
    [part("to the right"), part("upwards"), part("size"), Column::new("angle with the rotation", "°")]
}

pub(super) fn unbalance_row(u: Complex<f64>) -> [f64; 4] {
    [u.re, u.im, u.norm(), u.arg().to_degrees().rem_euclid(360.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_stand_around_the_plane_and_used_ones_have_a_number() {
        let holes = Holes { count: 8, first_deg: 30.0, against_rotation: true, most: 2 };
        let placed = Complex::from_polar(2.0, hole_rad(&holes, 3));
        let weight = Weight { plane: "A".into(), wanted: placed, placed: vec![(placed, Some(3))] };
        let chart = weights(&[weight], Some(&holes), false);
        let around = &chart.series.iter().find(|s| s.name.as_deref() == Some("hole")).unwrap().rows;
        assert_eq!(around.len(), 8);
        // against the rotation, 45° each: the third is 90° before the first
        assert!((around[2][3] - 300.0).abs() < 1e-3, "{:?}", around[2]);
        assert!(chart.series.iter().any(|s| s.words == ["hole 3"]));
    }
}
