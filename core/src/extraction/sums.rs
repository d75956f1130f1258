//! The sums of a least-squares fit `x = mean + Re(Y e^{iθ})`, and the weights of a window's first and last samples.

use nalgebra::Complex;

use super::{HarmonicFit, PROBES};

type C = Complex<f32>;

/// One sample of all probes and the vector `e^{iθ}` of its moment.
#[derive(Debug, Clone, Copy, Default)]
struct Moment {
    values: [f32; PROBES],
    vector: C,
}

/// Weighted sums over samples, `v = e^{iθ}`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    weight: f32,
    vectors: C,
    squares: C,
    values: [f32; PROBES],
    /// Σ x v̄
    products: [C; PROBES],
    /// The two samples before the next.
    last: [Moment; 2],
    /// Weights of the next two samples less one; zero but at a window's beginning.
    coming: [f32; 2],
}

/// Weights (less one) of the two samples nearest to a window's edge, the nearer first, for an edge `distance` samples beyond
/// it: trapezoidal rule, the piece up to the edge extrapolated in a straight line, and the first term of Euler and
/// Maclaurin for the rule's end.
fn edge_weights(distance: f32) -> [f32; 2] {
    let square = 0.5 * distance * distance;
    [distance + square - 0.5 - 1.0 / 12.0, 1.0 / 12.0 - square]
}

impl Sums {
    /// Of a window whose first sample comes `age` after its edge.
    pub fn beginning(age: f32) -> Self {
        Self { coming: edge_weights(age), ..Self::default() }
    }

    /// Of the next turn in the same window: empty, but it knows the last samples.
    pub fn next(&self) -> Self {
        Self { last: self.last, coming: self.coming, ..Self::default() }
    }

    #[inline]
    pub fn add(&mut self, values: [f32; PROBES], vector: C) {
        let moment = Moment { values, vector };
        let [first, second] = self.coming;
        self.add_weighted(&moment, 1.0 + first);
        self.coming = [second, 0.0];
        let [_, last] = self.last;
        self.last = [last, moment];
    }

    /// Ends the window `distance` samples after the last sample.
    pub fn end(&mut self, distance: f32) {
        let [second, nearest] = self.last;
        let [of_nearest, of_second] = edge_weights(distance);
        self.add_weighted(&nearest, of_nearest);
        self.add_weighted(&second, of_second);
    }

    #[inline]
    fn add_weighted(&mut self, moment: &Moment, weight: f32) {
        let Moment { values, vector } = moment;
        let weighted = vector * weight;
        self.weight += weight;
        self.vectors += weighted;
        self.squares += weighted * vector;
        let turned = weighted.conj();
        let sums = self.values.iter_mut().zip(&mut self.products);
        for ((sum, product), &value) in sums.zip(values) {
            *sum += weight * value;
            *product += turned * value;
        }
    }

    /// Adds sums whose phase lagged by `angle` in the mean (rad, small).
    pub fn add_turned(&mut self, turn: &Self, angle: f32) {
        let by = 1.0 + super::phase::turned_less_one(angle);
        let back = by.conj();
        self.weight += turn.weight;
        self.vectors += turn.vectors * by;
        self.squares += turn.squares * by * by;
        for (sum, value) in self.values.iter_mut().zip(&turn.values) {
            *sum += value;
        }
        for (sum, product) in self.products.iter_mut().zip(&turn.products) {
            *sum += product * back;
        }
    }

    /// Solves, for each probe, with A = Σv/W and B = Σv²/W of the weight W:
    /// `Σx/W = mean + Re(Y A)`, `2 Σx v̄/W = 2 mean Ā + Y + B̄ Ȳ`.
    pub fn fits(&self) -> [HarmonicFit; PROBES] {
        let (a, b) = (self.vectors / self.weight, self.squares / self.weight);
        // with mean = X − Re(Y A): M Y-parts = right, the mean taken out
        let direct = 1.0 - a.norm_sqr();
        let mirrored = b.conj() - a.conj() * a.conj();
        let determinant = direct * direct - mirrored.norm_sqr();
        let solve = |value: f32, product: C| {
            let mean = value / self.weight;
            let right = product * (2.0 / self.weight) - a.conj() * (2.0 * mean);
            let phasor = (right * direct - mirrored * right.conj()) / determinant;
            HarmonicFit { mean: mean - (phasor * a).re, phasor }
        };
        let mut fits = [HarmonicFit { mean: 0.0, phasor: C::new(0.0, 0.0) }; PROBES];
        for (fit, (value, product)) in fits.iter_mut().zip(self.values.iter().zip(&self.products)) {
            *fit = solve(*value, *product);
        }
        fits
    }
}
