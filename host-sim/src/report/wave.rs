//! Time wave: the motion along one direction over one turn of the shaft.

use nalgebra::Complex;
use plotters::prelude::LineSeries;

use super::canvas::{Axis, Entry, INK, Legend, axes, curve, line, px, svg};
use super::scale::Scale;

const HEIGHT_PX: f64 = 190.0;
/// Points of a drawn wave.
const POINTS: usize = 90;

/// What was measured along one direction, and what models say, over one turn from the keyphasor mark on;
/// phasors in m.
pub fn wave(title: &str, measured: Complex<f64>, models: &[(&str, Complex<f64>)]) -> String {
    let entries = models.iter().enumerate().map(|(i, (label, _))| Entry::Model(i, label));
    let legend = Legend::new(std::iter::once(Entry::MeasuredLine("measured")).chain(entries));
    let all = std::iter::once(&measured).chain(models.iter().map(|(_, y)| y));
    let reach = 1.1 * all.map(|y| 1e6 * y.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let turn = Scale { from: 0.0, to: 360.0, ticks: (0..=4).map(|i| 90.0 * f64::from(i)).collect() };
    let motion = Scale::symmetric(reach, 4);
    svg(title, legend.height_px + HEIGHT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let x = Axis { scale: &turn, name: Some("turned since the keyphasor mark, °") };
        let mut chart = axes(&below, &x, &Axis { scale: &motion, name: Some("µm") })?;
        for (i, (_, y)) in models.iter().enumerate() {
            curve(&mut chart, i, &path(*y))?;
        }
        chart.draw_series(LineSeries::new(path(measured), line(INK, 1.4)))?;
        Ok(())
    })
}

/// `Re(Y e^{iφ})` in µm over φ in degrees.
fn path(y: Complex<f64>) -> Vec<(f64, f64)> {
    let at = |i: usize| {
        let turned = 360.0 * i as f64 / POINTS as f64;
        (turned, 1e6 * (y * Complex::from_polar(1.0, turned.to_radians())).re)
    };
    (0..=POINTS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_begins_with_the_cosine_part_and_shows_the_sine_part_a_quarter_turn_later() {
        // u = 3 cos φ + 4 sin φ
        let wave = path(Complex::new(3e-6, -4e-6));
        let near =
            |phi: f64| wave.iter().min_by(|a, b| (a.0 - phi).abs().total_cmp(&(b.0 - phi).abs())).unwrap().1;
        assert!((near(0.0) - 3.0).abs() < 1e-9);
        assert!((near(90.0) - 4.0).abs() < 0.2);
        assert!((near(360.0) - 3.0).abs() < 1e-9);
    }
}
