//! Bode plot: amplitude and phase lag of one probe over speed.

use nalgebra::Complex;

use super::chart::{Axis, Chart, Column, Look, Panel};
use super::curve::Curve;

const AMPLITUDE_PX: f64 = 180.0;
const PHASE_PX: f64 = 210.0;

/// Amplitude above, phase lag below with later phases further down, over speed in rpm.
pub fn bode(measured: &[(f64, Complex<f64>)], models: &[Curve]) -> Chart {
    bode_of("measured", measured, models)
}

/// The same with another name for what the circles show.
pub fn bode_of(circles_show: &str, measured: &[(f64, Complex<f64>)], models: &[Curve]) -> Chart {
    let first_deg = calmest_turn(measured, models);
    let lag = Axis {
        from: Some(first_deg + 360.0),
        to: Some(first_deg),
        step: Some(90.0),
        ..Axis::named("phase lag, °")
    };
    let upper = Panel { y: Axis::from_zero("µm pk-pk"), height_px: AMPLITUDE_PX, ..Panel::default() };
    let lower = Panel { x: Axis::named("speed, rpm"), y: lag, height_px: PHASE_PX, ..Panel::default() };
    let mut chart = Chart { panels: vec![upper, lower], columns: 1, shares_x: true, ..Chart::default() };
    let [speed, amplitude, lag] = columns();
    let above = [speed.clone(), amplitude.clone(), lag.clone()];
    let below = [speed, lag, amplitude];
    let point = |(s, y): &(f64, Complex<f64>)| [*s, peak_to_peak_um(*y), lag_deg(*y, first_deg)];
    for (i, model) in models.iter().enumerate() {
        chart.draw(0, &model.label, Look::Model(i), &above, model.points.iter().map(point));
        let pieces = lag_pieces(&model.points, first_deg);
        chart.draw(1, &model.label, Look::Model(i), &below, pieces);
    }
    chart.draw(0, circles_show, Look::Measured, &above, measured.iter().map(point));
    let turned = measured.iter().map(point).map(|[s, high, lag]| [s, lag, high]);
    chart.draw(1, circles_show, Look::Measured, &below, turned);
    chart
}

/// What is told of a phasor.
pub(super) fn columns() -> [Column; 3] {
    [Column::key("speed", "rpm"), Column::new("amplitude", "µm pk-pk"), Column::new("phase lag", "°")]
}

/// Amplitude as the industry gives it.
pub(super) fn peak_to_peak_um(y: Complex<f64>) -> f64 {
    2e6 * y.norm()
}

/// Phase lag from the keyphasor mark to the peak, in the turn that begins at `first_deg`.
pub(super) fn lag_deg(y: Complex<f64>, first_deg: f64) -> f64 {
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

/// Speed, lag and amplitude of a curve, with a gap wherever the lag leaves the axis at one end and enters at the other.
fn lag_pieces(points: &[(f64, Complex<f64>)], first_deg: f64) -> Vec<Vec<f64>> {
    let last_deg = first_deg + 360.0;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (speed, y) in points {
        let now = lag_deg(*y, first_deg);
        if let Some([speed_before, before, high]) = rows.last().map(|row| [row[0], row[1], row[2]])
            && (now - before).abs() > 180.0
        {
            let (leaves, enters) = if now < before { (last_deg, first_deg) } else { (first_deg, last_deg) };
            let whole = 360.0 - (now - before).abs();
            let share = if whole > 0.0 { (leaves - before).abs() / whole } else { 0.0 };
            let at = speed_before + (speed - speed_before) * share;
            rows.extend([vec![at, leaves, high], vec![at, f64::NAN, f64::NAN], vec![at, enters, high]]);
        }
        rows.push(vec![*speed, now, peak_to_peak_um(*y)]);
    }
    rows
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
        let rows = lag_pieces(&points, 0.0);
        let pieces: Vec<_> = rows.split(|row| row[1].is_nan()).collect();
        let ends: Vec<_> = pieces.iter().map(|p| (p[0][1].round(), p[p.len() - 1][1].round())).collect();
        assert_eq!(ends, [(300.0, 360.0), (0.0, 0.0), (360.0, 350.0)]);
        assert!((pieces[1][0][0] - 1.5).abs() < 1e-9, "halfway from 340° to 380°");
    }
    #[test]
    fn a_lag_around_zero_is_drawn_in_one_piece() {
        let points: Vec<_> = (0..20)
            .map(|i| (f64::from(i), Complex::from_polar(1.0, -(f64::from(i) - 10.0).to_radians())))
            .collect();
        let first_deg = calmest_turn(&points, &[]);
        assert_eq!((first_deg, lag_pieces(&points, first_deg).len()), (-90.0, points.len()));
        assert_eq!(calmest_turn(&points[11..], &[]), 0.0);
    }
}
