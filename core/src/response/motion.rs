//! Forward and backward whirl of the shaft for each right-hand side.

use heapless::Vec;
use nalgebra::SVector;

use super::coupled::{self, Correction, Coupling};
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

/// The two matrices and the couplings between them.
pub(super) struct Equations<const N: usize> {
    pub forward: Symmetric<N>,
    pub backward: Symmetric<N>,
    pub couplings: Vec<Coupling<N>, MAX_SUPPORTS>,
}

impl<const N: usize, const PLANES: usize> Motion<N, PLANES> {
    /// The forces in the place of the motion: `Fp`, while `Fm` is zero.
    #[inline]
    pub fn forces<const PROBES: usize>(model: &Model<N, PROBES, PLANES>, speed: f32) -> Self {
        let square = speed * speed;
        let mut forces = Self { planes: [Whirl::zero(); PLANES], forced: Whirl::zero() };
        for (side, plane) in forces.planes.iter_mut().zip(&model.planes) {
            add_force(side, plane, C::new(square, 0.0));
        }
        for forcing in &model.forcings {
            let [re, im] = forcing.amplitude;
            let law = match forcing.law {
                ForcingLaw::Constant => 1.0,
                ForcingLaw::SpeedSquared => square,
            };
            add_force(&mut forces.forced, &forcing.shape, C::new(re, im) * law);
        }
        forces
    }

    /// Turns forces into motion; `None` if the equations are singular.
    #[inline]
    pub fn solve<const PROBES: usize>(
        &mut self,
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Option<()> {
        let mut equations = Equations::zero();
        equations.assemble(model, speed, amplitudes);
        if equations.forward.factor(LARGEST_GROWTH).is_some()
            && equations.backward.factor(LARGEST_GROWTH).is_some()
            && let Some(correction) = Correction::new(&equations)
        {
            for (whirl, _) in self.planes.iter_mut().zip(&model.planes) {
                correction.solve(&equations, whirl);
            }
            if !model.forcings.is_empty() {
                correction.solve(&equations, &mut self.forced);
            }
            return Some(());
        }
        // The factors stand where the matrices stood.
        equations = Equations::zero();
        equations.assemble(model, speed, amplitudes);
        coupled::eliminate(&equations, self)
    }
}

impl<const N: usize> Equations<N> {
    #[inline]
    fn zero() -> Self {
        Self { forward: Symmetric::zero(), backward: Symmetric::zero(), couplings: Vec::new() }
    }

    #[inline(never)]
    fn assemble<const PROBES: usize, const PLANES: usize>(
        &mut self,
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        SupportAmplitudes(amplitudes): &SupportAmplitudes,
    ) {
        self.add_shaft(model, speed);
        for (support, &amplitude) in model.supports.iter().zip(amplitudes) {
            let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
            let [[pp, pm], [mp, mm]] = whirling(&support.dynamic_stiffness(knots, speed, amplitude));
            let [shape] = &support.shape.data.0;
            self.forward.add_outer(shape, pp);
            self.backward.add_outer(shape, mm);
            if pm != C::default() || mp != C::default() {
                // As many places as a model has supports.
                let _ = self.couplings.push(Coupling { shape: *shape, pm, mp });
            }
        }
    }

    #[inline]
    fn add_shaft<const PROBES: usize, const PLANES: usize>(
        &mut self,
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
    ) {
        let square = speed * speed;
        let lag = 2.0 * speed * model.internal_damping_s;
        for i in 0..N {
            for j in 0..=i {
                // The matrices are symmetric: nalgebra's columns will do for rows.
                let k = model.stiffness.data.0[i][j];
                let inertia = k - square * model.mass.data.0[i][j];
                let gyroscopic = square * model.polar_inertia.data.0[i][j];
                self.forward.rows[i][j].re = inertia + gyroscopic;
                self.backward.rows[i][j] = C::new(inertia - gyroscopic, lag * k);
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

#[inline]
fn add_force<const N: usize>(side: &mut Whirl<N>, shape: &SVector<f32, N>, force: C) {
    let [shape] = &shape.data.0;
    for (value, &here) in side.plus.iter_mut().zip(shape) {
        *value += force * here;
    }
}
