//! Bode plot: amplitude and phase lag of one probe over speed.

use nalgebra::Complex;

use super::canvas::{Axis, Entry, Legend, axes, curve, measured as circles, px, svg};
use super::curve::Curve;
use super::scale::Scale;

const AMPLITUDE_PX: f64 = 165.0;
const PHASE_PX: f64 = 175.0;

/// Amplitude above, phase lag below with later phases further down, over speed in rpm.
pub fn bode(title: &str, measured: &[(f64, Complex<f64>)], models: &[Curve]) -> String {
    bode_of("measured", title, measured, models)
}

/// The same with another name for what the circles show.
pub fn bode_of(
    circles_show: &str,
    title: &str,
    measured: &[(f64, Complex<f64>)],
    models: &[Curve],
) -> String {
    let models_entries = models.iter().enumerate().map(|(i, m)| Entry::Model(i, &m.label));
    let legend = Legend::new(std::iter::once(Entry::Measured(circles_show)).chain(models_entries));
    let everything = || measured.iter().chain(models.iter().flat_map(|m| &m.points));
    let speed = Scale::around(everything().map(|(s, _)| *s), 6);
    let amplitude = Scale::from_zero(everything().map(|(_, y)| peak_to_peak_um(*y)), 4);
    let first_deg = calmest_turn(measured, models);
    let ticks = (0..=4).map(|quarter| first_deg + 90.0 * f64::from(quarter)).collect();
    let lag = Scale { from: first_deg + 360.0, to: first_deg, ticks };
    svg(title, legend.height_px + AMPLITUDE_PX + PHASE_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let (upper, lower) = below.split_vertically(px(AMPLITUDE_PX));
        let y = Axis { scale: &amplitude, name: Some("µm pk-pk") };
        let mut chart = axes(&upper, &Axis { scale: &speed, name: None }, &y)?;
        for (i, model) in models.iter().enumerate() {
            let points: Vec<_> = model.points.iter().map(|(s, y)| (*s, peak_to_peak_um(*y))).collect();
            curve(&mut chart, i, &points)?;
        }
        circles(&mut chart, measured.iter().map(|(s, y)| (*s, peak_to_peak_um(*y))))?;
        let x = Axis { scale: &speed, name: Some("speed, rpm") };
        let mut chart = axes(&lower, &x, &Axis { scale: &lag, name: Some("phase lag, °") })?;
        for (i, model) in models.iter().enumerate() {
            for piece in lag_pieces(&model.points, first_deg) {
                curve(&mut chart, i, &piece)?;
            }
        }
        circles(&mut chart, measured.iter().map(|(s, y)| (*s, lag_deg(*y, first_deg))))
    })
}

/// Amplitude as the industry gives it.
pub(super) fn peak_to_peak_um(y: Complex<f64>) -> f64 {
    2e6 * y.norm()
}

/// Phase lag from the keyphasor mark to the peak, in the turn that begins at `first_deg`.
fn lag_deg(y: Complex<f64>, first_deg: f64) -> f64 {
    (-y.arg().to_degrees() - first_deg).rem_euclid(360.0) + first_deg
}

/// Where a turn of phase lag should begin so that it is left as seldom as can be: 0° where nothing
/// else is calmer.
fn calmest_turn(measured: &[(f64, Complex<f64>)], models: &[Curve]) -> f64 {
    let jumps = |points: &[(f64, Complex<f64>)], first_deg: f64| {
        let lags = |i: usize| lag_deg(points[i].1, first_deg);
        (1..points.len()).filter(|i| (lags(*i) - lags(i - 1)).abs() > 180.0).count()
    };
    let all_jumps = |first_deg: &f64| {
        let modelled: usize = models.iter().map(|m| jumps(&m.points, *first_deg)).sum();
        jumps(measured, *first_deg) + modelled
    };
    [0.0, -90.0, -180.0, -270.0].into_iter().min_by_key(all_jumps).unwrap_or(0.0)
}

/// The lag over speed, in one piece for each turn: cut where it leaves the axis.
fn lag_pieces(points: &[(f64, Complex<f64>)], first_deg: f64) -> Vec<Vec<(f64, f64)>> {
    let last_deg = first_deg + 360.0;
    let mut pieces = vec![Vec::new()];
    let mut last: Option<(f64, f64)> = None;
    for (speed, y) in points {
        let now = lag_deg(*y, first_deg);
        if let Some((speed_before, before)) = last
            && (now - before).abs() > 180.0
        {
            let (leaves, enters) = if now < before { (last_deg, first_deg) } else { (first_deg, last_deg) };
            let whole = 360.0 - (now - before).abs();
            let share = if whole > 0.0 { (leaves - before).abs() / whole } else { 0.0 };
            let at = speed_before + (speed - speed_before) * share;
            pieces.last_mut().expect("one piece to begin with").push((at, leaves));
            pieces.push(vec![(at, enters)]);
        }
        pieces.last_mut().expect("one piece to begin with").push((*speed, now));
        last = Some((*speed, now));
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lag_is_the_angle_turned_from_the_mark_to_the_peak() {
        // u = cos(Ωt − lag) has the phasor e^{−i lag}
        for lag in [0.0_f64, 45.0, 180.0, 359.0] {
            assert!((lag_deg(Complex::from_polar(1.0, -lag.to_radians()), 0.0) - lag).abs() < 1e-9);
        }
        assert!((peak_to_peak_um(Complex::new(3e-6, 4e-6)) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_curve_that_passes_360_degrees_is_cut_at_both_edges() {
        let lags = [300.0_f64, 340.0, 20.0, 350.0];
        let points: Vec<_> = lags
            .iter()
            .enumerate()
            .map(|(i, lag)| (i as f64, Complex::from_polar(1.0, -lag.to_radians())))
            .collect();
        let pieces = lag_pieces(&points, 0.0);
        let ends: Vec<_> = pieces.iter().map(|p| (p[0].1.round(), p[p.len() - 1].1.round())).collect();
        assert_eq!(ends, [(300.0, 360.0), (0.0, 0.0), (360.0, 350.0)]);
        assert!((pieces[1][0].0 - 1.5).abs() < 1e-9, "halfway from 340° to 380°");
    }
    #[test]
    fn a_lag_around_zero_is_drawn_in_one_piece() {
        let points: Vec<_> = (0..20)
            .map(|i| (f64::from(i), Complex::from_polar(1.0, -(f64::from(i) - 10.0).to_radians())))
            .collect();
        let first_deg = calmest_turn(&points, &[]);
        assert_eq!((first_deg, lag_pieces(&points, first_deg).len()), (-90.0, 1));
        assert_eq!(calmest_turn(&points[11..], &[]), 0.0);
    }
}
