//! Identification in two phases (Bera et al., Machines 2023, 11, 976): phase I finds the bearings and
//! the unbalance of the first days, phase II follows the unbalance with the bearings held.
//!
//! Phase I searches with the engine of `fit`; phase II is a convex programme of its own.

mod certainty;
mod phase_one;
mod phase_two;
mod range;
mod swarm;
#[cfg(test)]
mod tests;

pub use crate::fit::bearings::{BearingParameter, Departure, Identifiability};
pub use certainty::{ModelUncertainty, SolvedReading, noise_scale, unbalance_covariance};
pub use phase_one::{PhaseOne, PhaseOneConfig, beside_runup, identify};
pub use phase_two::{LeastResidual, UnbalanceBounds, least_residual};
