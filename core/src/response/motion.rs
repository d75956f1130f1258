//! Forward and backward whirl of the shaft for each right-hand side.

use nalgebra::SVector;

use super::coupled::{self, Coupling};
use super::{C, SupportAmplitudes};
use crate::linear::Symmetric;
use crate::model::{ForcingLaw, MAX_SUPPORTS, Model};
use crate::support::Block;

/// Growth of numbers beyond which the factors without pivoting are not trusted: the factors' error is this many times
/// that of rounding the matrix.
const LARGEST_GROWTH: f32 = 16.0;

/// Coordinates of the forward and the backward whirl.
#[derive(Clone, Copy)]
pub(super) struct Whirl<const N: usize> {
    pub plus: [C; N],
    pub minus: [C; N],
}

impl<const N: usize> Whirl<N> {
    pub fn zero() -> Self {
        Self { plus: [C::default(); N], minus: [C::default(); N] }
    }
}

/// Motion for a unit of unbalance (1 g·mm) in each plane, and for the forcings.
pub(super) struct Motion<const N: usize, const PLANES: usize> {
    pub planes: [Whirl<N>; PLANES],
    pub forced: Whirl<N>,
}

/// The two matrices (lower triangles), the couplings between them and the forces, all on `p` alone.
pub(super) struct Equations<const N: usize, const PLANES: usize> {
    pub forward: [[C; N]; N],
    pub backward: [[C; N]; N],
    pub couplings: heapless::Vec<Coupling<N>, MAX_SUPPORTS>,
    pub planes: [[C; N]; PLANES],
    pub forced: Option<[C; N]>,
}

impl<const N: usize, const PLANES: usize> Motion<N, PLANES> {
    /// `None` if the equations are singular.
    #[inline]
    pub fn new<const PROBES: usize>(
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Option<Self> {
        let equations = Equations::new(model, speed, amplitudes);
        let forward = Symmetric::factor(equations.forward, LARGEST_GROWTH);
        let backward = Symmetric::factor(equations.backward, LARGEST_GROWTH);
        if let (Some(forward), Some(backward)) = (forward, backward)
            && let Some(motion) = coupled::solve(&equations, &forward, &backward)
        {
            return Some(motion);
        }
        coupled::eliminate(&equations)
    }
}

impl<const N: usize, const PLANES: usize> Equations<N, PLANES> {
    #[inline]
    fn new<const PROBES: usize>(
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        SupportAmplitudes(amplitudes): &SupportAmplitudes,
    ) -> Self {
        let square = speed * speed;
        let mut equations = Self {
            forward: [[C::default(); N]; N],
            backward: [[C::default(); N]; N],
            couplings: heapless::Vec::new(),
            planes: [[C::default(); N]; PLANES],
            forced: None,
        };
        equations.add_shaft(model, speed);
        for (support, &amplitude) in model.supports.iter().zip(amplitudes) {
            let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
            let [shape] = support.shape.data.0;
            equations.add_support(shape, &support.dynamic_stiffness(knots, speed, amplitude));
        }
        for (side, plane) in equations.planes.iter_mut().zip(&model.planes) {
            add_force(side, plane, C::new(square, 0.0));
        }
        for forcing in &model.forcings {
            let [re, im] = forcing.amplitude;
            let law = match forcing.law {
                ForcingLaw::Constant => 1.0,
                ForcingLaw::SpeedSquared => square,
            };
            let side = equations.forced.get_or_insert([C::default(); N]);
            add_force(side, &forcing.shape, C::new(re, im) * law);
        }
        equations
    }

    #[inline]
    fn add_shaft<const PROBES: usize>(&mut self, model: &Model<N, PROBES, PLANES>, speed: f32) {
        let square = speed * speed;
        let lag = 2.0 * speed * model.internal_damping_s;
        for i in 0..N {
            for j in 0..=i {
                // The matrices are symmetric: nalgebra's columns will do for rows.
                let k = model.stiffness.data.0[i][j];
                let inertia = k - square * model.mass.data.0[i][j];
                let gyroscopic = square * model.polar_inertia.data.0[i][j];
                self.forward[i][j] = C::new(inertia + gyroscopic, 0.0);
                self.backward[i][j] = C::new(inertia - gyroscopic, lag * k);
            }
        }
    }

    #[inline]
    fn add_support(&mut self, shape: [f32; N], stiffness: &Block) {
        let [[pp, pm], [mp, mm]] = whirling(stiffness);
        for i in 0..N {
            let (forward, backward) = (pp * shape[i], mm * shape[i]);
            for j in 0..=i {
                self.forward[i][j] += forward * shape[j];
                self.backward[i][j] += backward * shape[j];
            }
        }
        if pm != C::default() || mp != C::default() {
            // As many places as a model has supports.
            let _ = self.couplings.push(Coupling { shape, pm, mp });
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

#[inline]
fn add_force<const N: usize>(side: &mut [C; N], shape: &SVector<f32, N>, force: C) {
    let [shape] = &shape.data.0;
    for (value, &here) in side.iter_mut().zip(shape) {
        *value += force * here;
    }
}
