//! Identification in two phases (Bera et al., Machines 2023, 11, 976): phase I finds the bearings and
//! the unbalance of the first days, phase II follows the unbalance with the bearings held.

mod bearings;
mod observations;
mod phase_one;
mod phase_two;

pub use bearings::{BearingParameter, COEFFICIENTS, Identified};
pub use observations::{Observations, assumed_noise};
pub use phase_one::{PhaseOne, PhaseOneConfig, identify};
pub use phase_two::{Bounds, LeastResidual, least_residual};
