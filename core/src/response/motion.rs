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
            let mut equations = Equations::zero();
            equations.assemble(model, speed, amplitudes);
            if !quickly {
                return coupled::eliminate(&equations, self).ok_or(ResponseError::Singular);
            }
            if equations.forward.factor(LARGEST_GROWTH).is_none()
                || equations.backward.factor(LARGEST_GROWTH).is_none()
            {
                continue;
            }
            let mut correction = Correction::new(&equations);
            if correction.couple(&equations).is_none() {
                continue;
            }
            for (whirl, _) in self.planes.iter_mut().zip(&model.planes) {
                correction.solve(&equations, whirl);
            }
            if let Some(whirl) = &mut self.forced {
                correction.solve(&equations, whirl);
            }
            break;
        }
        Ok(())
    }
}

impl<const N: usize> Equations<N> {
    // In place from here on: a copy of a matrix costs as much as a right-hand side.
    #[inline(always)]
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
        self.set_shaft(model, speed);
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

    #[inline]
    fn set_shaft<const PROBES: usize, const PLANES: usize>(
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

    #[inline(never)]
    fn add_support(&mut self, shape: &[f32; N], pp: C, mm: C) {
        for i in 0..N {
            let (forward, backward) = (pp * shape[i], mm * shape[i]);
            for j in 0..=i {
                self.forward.rows[i][j] += forward * shape[j];
                self.backward.rows[i][j] += backward * shape[j];
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
