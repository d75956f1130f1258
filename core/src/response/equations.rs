//! The equations of forward and backward whirl, and what couples them.

use heapless::Vec;

use super::{C, SupportAmplitudes};
use crate::linear::Symmetric;
use crate::model::{MAX_SUPPORTS, Model};
use crate::support::Block;

/// The two matrices and the couplings between them.
pub(super) struct Equations<const N: usize> {
    pub forward: Symmetric<N>,
    pub backward: Symmetric<N>,
    pub couplings: Vec<Coupling<N>, MAX_SUPPORTS>,
}

/// What ties forward to backward whirl at a support: `Fp += φφᵀ·pm·m`, `Fm += φφᵀ·mp·p`.
#[derive(Clone, Copy)]
pub(super) struct Coupling<const N: usize> {
    pub shape: [f32; N],
    pub pm: C,
    pub mp: C,
}

impl<const N: usize> Equations<N> {
    /// Of the shaft alone; above the diagonal there is nothing. Written once: a matrix that is zeroed first costs as much as
    /// a right-hand side.
    #[inline(always)]
    pub fn of_shaft<const PROBES: usize, const PLANES: usize>(
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
    ) -> Self {
        let square = speed * speed;
        let lag = 2.0 * speed * model.internal_damping_s;
        // The matrices are symmetric: nalgebra's columns will do for rows.
        let k = |i: usize, j: usize| model.stiffness.data.0[i][j];
        let inertia = |i: usize, j: usize| k(i, j) - square * model.mass.data.0[i][j];
        let gyroscopic = |i: usize, j: usize| square * model.polar_inertia.data.0[i][j];
        let forward = |i, j| C::new(inertia(i, j) + gyroscopic(i, j), 0.0);
        let backward = |i, j| C::new(inertia(i, j) - gyroscopic(i, j), lag * k(i, j));
        Self {
            forward: Symmetric::from_fn(forward),
            backward: Symmetric::from_fn(backward),
            couplings: Vec::new(),
        }
    }

    #[inline(never)]
    pub fn add_supports<const PROBES: usize, const PLANES: usize>(
        &mut self,
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        SupportAmplitudes(amplitudes): &SupportAmplitudes,
    ) {
        for (support, &amplitude) in model.supports.iter().zip(amplitudes) {
            let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
            let [[pp, pm], [mp, mm]] = whirling(&support.dynamic_stiffness(knots, speed, amplitude));
            let [shape] = &support.shape.data.0;
            self.add_support(shape, pp, mm);
            if pm != C::default() || mp != C::default() {
                // As many places as a model has supports.
                let _ = self.couplings.push(Coupling { shape: *shape, pm, mp });
            }
        }
    }

    #[inline(never)]
    fn add_support(&mut self, shape: &[f32; N], pp: C, mm: C) {
        let rows = self.forward.rows.iter_mut().zip(&mut self.backward.rows).zip(shape);
        for (i, ((forward, backward), &here)) in rows.enumerate() {
            let (pp, mm) = (pp * here, mm * here);
            let triangle = shape.get(..=i).unwrap_or_default();
            for ((forward, backward), &there) in forward.iter_mut().zip(backward).zip(triangle) {
                *forward += pp * there;
                *backward += mm * there;
            }
        }
    }
}

/// A matrix in x and y as `[[pp, pm], [mp, mm]]`, on forward and backward whirl.
#[inline]
pub(super) fn whirling([[xx, xy], [yx, yy]]: &Block) -> Block {
    let turned = |z: C| C::new(-z.im, z.re);
    let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
    let (twist, skew) = (turned(yx - xy) * 0.5, turned(yx + xy) * 0.5);
    [[mean + twist, half + skew], [half - skew, mean - twist]]
}
