//! Forces into motion: the quick way where it can be trusted, elimination elsewhere.

use super::coupled::{self, Correction};
use super::equations::Equations;
use super::motion::Motion;
use super::{ResponseError, SupportAmplitudes};
use crate::model::Model;

/// Growth of numbers beyond which the factors without pivoting are not trusted: the factors' error is this many times
/// that of rounding the matrix.
const LARGEST_GROWTH: f32 = 16.0;

impl<const N: usize, const PLANES: usize> Motion<N, PLANES> {
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
