//! Amplitudes at hardening supports, brought to rest.

use crate::response::SupportAmplitudes;
use crate::scalar;

/// The way of the first step, and limits of what the steps before let expect: a smaller one creeps, a larger one overshoots.
const FIRST: f32 = 1.0;
const SMALLEST: f32 = 0.1;
const LARGEST: f32 = 2.0;

/// `a ← a + ω (G(a) − a)` with the ω that would have brought the step before to rest (Aitken's process for vectors, Irons
/// and Tuck 1969): `ω ← −ω r₀·(r − r₀)/‖r − r₀‖²` for the residuals `r = G(a) − a` of this step and the one before.
pub(super) struct Rounds {
    pub amplitudes: SupportAmplitudes,
    pub count: u8,
    before: Option<SupportAmplitudes>,
    relaxation: f32,
}

impl Rounds {
    pub fn new(amplitudes: SupportAmplitudes) -> Self {
        Self { amplitudes, count: 0, before: None, relaxation: FIRST }
    }

    /// A step towards `aim`, what the present amplitudes lead to; `false` if they differ by no more than `tolerance` of
    /// the largest.
    pub fn advance(&mut self, aim: &SupportAmplitudes, tolerance: f32) -> bool {
        let mut residual = SupportAmplitudes::default();
        let (mut farthest, mut largest) = (0.0_f32, f32::MIN_POSITIVE);
        let present = self.amplitudes.0.as_flattened().iter().zip(aim.0.as_flattened());
        for (residual, (present, aim)) in residual.0.as_flattened_mut().iter_mut().zip(present) {
            *residual = aim - present;
            farthest = scalar::greater(farthest, residual.abs());
            largest = scalar::greater(largest, aim.abs());
        }
        if farthest <= tolerance * largest {
            return false;
        }
        if let Some(before) = &self.before {
            let (mut product, mut square) = (0.0, 0.0);
            for (now, before) in residual.0.as_flattened().iter().zip(before.0.as_flattened()) {
                product += before * (now - before);
                square += (now - before) * (now - before);
            }
            let relaxation = -self.relaxation * product / square;
            self.relaxation =
                if relaxation.is_finite() { relaxation.clamp(SMALLEST, LARGEST) } else { FIRST };
        }
        for (amplitude, residual) in
            self.amplitudes.0.as_flattened_mut().iter_mut().zip(residual.0.as_flattened())
        {
            *amplitude = scalar::greater(0.0, *amplitude + self.relaxation * residual);
        }
        self.before = Some(residual);
        self.count += 1;
        true
    }
}
