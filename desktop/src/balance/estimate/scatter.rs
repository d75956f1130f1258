//! Scatter between mountings: its covariance over the rows, learned as far as the runs tell.
//!
//! Before any run is seen it is a sum of what mountings are known to change: each row by itself; the runout under a
//! probe, the same at all speeds; the amplification in one direction, at one speed and at all. The size of each is
//! learned, then the whole is an inverse Wishart's mean, so that many runs overrule the structure.

use nalgebra::{Complex, DMatrix, DVector};

use crate::machine::drawing::Rotor;

type C = Complex<f64>;

/// Guessed sizes relative to the response: a row alone, runout, amplification.
const GUESSED: [f64; 3] = [0.01, 0.01, 0.02];
/// Weight of each guess, in mountings.
pub const GUESS_WEIGHT: f64 = 1.0;
/// Weight of the structure against the residuals' own covariance, in mountings.
const STRUCTURE_WEIGHT: f64 = 2.0;
/// Rounds of the sizes in each round of learning.
const ROUNDS: usize = 5;
/// Least standard deviation, µm: the resolution of a good proximity probe.
const LEAST_UM: f64 = 3e-3;
/// Probes whose directions differ by less than this look the same way, degrees.
const SAME_DIRECTION_DEG: f64 = 20.0;

#[derive(Debug, Clone)]
pub struct ScatterStructure {
    parts: Vec<DMatrix<C>>,
}

impl ScatterStructure {
    /// Of a machine with this influence whose rows have these levels.
    pub fn new(rotor: &Rotor, influence: &DMatrix<C>, levels_um: &[f64]) -> Self {
        let (rows, probes) = (levels_um.len(), rotor.probe.len());
        let speeds = rows / probes;
        let mean_square = |rows: &[f64]| rows.iter().map(|l| l * l).sum::<f64>() / rows.len() as f64;
        let by_speed: Vec<f64> = levels_um.chunks(probes).map(|l| mean_square(l).sqrt()).collect();
        let overall = by_speed.iter().sum::<f64>() / speeds as f64;
        let [alone, runout, amplification] = GUESSED;
        let diagonal = |row: usize| C::from((alone * by_speed[row / probes]).powi(2));
        let mut parts = vec![DMatrix::from_diagonal(&DVector::from_fn(rows, |row, _| diagonal(row)))];
        let outer = |of: &dyn Fn(usize) -> C| {
            let v = DVector::from_fn(rows, |row, _| of(row));
            &v * v.adjoint()
        };
        if speeds > 1 {
            for p in 0..probes {
                let here = |row: usize| row % probes == p;
                parts.push(outer(&|row| C::from(if here(row) { runout * overall } else { 0.0 })));
            }
        }
        let together = influence.column_sum();
        let moved = |row: usize| {
            let h: C = together[row];
            h / h.norm().max(f64::MIN_POSITIVE) * (amplification * levels_um[row])
        };
        for direction in directions(rotor) {
            let looks = |row: usize| direction.contains(&(row % probes));
            let at = |s: usize| {
                outer(&|row| if looks(row) && row / probes == s { moved(row) } else { C::from(0.0) })
            };
            parts.push((0..speeds).map(at).fold(DMatrix::zeros(rows, rows), |sum, part| sum + part));
            if speeds > 1 {
                parts.push(outer(&|row| if looks(row) { moved(row) } else { C::from(0.0) }));
            }
        }
        Self { parts }
    }

    /// Sizes before anything is learned: 1 for each part.
    pub fn guessed(&self) -> DVector<f64> {
        DVector::from_element(self.parts.len(), 1.0)
    }

    /// Covariance with these sizes, per component.
    pub fn covariance(&self, sizes: &DVector<f64>) -> DMatrix<C> {
        let rows = self.parts[0].nrows();
        let floor = DMatrix::from_diagonal_element(rows, rows, C::from(LEAST_UM * LEAST_UM));
        self.parts.iter().zip(sizes.iter()).fold(floor, |sum, (part, size)| sum + part * C::from(*size))
    }

    /// Sizes that make `scatter`, the sum over `count` mountings of residuals' products per component, most probable: rounds
    /// of minorisation and maximisation (Zhou, Hu, Zhou and Lange 2019), each guess an inverse gamma prior.
    pub fn sizes(&self, sizes: &DVector<f64>, scatter: &DMatrix<C>, count: f64) -> DVector<f64> {
        let mut sizes = sizes.clone();
        for _ in 0..ROUNDS {
            let Some(inverse) = self.covariance(&sizes).try_inverse() else { break };
            let seen = &inverse * scatter * &inverse;
            let product = |a: &DMatrix<C>, b: &DMatrix<C>| a.component_mul(&b.transpose()).sum().re;
            for (size, part) in sizes.iter_mut().zip(&self.parts) {
                let wanted = *size * *size * product(&seen, part) + GUESS_WEIGHT;
                *size = (wanted / (count * product(&inverse, part) + GUESS_WEIGHT / *size)).sqrt();
            }
        }
        sizes
    }

    /// Covariance of a mounting: the structure, and the residuals as far as there are any.
    pub fn with_residuals(&self, sizes: &DVector<f64>, scatter: &DMatrix<C>, count: f64) -> DMatrix<C> {
        (self.covariance(sizes) * C::from(STRUCTURE_WEIGHT) + scatter) / C::from(STRUCTURE_WEIGHT + count)
    }
}

/// Probes by the direction in which they look.
fn directions(rotor: &Rotor) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let apart_deg = |a: usize, b: usize| {
        let d = (rotor.probe[a].angle_deg - rotor.probe[b].angle_deg).rem_euclid(180.0);
        d.min(180.0 - d)
    };
    for p in 0..rotor.probe.len() {
        match groups.iter_mut().find(|g| apart_deg(g[0], p) < SAME_DIRECTION_DEG) {
            Some(group) => group.push(p),
            None => groups.push(vec![p]),
        }
    }
    groups
}

/// Real form of a circular covariance: real parts, then imaginary parts.
pub fn real(complex: &DMatrix<C>) -> DMatrix<f64> {
    let n = complex.nrows();
    DMatrix::from_fn(2 * n, 2 * complex.ncols(), |i, j| {
        let v = complex[(i % n, j % complex.ncols())];
        match (i < n, j < complex.ncols()) {
            (true, true) | (false, false) => v.re,
            (true, false) => -v.im,
            (false, true) => v.im,
        }
    })
}

/// The circular part of a real form.
pub fn circular(real: &DMatrix<f64>) -> DMatrix<C> {
    let n = real.nrows() / 2;
    DMatrix::from_fn(n, n, |i, j| {
        C::new(real[(i, j)] + real[(n + i, n + j)], real[(n + i, j)] - real[(i, n + j)]) * 0.5
    })
}
