//! Forward and backward whirl of the shaft for each right-hand side.

use core::array;

use super::C;
use crate::model::{ForcingLaw, Model};

/// Coordinates of the modes of forward and backward whirl.
#[derive(Clone, Copy)]
pub(crate) struct Whirl<const SHAPES: usize> {
    pub plus: [C; SHAPES],
    pub minus: [C; SHAPES],
}

impl<const SHAPES: usize> Whirl<SHAPES> {
    pub fn zero() -> Self {
        Self { plus: [C::default(); SHAPES], minus: [C::default(); SHAPES] }
    }
}

/// Motion for a unit of unbalance (1 g·mm) in each plane, and for the forcings if there are any.
pub(crate) struct Motion<const SHAPES: usize, const PLANES: usize> {
    pub(super) planes: [Whirl<SHAPES>; PLANES],
    pub(super) forced: Option<Whirl<SHAPES>>,
}

impl<const SHAPES: usize, const PLANES: usize> Motion<SHAPES, PLANES> {
    /// The forces in the place of the motion: `Fp`, while `Fm` is zero.
    #[inline(never)]
    pub fn forces<const PROBES: usize>(model: &Model<SHAPES, PROBES, PLANES>, speed: f32) -> Self {
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
}
