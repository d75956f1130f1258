//! The particle swarm of phase I.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::particleswarm::ParticleSwarm;
use rand::SeedableRng;
use rand::rngs::StdRng;

use super::range::Range;
use crate::error::Error;
use crate::fit::trial::FreeProblem;

#[derive(Debug, Clone, Copy)]
pub struct Swarm {
    pub particles: usize,
    pub iterations: u64,
    pub seed: u64,
}

struct Cost<'a, 'p>(&'a FreeProblem<'p>);

impl CostFunction for Cost<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, logs: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.0.summed_residual_um(logs).unwrap_or(f64::MAX))
    }
}

/// The least summed residual that a swarm finds inside the range: logarithms of the coefficients, and
/// the residual, µm.
///
/// # Errors
/// If the machine is singular at every particle.
pub fn search(trial: &FreeProblem, range: &Range, swarm: Swarm) -> Result<(Vec<f64>, f64), Error> {
    let solver = ParticleSwarm::new((range.low.clone(), range.high.clone()), swarm.particles)
        .with_rng_generator(StdRng::seed_from_u64(swarm.seed));
    let result = Executor::new(Cost(trial), solver)
        .configure(|state| state.max_iters(swarm.iterations))
        .ctrlc(false)
        .run()
        .map_err(|e| Error::Unsuitable(format!("phase I: {e}")))?;
    let best = result.state.get_best_param().filter(|best| best.cost < f64::MAX);
    let best = best.ok_or(Error::SingularMachine { tried: "on every trial bearing" })?;
    Ok((best.position.clone(), best.cost))
}
