//! Time wave: the motion along one direction over one turn of the shaft.

use nalgebra::Complex;

use super::chart::{Axis, Chart, Column, Look, Panel};

const HEIGHT_PX: f64 = 220.0;
/// Points of a drawn wave.
const POINTS: usize = 90;

/// What was measured along one direction, and what models say, over one turn from the keyphasor mark on;
/// phasors in m.
pub fn wave(measured: Complex<f64>, models: &[(&str, Complex<f64>)]) -> Chart {
    let turned = "turned since the keyphasor mark, °";
    let x = Axis { from: Some(0.0), to: Some(360.0), step: Some(90.0), ..Axis::named(turned) };
    let mut chart =
        Chart::of(Panel { x, y: Axis::from_zero("µm"), height_px: HEIGHT_PX, ..Panel::default() });
    let columns = [Column::of_axis(turned), Column::new("motion", "µm")];
    for (i, (label, y)) in models.iter().enumerate() {
        chart.draw(0, label, Look::Model(i), &columns, path(*y));
    }
    chart.draw(0, "measured", Look::MeasuredLine, &columns, path(measured));
    chart
}

/// `Re(Y e^{iφ})` in µm over φ in degrees.
fn path(y: Complex<f64>) -> Vec<[f64; 2]> {
    let at = |i: usize| {
        let turned = 360.0 * i as f64 / POINTS as f64;
        [turned, 1e6 * (y * Complex::from_polar(1.0, turned.to_radians())).re]
    };
    (0..=POINTS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wave_starts_with_cosine_part_and_sine_a_quarter_later() {
        // u = 3 cos φ + 4 sin φ
        let wave = path(Complex::new(3e-6, -4e-6));
        let near = |phi: f64| {
            wave.iter().min_by(|a, b| (a[0] - phi).abs().total_cmp(&(b[0] - phi).abs())).unwrap()[1]
        };
        assert!((near(0.0) - 3.0).abs() < 1e-9);
        assert!((near(90.0) - 4.0).abs() < 0.2);
        assert!((near(360.0) - 3.0).abs() < 1e-9);
    }
}
