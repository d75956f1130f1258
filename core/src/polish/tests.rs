//! Against exact methods in f64 that share nothing with the polish: all vertices, and a walk around the bounds.

use super::*;
use crate::swarm::{DEFAULT_PARTICLES, SwarmConfig, search};
use crate::testing::{Random, random_fit};

/// Excess allowed relative to Σ|target|. 20,000 fresh problems of each kind, drawn after the last change, left 4e-5 at worst
/// without active bounds and 4e-4 within them; 1e-7 and 5e-7 on average.
const ALLOWED_FREE: f64 = 1e-4;
const ALLOWED: f64 = 1e-3;

type Point = [f64; 4];

struct Exact {
    columns: [[f64; 8]; 4],
    target: [f64; 8],
    bound: [f64; 2],
}

impl Exact {
    fn new(fit: &Fit) -> Self {
        Self {
            columns: fit.influence.data.0.map(|column| column.map(f64::from)),
            target: fit.target_um.map(f64::from),
            bound: fit.bound_g_mm.map(f64::from),
        }
    }

    fn value(&self, at: &Point) -> f64 {
        (0..8).map(|i| ((0..4).map(|j| self.columns[j][i] * at[j]).sum::<f64>() - self.target[i]).abs()).sum()
    }

    /// Without bounds a minimum lies where four residuals vanish: all 70 such points.
    fn best_vertex(&self) -> (Point, f64) {
        let mut best = ([0.0; 4], f64::INFINITY);
        for rows in (0_u32..256).filter(|rows| rows.count_ones() == 4) {
            let rows: std::vec::Vec<usize> = (0..8).filter(|i| rows >> i & 1 == 1).collect();
            let matrix = nalgebra::Matrix4::from_fn(|i, j| self.columns[j][rows[i]]);
            let right = nalgebra::Vector4::from_fn(|i, _| self.target[rows[i]]);
            if let Some(at) = matrix.lu().solve(&right) {
                let at = [at[0], at[1], at[2], at[3]];
                if self.value(&at) < best.1 {
                    best = (at, self.value(&at));
                }
            }
        }
        best
    }

    /// With plane `k` at the given place: the exact minimum over the disc of the other plane. It lies where two
    /// residuals vanish, where one does on the rim, or on the rim against the slope of an arc without sign change.
    fn best_other(&self, k: usize, place: [f64; 2]) -> f64 {
        let o = 1 - k;
        let bound = self.bound[o];
        let line = |i: usize| [self.columns[2 * o][i], self.columns[2 * o + 1][i]];
        let rest: [f64; 8] = core::array::from_fn(|i| {
            self.columns[2 * k][i] * place[0] + self.columns[2 * k + 1][i] * place[1] - self.target[i]
        });
        let value =
            |[x, y]: [f64; 2]| (0..8).map(|i| (rest[i] + line(i)[0] * x + line(i)[1] * y).abs()).sum::<f64>();
        let mut best = f64::INFINITY;
        let mut angles = std::vec![0.0];
        for i in 0..8 {
            let [a, b] = line(i);
            for j in 0..i {
                let [c, d] = line(j);
                let determinant = a * d - b * c;
                let point =
                    [(b * rest[j] - d * rest[i]) / determinant, (c * rest[i] - a * rest[j]) / determinant];
                if point[0].hypot(point[1]) <= bound {
                    best = best.min(value(point));
                }
            }
            let part = -rest[i] / (bound * a.hypot(b));
            if part.abs() <= 1.0 {
                let middle = b.atan2(a);
                angles.extend([middle + part.acos(), middle - part.acos()]);
            }
        }
        let turn = core::f64::consts::TAU;
        for angle in &mut angles {
            *angle = angle.rem_euclid(turn);
        }
        angles.sort_by(f64::total_cmp);
        let rim = |angle: f64| [bound * angle.cos(), bound * angle.sin()];
        for (place, &angle) in angles.iter().enumerate() {
            best = best.min(value(rim(angle)));
            let next = angles.get(place + 1).copied().unwrap_or(angles[0] + turn);
            let [x, y] = rim(0.5 * (angle + next));
            let slope = (0..8).fold([0.0, 0.0], |[p, q], i| {
                let [a, b] = line(i);
                let sign = (rest[i] + a * x + b * y).signum();
                [p + sign * a, q + sign * b]
            });
            let length = slope[0].hypot(slope[1]);
            best = best.min(value([-bound * slope[0] / length, -bound * slope[1] / length]));
        }
        best
    }

    /// Within the bounds: the best vertex if it is allowed; else some plane is on its bound, walked around in steps and
    /// then narrowed by golden section.
    fn best_within(&self) -> f64 {
        let (at, value) = self.best_vertex();
        if at[0].hypot(at[1]) <= self.bound[0] && at[2].hypot(at[3]) <= self.bound[1] {
            return value;
        }
        (0..2).map(|k| self.best_on_rim(k)).fold(f64::INFINITY, f64::min)
    }

    fn best_on_rim(&self, k: usize) -> f64 {
        const STEPS: i32 = 240;
        let step = core::f64::consts::TAU / f64::from(STEPS);
        let at = |angle: f64| self.best_other(k, [self.bound[k] * angle.cos(), self.bound[k] * angle.sin()]);
        let best = (0..STEPS).map(|i| f64::from(i) * step).min_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap();
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (best - step, best + step);
        for _ in 0..40 {
            let width = golden * (high - low);
            if at(high - width) < at(low + width) {
                high = low + width;
            } else {
                low = high - width;
            }
        }
        at(0.5 * (low + high))
    }
}

/// Swarm and polish, then the excess of the residual over the exact minimum, relative to Σ|target|.
fn excess(fit: &Fit, exact_um: f64, seed: u64) -> f64 {
    let start = search::<DEFAULT_PARTICLES>(&SwarmConfig::default(), fit, [[0.0; 2]; 2], seed);
    let found = polish(fit, start);
    for ([x, y], bound) in found.unbalance_g_mm.into_iter().zip(fit.bound_g_mm) {
        assert!(x.hypot(y) <= bound * (1.0 + 1e-6), "left the bounds");
    }
    let feature_sum: f64 = fit.target_um.iter().map(|f| f64::from(f.abs())).sum();
    (f64::from(found.residual_um) - exact_um) / feature_sum
}

#[test]
fn free_minimum_agrees_with_the_best_of_all_vertices() {
    let mut random = Random::new(11);
    for likeness in [0.0, 0.5, 0.9, 0.97] {
        for seed in 0..500 {
            let fit = Fit { bound_g_mm: [1e3; 2], ..random_fit(&mut random, likeness, 1.0) };
            let excess = excess(&fit, Exact::new(&fit).best_vertex().1, seed);
            assert!(excess > -2e-6, "below the exact minimum: {excess:e}");
            assert!(excess < ALLOWED_FREE, "likeness {likeness}, problem {seed}: {excess:e}");
        }
    }
}

#[test]
fn minimum_within_bounds_agrees_with_a_walk_around_them() {
    let mut random = Random::new(12);
    for likeness in [0.0, 0.5, 0.9, 0.97] {
        for bound in [0.01, 0.3, 0.8, 1.0, 1.2] {
            for seed in 0..COUNT {
                let fit = random_fit(&mut random, likeness, bound);
                let excess = excess(&fit, Exact::new(&fit).best_within(), seed);
                assert!(excess > -2e-6, "below the exact minimum: {excess:e}");
                assert!(excess < ALLOWED, "likeness {likeness}, bound {bound}, problem {seed}: {excess:e}");
            }
        }
    }
}

/// Problems of each kind: few in a debug build, whose walks are slow.
const COUNT: u64 = if cfg!(debug_assertions) { 5 } else { 200 };

#[test]
fn one_plane_reaches_its_own_minimum_and_leaves_the_absent_plane_at_zero() {
    let mut random = Random::new(13);
    for seed in 0..COUNT {
        let mut fit = random_fit(&mut random, 0.5, 0.7);
        for column in fit.influence.data.0.iter_mut().skip(2) {
            *column = [0.0; 8];
        }
        fit.bound_g_mm[1] = 0.0;
        let excess = excess(&fit, Exact::new(&fit).best_other(1, [0.0; 2]), seed);
        assert!(excess.abs() < ALLOWED, "{excess:e}");
        assert_eq!(polish(&fit, [[0.1; 2]; 2]).unbalance_g_mm[1], [0.0; 2]);
    }
}

#[test]
fn without_noise_the_true_unbalance_comes_back() {
    let mut random = Random::new(14);
    for _ in 0..100 {
        let mut fit = random_fit(&mut random, 0.5, 1e3);
        let truth = [[random.signed(), random.signed()], [random.signed(), random.signed()]];
        fit.target_um = [0.0; 8];
        fit.target_um = fit.residuals_um(&truth);
        let found = polish(&fit, [[0.0; 2]; 2]);
        for (found, truth) in found.unbalance_g_mm.as_flattened().iter().zip(truth.as_flattened()) {
            assert!((found - truth).abs() < 1e-5, "{found} {truth}");
        }
        assert_eq!(found.at_bound, [false; 2]);
    }
}
