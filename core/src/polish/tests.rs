//! Against exact methods in f64 that share nothing with the polish: all vertices, and a walk around the bounds; and against
//! its own certificate, evaluated in f64.

use super::*;
use crate::testing::{Random, random_fit, random_fit_of};

/// Excess allowed relative to Σ|target|.
const ALLOWED: f64 = 1e-4;
/// A bound so wide that none is active, relative to the true unbalance. The certificate's rounding grows with it.
const WIDE: f32 = 30.0;
/// What [`PolishResult::gap_um`] may be, relative to Σ|target|: what sends the swarm searching.
const GAP: f32 = 1e-3;

type Point = [f64; 4];

struct Exact {
    columns: [[f64; 8]; 4],
    target: [f64; 8],
    bound: [f64; 2],
}

impl Exact {
    fn new(fit: &BoundedFit<4, 2>) -> Self {
        let cell = |row: usize, column: usize| fit.rows()[row].as_flattened()[column];
        Self {
            columns: core::array::from_fn(|j| core::array::from_fn(|i| f64::from(cell(i, j)))),
            target: core::array::from_fn(|i| f64::from(fit.target_um()[i])),
            bound: core::array::from_fn(|k| f64::from(fit.bound_g_mm()[k])),
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

fn target_sum<const PROBES: usize, const PLANES: usize>(fit: &BoundedFit<PROBES, PLANES>) -> f32 {
    fit.target_um().iter().map(|f| f.abs()).sum()
}

/// Polished, with its certificate and its bounds looked at.
fn polished<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    random: &mut Random,
) -> PolishResult<PLANES> {
    let start = core::array::from_fn(|_| [random.signed(), random.signed()]);
    let found = polish(fit, start);
    for ([x, y], &bound) in found.unbalance_g_mm.into_iter().zip(fit.bound_g_mm()) {
        assert!(x.hypot(y) <= bound * (1.0 + 1e-6), "left the bounds");
    }
    assert!(found.free_residual_um <= found.residual_um + 2e-6 * target_sum(fit));
    found
}

/// The excess of the residual over the exact minimum, relative to Σ|target|.
fn excess(fit: &BoundedFit<4, 2>, exact_um: f64, random: &mut Random) -> f64 {
    let found = polished(fit, random);
    assert!(found.gap_um <= GAP * target_sum(fit), "gap {:e}", found.gap_um / target_sum(fit));
    let excess = (f64::from(found.residual_um) - exact_um) / f64::from(target_sum(fit));
    assert!(excess > -2e-6, "below the exact minimum: {excess:e}");
    // Rounding of f32: a few steps of the target, and of H times the bounds.
    let pulls = fit.rows().iter().flat_map(|row| row.iter().zip(fit.bound_g_mm()));
    let reach: f32 = pulls.map(|([a, b], bound)| a.hypot(*b) * bound).sum();
    let rounding = 2e-6 + f64::from(f32::EPSILON * reach / target_sum(fit));
    assert!(
        f64::from(found.gap_um / target_sum(fit)) > excess - rounding,
        "the certificate promises too much: {:e} {excess:e} {rounding:e}",
        found.gap_um / target_sum(fit)
    );
    excess
}

#[test]
fn free_minimum_agrees_with_the_best_of_all_vertices() {
    let mut random = Random::new(11);
    for likeness in [0.0, 0.5, 0.9, 0.97] {
        for problem in 0..10 * COUNT {
            let fit = random_fit(&mut random, likeness, WIDE);
            let excess = excess(&fit, Exact::new(&fit).best_within(), &mut random);
            assert!(excess < ALLOWED, "likeness {likeness}, problem {problem}: {excess:e}");
        }
    }
}

#[test]
fn minimum_within_bounds_agrees_with_a_walk_around_them() {
    let mut random = Random::new(12);
    for likeness in [0.0, 0.5, 0.9, 0.97] {
        for bound in [0.01, 0.3, 0.8, 1.0, 1.2] {
            for problem in 0..COUNT {
                let fit = random_fit(&mut random, likeness, bound);
                let excess = excess(&fit, Exact::new(&fit).best_within(), &mut random);
                assert!(
                    excess < ALLOWED,
                    "likeness {likeness}, bound {bound}, problem {problem}: {excess:e}"
                );
            }
        }
    }
}

/// Problems of each kind: few in a debug build, whose walks are slow.
const COUNT: u64 = if cfg!(debug_assertions) { 5 } else { 100 };

#[test]
fn one_to_four_planes_on_as_many_to_eight_probes_are_certified() {
    fn run<const PLANES: usize>(random: &mut Random) {
        for probes in PLANES..=8 {
            for likeness in [0.0, 0.5, 0.9] {
                for bound in [0.01, 0.5, 0.9, 1.1, WIDE] {
                    for noise in [0.01, 0.3] {
                        for _ in 0..COUNT / 5 {
                            let fit = random_fit_of::<8, PLANES>(random, [likeness, bound, noise], probes);
                            let found = polished(&fit, random);
                            let gap = found.gap_um / target_sum(&fit);
                            assert!(
                                gap <= GAP,
                                "{PLANES} planes, {probes} probes, {likeness}, {bound}, {noise}: gap {gap:e}"
                            );
                        }
                    }
                }
            }
        }
    }
    let mut random = Random::new(15);
    run::<1>(&mut random);
    run::<2>(&mut random);
    run::<3>(&mut random);
    run::<4>(&mut random);
}

#[test]
fn equal_problems_in_other_capacities_give_equal_bits() {
    let mut random = Random::new(16);
    for bound in [0.5, 1e3] {
        let fit = random_fit_of::<4, 2>(&mut random, [0.5, bound, 0.2], 4);
        let rows = fit.rows().chunks(2).zip(fit.target_um().chunks(2)).map(|(rows, target)| {
            let mut coefficients = [nalgebra::Complex::default(); 4];
            for (c, [re, minus_im]) in coefficients.iter_mut().zip(rows[0]) {
                *c = nalgebra::Complex::new(re, -minus_im);
            }
            (coefficients, nalgebra::Complex::new(target[0], -target[1]))
        });
        let roomy = BoundedFit::<8, 4>::new(rows, fit.bound_g_mm());
        let (small, large) = (polish(&fit, [[0.1; 2]; 2]), polish(&roomy, [[0.1; 2]; 4]));
        assert_eq!(small.unbalance_g_mm[..], large.unbalance_g_mm[..2]);
        assert_eq!((small.residual_um, small.gap_um), (large.residual_um, large.gap_um));
        assert_eq!(fit.deviations_g_mm(0.1)[..], roomy.deviations_g_mm(0.1)[..2]);
    }
}

#[test]
fn bounded_plane_stays_at_zero_and_other_reaches_minimum() {
    let mut random = Random::new(13);
    for _ in 0..COUNT {
        let probes = random_fit(&mut random, 0.5, 0.7);
        let rows = probes.rows().chunks(2).zip(probes.target_um().chunks(2)).map(|(rows, target)| {
            let c = rows[0].map(|[re, minus_im]| nalgebra::Complex::new(re, -minus_im));
            (c, nalgebra::Complex::new(target[0], -target[1]))
        });
        let fit = BoundedFit::<4, 2>::new(rows, &[probes.bound_g_mm()[0], 0.0]);
        let excess = excess(&fit, Exact::new(&fit).best_other(1, [0.0; 2]), &mut random);
        assert!(excess.abs() < ALLOWED, "{excess:e}");
        assert_eq!(polish(&fit, [[0.1; 2]; 2]).unbalance_g_mm[1], [0.0; 2]);
    }
}

#[test]
fn without_noise_the_true_unbalance_comes_back() {
    let mut random = Random::new(14);
    for _ in 0..100 {
        let fit = random_fit_of::<4, 2>(&mut random, [0.5, 1e3, 0.0], 4);
        let found = polished(&fit, &mut random);
        assert!(found.residual_um < 1e-5 * target_sum(&fit), "{}", found.residual_um);
        assert!(!found.at_bound[0] && !found.at_bound[1]);
    }
}

/// The covariance of least squares, from the full real matrix in f64.
#[test]
fn deviations_are_those_of_the_inverted_normal_matrix() {
    let mut random = Random::new(17);
    for _ in 0..100 {
        let fit = random_fit_of::<8, 3>(&mut random, [0.5, 1.0, 0.2], 5);
        let mut normal = nalgebra::SMatrix::<f64, 6, 6>::zeros();
        for row in fit.rows() {
            let row = nalgebra::SVector::<f64, 6>::from_fn(|i, _| f64::from(row.as_flattened()[i]));
            normal += row * row.transpose();
        }
        let inverse = normal.try_inverse().unwrap();
        for (plane, deviation) in fit.deviations_g_mm(0.2).into_iter().enumerate() {
            for part in 0..2 {
                let want = 0.2 * inverse[(2 * plane + part, 2 * plane + part)].sqrt();
                assert!((f64::from(deviation) / want - 1.0).abs() < 1e-4, "{deviation} {want}");
            }
        }
    }
}

#[test]
fn planes_that_no_probe_tells_apart_have_no_finite_deviation() {
    let c = nalgebra::Complex::new(0.3, -0.4);
    let fit = BoundedFit::<4, 2>::new((0..4).map(|_| ([c, c * 2.0], c)), &[1.0, 1.0]);
    assert!(fit.deviations_g_mm(0.1).iter().all(|deviation| *deviation == f32::INFINITY));
}
