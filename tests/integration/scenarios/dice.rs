//! Random numbers of a seed.

use std::f64::consts::TAU;

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The same seed gives the same numbers on every machine.
pub struct Dice(Xoshiro256PlusPlus);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// A seed for an independent stream.
    pub fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        let uniform = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        least + (most - least) * uniform
    }

    /// Uniform in the logarithm.
    pub fn factor(&mut self, least: f64, most: f64) -> f64 {
        self.between(least.ln(), most.ln()).exp()
    }

    /// A whole number from `least` to `most`, both included.
    pub fn whole(&mut self, least: usize, most: usize) -> usize {
        least + (self.0.next_u64() % (most - least + 1) as u64) as usize
    }

    pub fn pick<T: Copy>(&mut self, among: &[T]) -> T {
        among[self.whole(0, among.len() - 1)]
    }

    pub fn happens(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    pub fn sign(&mut self) -> f64 {
        if self.happens(0.5) { 1.0 } else { -1.0 }
    }

    /// Any direction, rad.
    pub fn angle(&mut self) -> f64 {
        self.between(0.0, TAU)
    }

    /// Standard normal in both parts (Box and Muller).
    pub fn normals(&mut self) -> Complex<f64> {
        let radius = (-2.0 * self.between(1e-300, 1.0).ln()).sqrt();
        Complex::from_polar(radius, self.angle())
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        self.normals().re
    }
}
