//! Forward and backward whirl of the shaft for each right-hand side.

use core::array;

use heapless::Vec;

use super::coupled::{self, Correction, Coupling};
use super::{C, ResponseError, SupportAmplitudes};
use crate::linear::Symmetric;
use crate::model::{ForcingLaw, MAX_SUPPORTS, Model};
use crate::support::Block;

/// Growth of numbers beyond which the factors without pivoting are not trusted: the factors' error is this many times
/// that of rounding the matrix.
const LARGEST_GROWTH: f32 = 16.0;

/// Coordinates of the forward and the backward whirl.
#[derive(Clone, Copy)]
pub(crate) struct Whirl<const N: usize> {
    pub plus: [C; N],
    pub minus: [C; N],
}

impl<const N: usize> Whirl<N> {
    pub fn zero() -> Self {
        Self { plus: [C::default(); N], minus: [C::default(); N] }
    }
}

/// Motion for a unit of unbalance (1 g·mm) in each plane, and for the forcings if there are any.
pub(crate) struct Motion<const N: usize, const PLANES: usize> {
    pub(super) planes: [Whirl<N>; PLANES],
    pub(super) forced: Option<Whirl<N>>,
}

/// The two matrices and the couplings between them.
pub(super) struct Equations<const N: usize> {
    pub forward: Symmetric<N>,
    pub backward: Symmetric<N>,
    pub couplings: Vec<Coupling<N>, MAX_SUPPORTS>,
}

impl<const N: usize, const PLANES: usize> Motion<N, PLANES> {
    /// The forces in the place of the motion: `Fp`, while `Fm` is zero.
    #[inline(never)]
    pub fn forces<const PROBES: usize>(model: &Model<N, PROBES, PLANES>, speed: f32) -> Self {
        let square = speed * speed;
        let planes = array::from_fn(|plane| match model.planes.get(plane) {
            Some(shape) => Whirl { plus: shape.data.0[0].map(|x| C::new(x * square, 0.0)), ..Whirl::zero() },
            None => Whirl::zero(),
        });
        let mut forced = None;
        for forcing in &model.forcings {
            let [re, im] = forcing.amplitude;
            let law = match forcing.law {
                ForcingLaw::Constant => 1.0,
                ForcingLaw::SpeedSquared => square,
            };
            let force = C::new(re, im) * law;
            let whirl = forced.get_or_insert(Whirl::zero());
            for (value, &here) in whirl.plus.iter_mut().zip(&forcing.shape.data.0[0]) {
                *value += force * here;
            }
        }
        Self { planes, forced }
    }

    /// Turns forces into motion.
    ///
    /// Errors: [`ResponseError::Singular`].
    // Large, and called from several places: one copy in flash.
    #[inline(never)]
    pub fn solve<const PROBES: usize>(
        &mut self,
        model: &Model<N, PROBES, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Result<(), ResponseError> {
        for quickly in [true, false] {
            // The factors stand where the matrices stood: assembled anew for the second way.
            let mut equations = Equations::of_shaft(model, speed);
            equations.add_supports(model, speed, amplitudes);
            if !quickly {
                return coupled::eliminate(&equations, self).ok_or(ResponseError::Singular);
            }
            if equations.forward.factor(LARGEST_GROWTH).is_none()
                || equations.backward.factor(LARGEST_GROWTH).is_none()
            {
                continue;
            }
            let mut correction = Correction::new(&equations);
            if correction.couple().is_none() {
                continue;
            }
            for (whirl, _) in self.planes.iter_mut().zip(&model.planes) {
                correction.solve(whirl);
            }
            if let Some(whirl) = &mut self.forced {
                correction.solve(whirl);
            }
            break;
        }
        Ok(())
    }
}

impl<const N: usize> Equations<N> {
    /// Of the shaft alone; above the diagonal there is nothing. Written once: a matrix that is zeroed first costs as much as
    /// a right-hand side.
    #[inline(always)]
    fn of_shaft<const PROBES: usize, const PLANES: usize>(
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
    fn add_supports<const PROBES: usize, const PLANES: usize>(
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
