//! The fixed point over amplitudes: a support that hardens, softens or rubs is taken at one amplitude and causes another.

/// Share of the way that an adaptive iteration goes, and what a step that overshoots leaves of it.
const HALF_WAY: f64 = 0.5;
const SHRINK: f64 = 0.7;

/// Relaxation of a fixed-point iteration; a softening support can otherwise hop between two branches.
pub(crate) struct Relaxation {
    /// Share of the way to the values caused.
    weight: f64,
    /// Whether the first step goes all the way, and steps shrink until the changes do: a contact is steep.
    is_adaptive: bool,
    last_change: Option<f64>,
}

impl Relaxation {
    pub(crate) fn adaptive() -> Self {
        Self { weight: HALF_WAY, is_adaptive: true, last_change: None }
    }

    /// The same share of the way in every step.
    pub(crate) fn steady(weight: f64) -> Self {
        Self { weight, is_adaptive: false, last_change: None }
    }

    /// Moves values towards those that they cause; returns the largest change relative to the largest value caused.
    pub(crate) fn step<'a>(
        &mut self,
        held: impl IntoIterator<Item = &'a mut f64>,
        caused: impl IntoIterator<Item = f64> + Clone,
    ) -> f64 {
        let largest = caused.clone().into_iter().map(f64::abs).fold(f64::MIN_POSITIVE, f64::max);
        let weight = if self.is_adaptive && self.last_change.is_none() { 1.0 } else { self.weight };
        let mut change = 0.0_f64;
        for (held, caused) in held.into_iter().zip(caused) {
            // all the way exactly, not by a difference that rounds
            let next = if weight == 1.0 { caused } else { *held + weight * (caused - *held) };
            change = change.max((next - *held).abs() / largest);
            *held = next;
        }
        if self.is_adaptive && self.last_change.is_some_and(|last| change > last) {
            self.weight *= SHRINK;
        }
        self.last_change = Some(change);
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fixed point of `x = f(x)` from zero, and the steps that it took.
    fn found(mut relaxation: Relaxation, f: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut x = 0.0;
        let steps = (0..300).find(|_| {
            let caused = f(x);
            relaxation.step([&mut x], [caused]) < 1e-12
        });
        (x, steps.unwrap_or(300))
    }

    #[test]
    fn adaptive_relaxation_ends_where_plain_iteration_cycles() {
        // a slope of −4 at the fixed point 1
        let steep = |x: f64| 5.0 - 4.0 * x;
        let (x, steps) = found(Relaxation::adaptive(), steep);
        assert!((x - 1.0).abs() < 1e-10 && steps < 150, "{x} after {steps}");
        assert_eq!(found(Relaxation::steady(1.0), steep).1, 300);
    }

    #[test]
    fn full_steps_reach_a_constant_in_two() {
        assert_eq!(found(Relaxation::steady(1.0), |_| 3.0), (3.0, 1));
    }
}
