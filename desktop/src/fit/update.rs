//! What a change of the supports does to the response: a small update of the receptances.
//!
//! Coordinates are forward and backward amplitudes, `x = f + b`, `y = −i (f − b)`: first the forward
//! ones of all held places, then the backward ones, D = 2 × held places. With receptances `H` on the
//! nominal springs and `Δ` the actual minus the nominal dynamic stiffness, the machine's response is
//! `Y = Y₀ − Q (1 + ΔH)⁻¹ Δ H₀` (Sherman–Morrison–Woodbury).

use nalgebra::{Complex, Matrix2, SMatrix, SVector};

use super::plant::Tables;

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

/// A 2 × 2 matrix in x and y as one in forward and backward amplitudes.
pub fn circular(xy: &Matrix2<C>) -> Matrix2<C> {
    let (sum, difference) = (xy.m11 + xy.m22, xy.m11 - xy.m22);
    let (curl, shear) = (I * (xy.m21 - xy.m12), I * (xy.m21 + xy.m12));
    Matrix2::new(sum + curl, difference + shear, difference - shear, sum - curl) * C::from(0.5)
}

/// The receptances that one hypothesis needs, at one speed.
pub struct Selected<const D: usize> {
    nominal: SVector<C, D>,
    held: SMatrix<C, D, D>,
    held_force: Vec<SVector<C, D>>,
    probe_held: Vec<SVector<C, D>>,
    probe_force: Vec<Vec<C>>,
}

/// The machine on its actual supports.
pub struct Response<const D: usize> {
    /// Forces × probes: motion per unit force, m.
    pub probes: Vec<Vec<C>>,
    /// Forces: motion of the held places, forward then backward.
    pub held: Vec<SVector<C, D>>,
    /// Probes: motion per unit of force at a held place; what derivatives need.
    pub adjoint: Vec<SVector<C, D>>,
}

impl<const D: usize> Selected<D> {
    /// Picks held places and force columns; a column is a sum of forces with complex factors.
    pub fn new(tables: &Tables, held: &[usize], columns: &[Vec<(usize, C)>]) -> Self {
        let m = D / 2;
        let whirl = |i: usize| (i / m, held[i % m]);
        let sum = |column: &[(usize, C)], value: &dyn Fn(usize) -> C| -> C {
            column.iter().map(|(force, factor)| value(*force) * factor).sum()
        };
        let probes = tables.probe_force.nrows();
        Self {
            nominal: SVector::from_fn(|i, _| {
                let (sense, place) = whirl(i);
                if place < tables.bearings { tables.nominal[sense] } else { C::from(0.0) }
            }),
            held: SMatrix::from_fn(|i, j| match (whirl(i), whirl(j)) {
                ((0, a), (0, b)) => tables.held_forward[(a, b)],
                ((1, a), (1, b)) => tables.held_backward[(a, b)],
                _ => C::from(0.0),
            }),
            held_force: columns
                .iter()
                .map(|column| {
                    SVector::from_fn(|i, _| match whirl(i) {
                        (0, place) => sum(column, &|f| tables.held_force[(place, f)]),
                        _ => C::from(0.0),
                    })
                })
                .collect(),
            probe_held: (0..probes)
                .map(|p| {
                    SVector::from_fn(|i, _| match whirl(i) {
                        (0, place) => tables.probe_forward[(p, place)],
                        (_, place) => tables.probe_backward[(p, place)],
                    })
                })
                .collect(),
            probe_force: columns
                .iter()
                .map(|column| (0..probes).map(|p| sum(column, &|f| tables.probe_force[(p, f)])).collect())
                .collect(),
        }
    }

    /// The response with these dynamic stiffnesses (2 × 2 in x and y) at the held places.
    ///
    /// `None` if the machine is singular on them.
    pub fn respond(&self, supports: &[Matrix2<C>]) -> Option<Response<D>> {
        let m = D / 2;
        let mut delta = SMatrix::<C, D, D>::zeros();
        for (place, xy) in supports.iter().enumerate() {
            let z = circular(xy);
            delta[(place, place)] = z.m11;
            delta[(place, m + place)] = z.m12;
            delta[(m + place, place)] = z.m21;
            delta[(m + place, m + place)] = z.m22;
        }
        for i in 0..D {
            delta[(i, i)] -= self.nominal[i];
        }
        let inverse = (SMatrix::identity() + delta * self.held).try_inverse()?;
        let update = inverse * delta;
        let mut held = Vec::with_capacity(self.held_force.len());
        let mut probes = Vec::with_capacity(self.held_force.len());
        for (motion, seen) in self.held_force.iter().zip(&self.probe_force) {
            let force = update * motion;
            held.push(motion - self.held * force);
            probes.push(seen.iter().zip(&self.probe_held).map(|(y, q)| y - q.dot(&force)).collect());
        }
        let transposed = inverse.transpose();
        let adjoint = self.probe_held.iter().map(|q| transposed * q).collect();
        Some(Response { probes, held, adjoint })
    }
}

impl<const D: usize> Response<D> {
    /// Change at probe `p` per change `slope` (2 × 2 in x and y) of the dynamic stiffness at `place`, for a
    /// motion `held` of the held places.
    pub fn sensitivity(&self, p: usize, place: usize, slope: &Matrix2<C>, held: &SVector<C, D>) -> C {
        let m = D / 2;
        let z = circular(slope);
        let force =
            [z.m11 * held[place] + z.m12 * held[m + place], z.m21 * held[place] + z.m22 * held[m + place]];
        -(self.adjoint[p][place] * force[0] + self.adjoint[p][m + place] * force[1])
    }
}
