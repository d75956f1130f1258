//! Levenberg–Marquardt on normal equations.
//!
//! With a thousand residuals for ten unknowns, the orthogonal factor that the usual implementations work
//! with takes most of the time of a fit. The normal equations lose half the digits, and residuals
//! weighted by a noise of a percent need few. The usual rules are: damping by the largest curvature seen,
//! shorter steps after one that was too long (both Moré 1978), damping updated by the gain ratio (Nielsen 1999).

use nalgebra::{DMatrix, DVector};

/// What is descended: a sum of squares over unknowns.
pub trait Objective {
    fn position(&self) -> DVector<f64>;
    fn move_to(&mut self, x: &DVector<f64>);
    /// The sum of squares there; infinite where there is none.
    fn value(&self) -> f64;
    /// `JᵀJ` and `Jᵀr`, with J the derivative of the residuals r.
    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)>;
}

#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Maximum number of steps.
    pub steps: usize,
    /// Change of the sum of squares, relative, that ends it.
    pub tolerance: f64,
    /// Change of the sum of squares, absolute, that ends it. If the residuals are in standard deviations, the foreseen change is an
    /// upper bound of the squared distance of each unknown from the optimum, in its own standard deviations.
    pub least_gain: f64,
    /// What the sum of squares has to come down to: the search ends where it will not.
    pub most: f64,
    /// Damping of the first step, of the largest curvature seen: less where the sum is nearly quadratic from the start on.
    pub damping: f64,
}

impl Stop {
    /// From anywhere.
    pub const fn after(steps: usize, tolerance: f64) -> Self {
        Self { steps, tolerance, least_gain: 0.0, most: f64::INFINITY, damping: FIRST_DAMPING }
    }

    /// The search ends where the distance of each unknown from the optimum is below 1.4 % of its standard deviation.
    pub const fn in_standard_deviations(self) -> Self {
        Self { least_gain: 2e-4, ..self }
    }

    /// The search ends where that distance is below 14 % of the standard deviation: near enough for what the optimum costs.
    pub const fn in_tenths_of_standard_deviations(self) -> Self {
        Self { least_gain: 2e-2, ..self }
    }

    /// For somebody who wants no sum of squares above this: a search that will not come below it ends early, at what it has.
    pub const fn below(self, most: f64) -> Self {
        Self { most, ..self }
    }

    /// From next to the optimum, where directions of little curvature are to be followed at once.
    pub const fn nearby(self) -> Self {
        Self { damping: NEARBY_DAMPING, ..self }
    }

    /// Gain that is not worth a step.
    fn negligible(&self, value: f64) -> f64 {
        self.least_gain.max(self.tolerance * value)
    }
}

const FIRST_DAMPING: f64 = 1e-3;
const NEARBY_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
/// Largest gain of a search, as a multiple of the gain that its normal equations foresee for the whole step: in a curved valley they foresee
/// only a part of it.
const FURTHEST: f64 = 10.0;
const MOST_DAMPING: f64 = 1e12;
/// Growth of the damping until a step is short enough.
const GROWTH: f64 = 2.0;
/// Share of a step that was too long to try next, at least and at most.
const LEAST_SHORTENING: f64 = 0.1;
const MOST_SHORTENING: f64 = 0.5;
/// A step that lowers the sum by less than this share of what was foreseen is taken back.
const WORTH_TAKING: f64 = 1e-4;

/// Longest step along an unknown: search coordinates are logarithms or in units of their own size, and
/// where nothing is known of one the equations send it anywhere.
const LONGEST: f64 = 3.0;

/// Goes downhill; ends at the lowest place seen.
pub fn descend(objective: &mut (impl Objective + ?Sized), stop: Stop) {
    let mut value = objective.value();
    let mut damping = stop.damping;
    let mut curvature: DVector<f64> = DVector::zeros(objective.position().len());
    for _ in 0..stop.steps {
        if !value.is_finite() {
            return;
        }
        let Some((gram, slope)) = objective.normal_equations() else { return };
        curvature.zip_apply(&gram.diagonal(), |most, now| *most = most.max(now));
        if value > stop.most && !can_gain(value - stop.most, (&gram, &slope), &curvature) {
            return;
        }
        let from = objective.position();
        let taken = step(objective, &from, value, (&gram, &slope), &curvature, &mut damping, &stop);
        if !taken {
            return;
        }
        let before = std::mem::replace(&mut value, objective.value());
        if before - value <= stop.negligible(before) {
            return;
        }
    }
}

/// Whether a search that sees these equations can gain so much.
fn can_gain(gain: f64, (gram, slope): (&DMatrix<f64>, &DVector<f64>), curvature: &DVector<f64>) -> bool {
    damped(gram, curvature, NEARBY_DAMPING)
        .cholesky()
        .is_none_or(|factor| FURTHEST * slope.dot(&factor.solve(slope)) >= gain)
}

fn damped(gram: &DMatrix<f64>, curvature: &DVector<f64>, damping: f64) -> DMatrix<f64> {
    let mut damped = gram.clone();
    for (i, c) in curvature.iter().enumerate() {
        // an unknown that nothing depends on stays
        damped[(i, i)] += damping * c + if *c == 0.0 { 1.0 } else { 0.0 };
    }
    damped
}

/// Tries shorter and shorter steps until one is worth taking; `false`, and back where it was, if none is
/// or the best of them would gain nothing.
fn step<L: Objective + ?Sized>(
    objective: &mut L,
    from: &DVector<f64>,
    value: f64,
    (gram, slope): (&DMatrix<f64>, &DVector<f64>),
    curvature: &DVector<f64>,
    damping: &mut f64,
    stop: &Stop,
) -> bool {
    let (mut longest, mut moved) = (f64::INFINITY, false);
    while *damping < MOST_DAMPING {
        if let Some(factor) = damped(gram, curvature, *damping).cholesky() {
            let wanted = -factor.solve(slope);
            let step = wanted.map(|s| s.clamp(-LONGEST, LONGEST));
            let length = length(&step, curvature);
            // damping that hardly shortens a step is not worth an evaluation
            if length <= longest {
                let along = slope.dot(&step);
                let foreseen = -(2.0 * along + step.dot(&(gram * &step)));
                if foreseen <= stop.negligible(value) && step == wanted {
                    break;
                }
                objective.move_to(&(from + step));
                moved = true;
                let change = objective.value() - value;
                let gain = -change / foreseen;
                if foreseen > 0.0 && gain > WORTH_TAKING {
                    let factor = (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 2.0);
                    *damping = (*damping * factor).max(LEAST_DAMPING);
                    return true;
                }
                longest = length * shortening(along, change);
            }
        }
        *damping *= GROWTH;
    }
    if moved {
        objective.move_to(from);
    }
    false
}

/// Length of a step in units of what each unknown changes the residuals by.
fn length(step: &DVector<f64>, curvature: &DVector<f64>) -> f64 {
    step.iter().zip(curvature).map(|(s, c)| c * s * s).sum::<f64>().sqrt()
}

/// Share of a step that was too long to try next: where the parabola through the value and the slope at its beginning and the value at
/// its end is lowest (Moré 1978). `along` is half the slope along the step, `change` that of the value.
fn shortening(along: f64, change: f64) -> f64 {
    let lowest = -along / (change - 2.0 * along);
    // where there is no value there is no parabola
    if lowest.is_finite() { lowest.clamp(LEAST_SHORTENING, MOST_SHORTENING) } else { LEAST_SHORTENING }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as a sum of squares.
    struct Valley(DVector<f64>);

    impl Objective for Valley {
        fn position(&self) -> DVector<f64> {
            self.0.clone()
        }

        fn move_to(&mut self, x: &DVector<f64>) {
            self.0 = x.clone();
        }

        fn value(&self) -> f64 {
            100.0 * (self.0[1] - self.0[0].powi(2)).powi(2) + (1.0 - self.0[0]).powi(2)
        }

        fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
            let x = &self.0;
            let j = DMatrix::from_row_slice(2, 3, &[-20.0 * x[0], 10.0, 0.0, -1.0, 0.0, 0.0]);
            let r = DVector::from_vec(vec![10.0 * (x[1] - x[0].powi(2)), 1.0 - x[0]]);
            Some((j.tr_mul(&j), j.tr_mul(&r)))
        }
    }

    #[test]
    fn descent_follows_curved_valley_and_keeps_idle_unknown() {
        let mut valley = Valley(DVector::from_vec(vec![-1.2, 1.0, 7.0]));
        descend(&mut valley, Stop::after(60, 1e-14));
        assert!((valley.0 - DVector::from_vec(vec![1.0, 1.0, 7.0])).amax() < 1e-6);
    }

    #[test]
    fn search_that_will_not_come_low_enough_ends_early() {
        /// A parabola with its lowest point ten above zero, and how often it was looked at.
        struct Parabola(DVector<f64>, usize);

        impl Objective for Parabola {
            fn position(&self) -> DVector<f64> {
                self.0.clone()
            }

            fn move_to(&mut self, x: &DVector<f64>) {
                (self.0, self.1) = (x.clone(), self.1 + 1);
            }

            fn value(&self) -> f64 {
                self.0.norm_squared() + 10.0
            }

            fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
                Some((DMatrix::identity(1, 1), self.0.clone()))
            }
        }

        // from one it foresees a gain of one: at eleven, ten times that lead to one
        for (most, looks) in [(0.9, 0), (1.1, 1)] {
            let mut parabola = Parabola(DVector::from_element(1, 1.0), 0);
            descend(&mut parabola, Stop::after(1, 0.0).below(most));
            assert_eq!(parabola.1, looks, "{most}");
        }
        // a curved valley is followed to its end
        let mut valley = Valley(DVector::from_vec(vec![-1.2, 1.0, 7.0]));
        descend(&mut valley, Stop::after(60, 1e-14).below(0.1));
        assert!(valley.value() < 1e-12, "{}", valley.value());
    }

    #[test]
    fn step_too_long_is_cut_to_lowest_point_of_parabola() {
        // 4t² − 2t is lowest at a quarter and 2 at one
        assert_eq!(shortening(-1.0, 2.0), 0.25);
        // never to less than a tenth, and to that where there is no value
        assert_eq!(shortening(-1.0, 1e6), LEAST_SHORTENING);
        assert_eq!(shortening(-1.0, f64::INFINITY), LEAST_SHORTENING);
    }

    #[test]
    fn it_ends_at_the_lowest_place_seen() {
        let mut valley = Valley(DVector::from_vec(vec![-1.2, 1.0, 0.0]));
        let start = valley.value();
        for _ in 0..5 {
            let before = valley.value();
            descend(&mut valley, Stop::after(1, 0.0));
            assert!(valley.value() <= before);
        }
        assert!(valley.value() < 0.5 * start);
    }
}
