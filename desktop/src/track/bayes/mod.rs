//! Method 3: bearings and unbalance sampled every day, and widely after an event (Bera et al., Sensors 2024, 24, 8123).
//!
//! | module | holds |
//! |---|---|
//! | `days` | the two loops: every day, and in the whole range after a flag |
//! | `marginal` | posterior of the bearings with the unbalance integrated out |
//! | `mixture` | mixture of Student distributions that is matched to that posterior |
//! | `independence`, `chains` | the sampler; its chains from dispersed starts, run until they converge |
//! | [`sampling`] | samples and their convergence |
//! | `paper`, `paper_posterior`, `random_walk` | the method as published |

mod chains;
mod days;
mod independence;
mod marginal;
mod mixture;
mod paper;
mod paper_posterior;
mod random_walk;
pub mod sampling;
