//! The equations of forward and backward whirl in the shaft's modes.

use core::array;

use heapless::Vec;

use super::{C, SupportAmplitudes};
use crate::model::{MAX_SUPPORTS, Model};
use crate::support::Block;

/// The shaft on its nominal springs, and what each support adds to its own: forces `ΔZ·(p, m)` at its shape.
pub(super) struct Equations<const SHAPES: usize> {
    /// `1 − W²/W_j²` of each mode.
    pub forward: [f32; SHAPES],
    /// `1 − W²/W_j² + 2iWη` of each mode.
    pub backward: [C; SHAPES],
    /// `[[pp, pm], [mp, mm]]`, less the nominal spring, N/m.
    pub supports: Vec<Block, MAX_SUPPORTS>,
}

impl<const SHAPES: usize> Equations<SHAPES> {
    /// Of the shaft, the supports being added where it stays: moved once, it would cost as much as a right-hand side.
    #[inline(always)]
    pub fn of_shaft<const PROBES: usize, const PLANES: usize>(
        model: &Model<SHAPES, PROBES, PLANES>,
        speed: f32,
    ) -> Self {
        let square = speed * speed;
        let lag = 2.0 * speed * model.internal_damping_s;
        let ([forward_s2], [backward_s2]) = (&model.shaft.forward_s2.data.0, &model.shaft.backward_s2.data.0);
        Self {
            forward: array::from_fn(|j| 1.0 - square * forward_s2[j]),
            backward: array::from_fn(|j| C::new(1.0 - square * backward_s2[j], lag)),
            supports: Vec::new(),
        }
    }

    #[inline(never)]
    pub fn add_supports<const PROBES: usize, const PLANES: usize>(
        &mut self,
        model: &Model<SHAPES, PROBES, PLANES>,
        speed: f32,
        SupportAmplitudes(amplitudes): &SupportAmplitudes,
    ) {
        let lag = 2.0 * speed * model.internal_damping_s;
        let mut springs = model.shaft.springs_n_m.iter();
        for (support, &amplitude) in model.supports.iter().zip(amplitudes) {
            let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
            let mut block = whirling(&support.dynamic_stiffness(knots, speed, amplitude));
            if let Some(&spring) = springs.next() {
                // The modes are damped whole; the spring is no part of the shaft.
                let [[pp, _], [_, mm]] = &mut block;
                pp.re -= spring;
                *mm -= C::new(spring, spring * lag);
            }
            // As many places as a model has supports.
            let _ = self.supports.push(block);
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
