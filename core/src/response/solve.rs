//! Forces into motion: the quick way where it can be trusted, elimination elsewhere.

use super::correction::correct;
use super::elimination::eliminate;
use super::equations::Equations;
use super::motion::Motion;
use super::{ResponseError, SupportAmplitudes};
use crate::model::Model;

impl<const SHAPES: usize, const PLANES: usize> Motion<SHAPES, PLANES> {
    /// Turns forces into motion.
    ///
    /// Errors: [`ResponseError::Singular`].
    // Large, and called from several places: one copy in flash.
    #[inline(never)]
    pub fn solve<const PROBES: usize>(
        &mut self,
        model: &Model<SHAPES, PROBES, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Result<(), ResponseError> {
        let mut equations = Equations::of_shaft(model, speed);
        equations.add_supports(model, speed, amplitudes);
        correct(&equations, model, self)
            .or_else(|| eliminate(&equations, model, self))
            .ok_or(ResponseError::Singular)
    }
}
