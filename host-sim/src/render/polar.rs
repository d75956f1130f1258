//! Polar plot: the path of one probe's phasor over speed.

use nalgebra::Complex;

use super::bode::{columns, lag_deg, peak_to_peak_um};
use super::chart::{Anchor, Chart, Column, Look};
use super::curve::Curve;
use super::ground::{Turn, polar_paper};
use crate::scale::number;

/// Speeds that are written beside the path.
const SPEEDS: usize = 4;
/// Room for such a word to the right and upwards, relative to the outer circle on a telephone.
const WORD: [f64; 2] = [0.7, 0.15];

/// The phasors in µm peak-to-peak; the keyphasor mark is at 0°, to the right, the shaft turns
/// counter-clockwise and the lag grows clockwise.
pub fn polar(measured: &[(f64, Complex<f64>)], models: &[Curve]) -> Chart {
    let everything = measured.iter().chain(models.iter().flat_map(|m| &m.points));
    let (mut chart, rim) = polar_paper(everything.map(|(_, y)| peak_to_peak_um(*y)), "µm pk-pk", Turn::Lag);
    let place = |y: Complex<f64>| [2e6 * y.re, 2e6 * y.im];
    let row = |(speed, y): &(f64, Complex<f64>)| {
        let [x, up] = place(*y);
        [x, up, *speed, peak_to_peak_um(*y), lag_deg(*y, 0.0)]
    };
    let [speed, amplitude, lag] = columns();
    let along = |name: &str| Column::new(name, "µm pk-pk");
    let columns = [along("to the right"), along("upwards"), speed, amplitude, lag];
    for (i, model) in models.iter().enumerate() {
        chart.draw(0, &model.label, Look::Model(i), &columns, model.points.iter().map(row));
    }
    chart.draw(0, "measured", Look::Measured, &columns, measured.iter().map(row));
    let told: Vec<usize> = told(measured, rim);
    chart.ground(0, Look::Marks, told.iter().map(|i| place(measured[*i].1)));
    let word = |i: &usize| (place(measured[*i].1), format!("{} rpm", number(measured[*i].0, 0)));
    // outside of the path, but not beyond the paper
    let begins_there = |i: &&usize| {
        let across_um = 2e6 * measured[**i].1.re;
        (across_um >= 0.0) == (across_um.abs() < 0.45 * rim)
    };
    let (right, left): (Vec<usize>, Vec<usize>) = told.iter().partition(begins_there);
    chart.write(0, Anchor::Left, right.iter().map(word));
    chart.write(0, Anchor::Right, left.iter().map(word));
    chart
}

/// Indices of some measured points far enough from the centre and from each other to carry their speed.
fn told(measured: &[(f64, Complex<f64>)], rim_um: f64) -> Vec<usize> {
    let size = |i: &usize| measured[*i].1.norm();
    let largest = (0..measured.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
    let evenly = (1..SPEEDS).rev().map(|i| i * measured.len() / SPEEDS);
    let mut chosen: Vec<usize> = Vec::new();
    for i in measured.len().checked_sub(1).into_iter().chain(largest).chain(evenly) {
        let Some((_, y)) = measured.get(i) else { continue };
        // a word is longer than it is high
        let clears = |c: &usize| {
            let apart_um = (y - measured[*c].1) * 2e6;
            apart_um.im.abs() > WORD[1] * rim_um || apart_um.re.abs() > WORD[0] * rim_um
        };
        if chosen.iter().all(clears) && 2e6 * y.norm() > WORD[1] * rim_um {
            chosen.push(i);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phasor_that_lags_a_quarter_turn_lies_below() {
        let chart = polar(&[(3000.0, Complex::new(0.0, -5e-6))], &[]);
        let series = chart.series.iter().find(|s| s.look == Look::Measured).unwrap();
        assert_eq!(series.rows, [[0.0, -10.0, 3000.0, 10.0, 90.0]]);
    }
}
