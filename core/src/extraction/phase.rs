//! The angle of the shaft between two marks, sample by sample, without trigonometry in between.

use core::f32::consts::TAU;

use nalgebra::Complex;

type C = Complex<f32>;

/// `e^{iθ}` with `θ(t) = 2π(τ + (r/2)·τ·(τ − 1))`, `τ = t/P`: a turn of P samples in which the speed rises by r of itself.
///
/// The vector is stepped as `v += v·(e^{iΔθ} − 1)` with the difference kept small and exact, so that rounding shows only
/// as the square root of the number of steps (1e-6 after 2,000).
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase {
    vector: C,
    step: C,
    /// Change of the step, `e^{iΔ²θ} − 1`.
    bend: C,
    period: f32,
    rise: f32,
}

impl Phase {
    /// Constant speed; `age` samples after the mark.
    pub fn steady(period: f32, age: f32) -> Self {
        Self::new(period, 0.0, age)
    }

    /// The turn after two turns of these lengths, the speed changing on as it did.
    pub fn following(before: f32, last: f32, age: f32) -> Self {
        let period = 2.0 * last - before;
        Self::new(period, (last - period) / last, age)
    }

    fn new(period: f32, rise: f32, age: f32) -> Self {
        let angle = |t: f32| {
            let turn = t / period;
            TAU * (turn + 0.5 * rise * turn * (turn - 1.0))
        };
        let first = angle(age);
        let step = TAU / period * (1.0 + 0.5 * rise * ((2.0 * age + 1.0) / period - 1.0));
        let bend = TAU * rise / (period * period);
        Self {
            vector: 1.0 + turned_less_one(first),
            step: turned_less_one(step),
            bend: turned_less_one(bend),
            period,
            rise,
        }
    }

    /// One sample on, and its vector; in plain numbers, as [`Sums::add`](super::sums::Sums::add).
    #[inline]
    pub fn advance(&mut self) -> C {
        let Self { vector, step, bend, .. } = self;
        let turned = [vector.re * step.re - vector.im * step.im, vector.re * step.im + vector.im * step.re];
        let bent = [step.re * bend.re - step.im * bend.im, step.re * bend.im + step.im * bend.re];
        *vector = C::new(vector.re + turned[0], vector.im + turned[1]);
        *step = C::new(step.re + (bend.re + bent[0]), step.im + (bend.im + bent[1]));
        *vector
    }

    #[inline]
    pub fn vector(&self) -> C {
        self.vector
    }

    /// What this phase lacks of a full turn when the turn has ended after `period` samples, rad.
    pub fn missing_angle(&self, period: f32) -> f32 {
        let turn = period / self.period;
        TAU * (1.0 - turn - 0.5 * self.rise * turn * (turn - 1.0))
    }
}

/// `e^{ix} − 1` by its power series, within 1e-7 of |x| for |x| ≤ 0.8 (a step at eight samples a turn).
pub(super) fn turned_less_one(x: f32) -> C {
    let square = x * x;
    let sine =
        x * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))));
    let rest = square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    C::new(-rest, sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_equals_sine_and_cosine() {
        for k in -80..=80 {
            let x = k as f32 / 100.0;
            let (sine, cosine) = f64::from(x).sin_cos();
            let found = turned_less_one(x);
            assert!((f64::from(found.im) - sine).abs() <= 1e-7 * f64::from(x).abs());
            assert!((f64::from(found.re) - (cosine - 1.0)).abs() <= 1e-7 * f64::from(x).abs());
        }
    }

    #[test]
    fn phase_stepping_follows_closed_form_of_accelerating_turn() {
        let (period, rise, age) = (1999.7_f32, 0.02_f32, 0.4_f32);
        let mut phase = Phase::new(period, rise, age);
        let mut worst = 0.0_f64;
        for n in 0..1999 {
            let turn = (f64::from(age) + f64::from(n)) / f64::from(period);
            let angle = core::f64::consts::TAU * (turn + 0.5 * f64::from(rise) * turn * (turn - 1.0));
            let (re, im) = (f64::from(phase.vector().re), f64::from(phase.vector().im));
            worst = worst.max((re - angle.cos()).hypot(im - angle.sin()));
            phase.advance();
        }
        assert!(worst < 2e-5, "{worst}");
        assert!(phase.missing_angle(period).abs() < 1e-6);
    }

    #[test]
    fn a_speed_that_changes_evenly_is_foreseen() {
        // θ(t) = ωt + ½at²: lengths of successive turns from the closed form
        let (omega, a) = (TAU as f64 / 200.0, 1e-7);
        let mark = |k: f64| (-omega + (omega * omega + 2.0 * a * core::f64::consts::TAU * k).sqrt()) / a;
        let turn = |k: f64| (mark(k + 1.0) - mark(k)) as f32;
        let phase = Phase::following(turn(0.0), turn(1.0), 0.0);
        // 200 samples, 6e-4 faster each turn: the third-order rest is (6e-4)² of a turn
        assert!(phase.missing_angle(turn(2.0)).abs() < 1e-5);
    }
}
