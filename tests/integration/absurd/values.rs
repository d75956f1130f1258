//! Numbers that no machine has.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What is no number, or larger than anything on earth in any unit of a file.
pub const NOWHERE: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300];

/// Random numbers with a fixed seed.
pub struct Dice(Xoshiro256PlusPlus);

impl Dice {
    pub fn new() -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(17))
    }

    /// From 0 to just below `many`.
    pub fn below(&mut self, many: usize) -> usize {
        (self.0.next_u64() % many as u64) as usize
    }

    /// Of either sign, of a size from 10^`least` to 10^`most`.
    pub fn huge(&mut self, least: f64, most: f64) -> f64 {
        let share = self.0.next_u64() as f64 / u64::MAX as f64;
        let size = 10_f64.powf(least + (most - least) * share);
        if self.below(2) == 0 { size } else { -size }
    }
}
