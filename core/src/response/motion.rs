//! Forward and backward whirl of the shaft for each right-hand side.

use super::C;
use crate::model::{ForcingLaw, Model};

/// Coordinates of the modes of forward and backward whirl.
#[derive(Clone, Copy)]
pub(crate) struct Whirl<const N: usize> {
    pub plus: [C; N],
    pub minus: [C; N],
}

impl<const N: usize> Whirl<N> {
    pub const ZERO: Self = Self { plus: [C::new(0.0, 0.0); N], minus: [C::new(0.0, 0.0); N] };
}

/// Motion for a unit of unbalance (1 g·mm) in each plane, and for the forcings if there are any.
pub(crate) struct Motion<const N: usize, const PLANES: usize> {
    pub(super) planes: [Whirl<N>; PLANES],
    pub(super) forced: Option<Whirl<N>>,
}

impl<const N: usize, const PLANES: usize> Motion<N, PLANES> {
    /// The forces in the place of the motion: `Fp`, while `Fm` is zero.
    #[inline(never)]
    pub fn forces<const PROBES: usize>(model: &Model<N, PROBES, PLANES>, speed: f32) -> Self {
        let square = speed * speed;
        // One variable, written where it stays: copies are dear without a cache.
        let mut motion = Self { planes: [Whirl::ZERO; PLANES], forced: None };
        for (whirl, shape) in motion.planes.iter_mut().zip(&model.planes) {
            for (value, &here) in whirl.plus.iter_mut().zip(&shape.data.0[0]) {
                value.re = here * square;
            }
        }
        for forcing in &model.forcings {
            let [re, im] = forcing.amplitude;
            let law = match forcing.law {
                ForcingLaw::Constant => 1.0,
                ForcingLaw::SpeedSquared => square,
            };
            let force = C::new(re, im) * law;
            let whirl = motion.forced.get_or_insert(Whirl::ZERO);
            for (value, &here) in whirl.plus.iter_mut().zip(&forcing.shape.data.0[0]) {
                *value += force * here;
            }
        }
        motion
    }
}
