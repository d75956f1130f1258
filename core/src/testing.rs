//! What several unit tests need: random numbers independent of the swarm's, and problems made of them.

use nalgebra::{ArrayStorage, SMatrix};

use crate::fit::Fit;

/// A small linear congruential generator (Knuth's MMIX constants).
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Uniform in −1..1.
    pub fn signed(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

/// Influence of two planes on four probes that resemble each other by `likeness` (0 to 1), and a target that an
/// unbalance of about 1 explains up to noise; bounds are `bound` times the true unbalance.
pub(crate) fn random_fit(random: &mut Random, likeness: f32, bound: f32) -> Fit {
    let mut columns = [[0.0; 8]; 4];
    for probe in 0..4 {
        let mut pair = || [random.signed(), random.signed()];
        let [re1, im1] = pair();
        let [re2, im2] = pair();
        let mix = |a: f32, b: f32| 0.3 * (likeness * a + (1.0 - likeness) * b);
        for (plane, [re, im]) in [[re1, im1], [mix(re1, re2), mix(im1, im2)]].into_iter().enumerate() {
            columns[2 * plane][2 * probe] = re;
            columns[2 * plane][2 * probe + 1] = -im;
            columns[2 * plane + 1][2 * probe] = -im;
            columns[2 * plane + 1][2 * probe + 1] = -re;
        }
    }
    let truth = [[random.signed(), random.signed()], [random.signed(), random.signed()]];
    let mut fit = Fit {
        influence: SMatrix::from_data(ArrayStorage(columns)),
        target_um: [0.0; 8],
        bound_g_mm: truth.map(|[x, y]: [f32; 2]| bound * x.hypot(y)),
    };
    fit.target_um = fit.residuals_um(&truth).map(|feature| feature + 0.2 * random.signed());
    fit
}
