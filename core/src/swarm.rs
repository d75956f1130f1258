//! A particle swarm in Cartesian unbalance: no trigonometry in the loop, so bounds on |U| are discs.
//!
//! It searches where the certificate of [`polish`](crate::polish) fails; the problem is convex, the swarm's answer only
//! roughly its minimum, and the polish finishes it.

use core::array;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro128PlusPlus;

use crate::fit::BoundedFit;
use crate::model::Pair;
use crate::scalar;

pub const DEFAULT_PARTICLES: usize = 16;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwarmConfig {
    /// Moves of the whole swarm.
    pub iterations: u16,
    /// Share of its velocity a particle keeps.
    pub inertia: f32,
    /// Pull towards the best place the particle itself has seen.
    pub cognitive: f32,
    /// Pull towards the best place any particle has seen.
    pub social: f32,
}

impl Default for SwarmConfig {
    fn default() -> Self {
        Self { iterations: 20, inertia: 0.6, cognitive: 1.4, social: 1.6 }
    }
}

#[derive(Clone, Copy)]
struct Particle<const PLANES: usize> {
    place: [Pair; PLANES],
    velocity: [Pair; PLANES],
    best: [Pair; PLANES],
    best_um: f32,
}

/// The best unbalance (g·mm, within the bounds) a swarm of `PARTICLES` finds; one of them starts at `start`.
///
/// Equal arguments give equal bits.
#[inline(never)]
pub fn search<const PARTICLES: usize, const PROBES: usize, const PLANES: usize>(
    config: &SwarmConfig,
    fit: &BoundedFit<PROBES, PLANES>,
    start: [Pair; PLANES],
    seed: u64,
) -> [Pair; PLANES] {
    let mut random = Xoshiro128PlusPlus::seed_from_u64(seed);
    let mut best = fit.confine(start);
    let mut best_um = fit.residual_um(&best);
    let mut swarm: [Particle<PLANES>; PARTICLES] = array::from_fn(|number| {
        let place = if number == 0 { best } else { random_place(fit, &mut random) };
        Particle { place, velocity: [[0.0; 2]; PLANES], best: place, best_um: f32::INFINITY }
    });
    for _ in 0..=config.iterations {
        for particle in &mut swarm {
            let value_um = fit.residual_um(&particle.place);
            if value_um < particle.best_um {
                particle.best_um = value_um;
                particle.best = particle.place;
            }
            if value_um < best_um {
                best_um = value_um;
                best = particle.place;
            }
            advance(config, fit, particle, &best, &mut random);
        }
    }
    best
}

#[inline]
fn random_place<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    random: &mut Xoshiro128PlusPlus,
) -> [Pair; PLANES] {
    let mut place = [[0.0; 2]; PLANES];
    for (pair, bound) in place.iter_mut().zip(fit.bound_g_mm()) {
        let [radial, angular] = two_fractions(random);
        *pair = scalar::rough_disc_point(radial, angular).map(|x| x * bound);
    }
    fit.confine(place)
}

#[inline]
fn advance<const PROBES: usize, const PLANES: usize>(
    config: &SwarmConfig,
    fit: &BoundedFit<PROBES, PLANES>,
    particle: &mut Particle<PLANES>,
    best: &[Pair; PLANES],
    random: &mut Xoshiro128PlusPlus,
) {
    let moved = particle.place.as_flattened_mut().iter_mut().zip(particle.velocity.as_flattened_mut());
    let goals = particle.best.as_flattened().iter().zip(best.as_flattened());
    for ((place, velocity), (own, swarm)) in moved.zip(goals).take(2 * fit.planes()) {
        let [a, b] = two_fractions(random);
        *velocity = config.inertia * *velocity
            + config.cognitive * a * (own - *place)
            + config.social * b * (swarm - *place);
        *place += *velocity;
    }
    particle.place = fit.confine(particle.place);
}

/// Two numbers in 0..1 from one draw: sixteen bits each are plenty here.
#[inline]
fn two_fractions(random: &mut Xoshiro128PlusPlus) -> [f32; 2] {
    let bits = random.next_u32();
    [bits >> 16, bits & 0xffff].map(|half| half as f32 * (1.0 / 65536.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, random_fit};

    #[test]
    fn equal_seeds_give_equal_bits_and_other_seeds_other_paths() {
        let fit = random_fit(&mut Random::new(5), 0.5, 1.0);
        let run =
            |seed| search::<DEFAULT_PARTICLES, _, _>(&SwarmConfig::default(), &fit, [[0.0; 2]; 2], seed);
        assert_eq!(run(1).map(|u| u.map(f32::to_bits)), run(1).map(|u| u.map(f32::to_bits)));
        assert_ne!(run(1), run(2));
    }

    #[test]
    fn particles_stay_within_bounds_and_never_worsen_the_start() {
        let mut random = Random::new(6);
        for seed in 0..100 {
            let fit = random_fit(&mut random, 0.5, 0.5);
            let start = fit.confine([[random.signed(), random.signed()], [random.signed(), random.signed()]]);
            let found = search::<DEFAULT_PARTICLES, _, _>(&SwarmConfig::default(), &fit, start, seed);
            for ([x, y], bound) in found.into_iter().zip(fit.bound_g_mm()) {
                assert!(x.hypot(y) <= bound * (1.0 + 1e-6));
            }
            assert!(fit.residual_um(&found) <= fit.residual_um(&start));
        }
    }

    #[test]
    fn an_empty_swarm_returns_its_start_within_the_bounds() {
        let fit = random_fit(&mut Random::new(7), 0.5, 0.5);
        assert_eq!(
            search::<0, _, _>(&SwarmConfig::default(), &fit, [[1e9, 0.0], [0.0; 2]], 1)[0],
            [fit.bound_g_mm()[0], 0.0]
        );
    }
}
