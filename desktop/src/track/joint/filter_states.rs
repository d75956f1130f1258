//! Filtered level and slope of static and dynamic unbalance on a day.

use nalgebra::{Complex, DVector};

use super::kalman::Gaussian;
use super::motion::ProcessModel;
use super::state::Layout;
use crate::forecast::filter_state::FilterState;
use crate::unbalance::{G_MM, static_and_dynamic};

type C = Complex<f64>;

impl Layout {
    /// Size (g·mm) and angle (degrees) of the static and of the dynamic unbalance with these weights in the planes (kg·m),
    /// linear in the state around its mean; `pace_d` is the days between two readings, in which the state's rate is stated.
    pub fn filter_states(
        &self,
        state: &Gaussian,
        weights_kg_m: &[C],
        motion: &ProcessModel,
        pace_d: f64,
    ) -> [FilterState; 4] {
        let kept = motion.rate_keep.powf(1.0 / pace_d);
        // what a rate of one a reading moves in a day
        let reach = (1.0 - kept) / (1.0 - motion.rate_keep);
        let gain = (1.0 - kept.powi(2)) / (1.0 - motion.rate_keep.powi(2));
        let flat = self.flat();
        let part = |a: usize, b: usize| state.covariance.view((a, b), (flat, flat));
        let of = |level: f64, slope: DVector<f64>| {
            let variance = |a: usize, b: usize| slope.dot(&(part(a, b) * &slope));
            let (level_sd, per_d_sd) =
                (variance(0, 0).max(0.0).sqrt(), reach * variance(flat, flat).max(0.0).sqrt());
            let both = level_sd * per_d_sd;
            FilterState {
                level,
                per_d: reach * slope.dot(&state.mean.rows(flat, flat)),
                level_sd,
                per_d_sd,
                correlation: if both > 0.0 {
                    (reach * variance(0, flat) / both).clamp(-1.0, 1.0)
                } else {
                    0.0
                },
                kept,
                push_sd: reach * slope.norm() * (motion.rate_push * gain).sqrt(),
            }
        };
        let own = self.unbalance(&state.mean);
        let sums: Vec<C> = own.iter().zip(weights_kg_m).map(|(u, weight)| u + weight).collect();
        let [fixed, couple] = static_and_dynamic(&self.positions_m, &sums);
        let [of_static, of_dynamic] = self.split_slopes(&state.mean);
        let size = |u: C, slopes: &[C]| {
            let towards = if u.norm() > 0.0 { u.conj() / u.norm() } else { C::from(1.0) };
            of(u.norm() * G_MM, real(slopes, |s| (towards * s).re * G_MM))
        };
        // the angle of nothing is anything, and is told as if it were of the least that a number can be
        let angle = |u: C, slopes: &[C]| {
            let u = if u.norm() > 0.0 { u } else { C::from(f64::MIN_POSITIVE.sqrt()) };
            of(u.arg().to_degrees(), real(slopes, |s| (s / u).im.to_degrees()))
        };
        [
            size(fixed, &of_static),
            angle(fixed, &of_static),
            size(couple, &of_dynamic),
            angle(couple, &of_dynamic),
        ]
    }

    /// Static and dynamic unbalance by each plane's coordinate, kg·m.
    fn split_slopes(&self, x: &DVector<f64>) -> [Vec<C>; 2] {
        let slope = |j: usize| self.planes[j].slope(self.coordinate(x, j));
        let planes = self.planes.len();
        let alone = |j: usize| {
            let mut one = vec![C::from(0.0); planes];
            one[j] = slope(j);
            static_and_dynamic(&self.positions_m, &one)
        };
        [0, 1].map(|which| (0..planes).map(|j| alone(j)[which]).collect())
    }
}

/// A derivative by complex coordinates as one by their real and imaginary parts.
fn real(slopes: &[C], of: impl Fn(C) -> f64) -> DVector<f64> {
    let parts = slopes.iter().flat_map(|s| [of(*s), of(C::i() * s)]);
    DVector::from_iterator(2 * slopes.len(), parts)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::super::coordinate::Coordinate;
    use super::*;
    use crate::testing::sample_rotor;
    use crate::track::coefficients::followed;

    fn layout() -> Layout {
        let planes = [C::new(3e-4, -1e-4), C::new(-2e-4, 4e-4)];
        Layout {
            planes: planes.iter().map(|u| Coordinate::new(*u, &[*u], u.norm())).collect(),
            positions_m: vec![0.12, 0.92],
            numbers: followed(&sample_rotor()).into(),
            regressors: Vec::new(),
            probes: 4,
            has_factors: false,
        }
    }

    fn motion() -> ProcessModel {
        ProcessModel {
            rate_push: 4e-6,
            rate_keep: 0.8,
            ..ProcessModel::first(&followed(&sample_rotor()), 1.0)
        }
    }

    /// Forecasts of the four numbers against the filter's own prediction of its state and differences of the numbers.
    #[test]
    fn filter_state_forecasts_equal_kalman_prediction() {
        let (layout, motion) = (layout(), motion());
        let size = layout.size();
        let mixed = DMatrix::from_fn(size, size, |i, j| 1e-3 * (((5 * i + 3 * j) % 11) as f64 - 5.0));
        let mut mean = layout.at(&[0.0; 8], &[C::new(0.05, 0.1), C::new(-0.1, 0.2)]);
        (0..4).for_each(|i| mean[4 + i] = 1e-5 * (i as f64 - 1.5));
        let state = Gaussian { mean, covariance: &mixed * mixed.transpose() };
        let weights = [C::new(5e-5, 0.0), C::new(0.0, -4e-5)];
        let numbers = |x: &DVector<f64>| {
            let sums: Vec<C> = layout.unbalance(x).iter().zip(&weights).map(|(u, w)| u + w).collect();
            let [s, d] = static_and_dynamic(&layout.positions_m, &sums);
            [s.norm() * G_MM, s.arg().to_degrees(), d.norm() * G_MM, d.arg().to_degrees()]
        };
        let mut later = state.clone();
        let step = layout.step(1.0, &motion, None, false);
        (0..30).for_each(|_| later = later.predicted(&step));
        let (then, expected) = (layout.filter_states(&state, &weights, &motion, 1.0), numbers(&later.mean));
        for (k, known) in then.iter().enumerate() {
            let slope = DVector::from_fn(4, |i, _| {
                let mut near = [state.mean.clone(), state.mean.clone()];
                (near[0][i], near[1][i]) = (near[0][i] - 1e-6, near[1][i] + 1e-6);
                (numbers(&near[1])[k] - numbers(&near[0])[k]) / 2e-6
            });
            let ahead = known.ahead(30);
            assert!((ahead.mean[29] - expected[k]).abs() < 1e-3 * expected[k].abs(), "{k}: {ahead:?}");
            let sd = slope.dot(&(later.covariance.view((0, 0), (4, 4)) * &slope)).sqrt();
            assert!((ahead.sd[29] / sd - 1.0).abs() < 1e-6, "{k}: {} {sd}", ahead.sd[29]);
        }
    }

    #[test]
    fn filter_state_rate_is_independent_of_reading_interval() {
        let layout = layout();
        let mut mean = layout.at(&[0.0; 8], &[C::from(0.0); 2]);
        mean[4] = 2e-3;
        let state = Gaussian { mean, covariance: DMatrix::zeros(layout.size(), layout.size()) };
        let every_second = ProcessModel { rate_keep: 0.64, ..motion() };
        // 2e-3 in two days of which the second has four fifths of the first
        let [slow, ..] = layout.filter_states(&state, &[C::from(0.0); 2], &every_second, 2.0);
        let [fast, ..] = layout.filter_states(&state, &[C::from(0.0); 2], &motion(), 1.0);
        assert!((slow.kept - 0.8).abs() < 1e-12);
        assert!((slow.per_d - fast.per_d / 1.8).abs() < 1e-12);
    }
}
