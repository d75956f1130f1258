//! Estimates the unbalance of a rotor beside the machine. From each 1x reading of one to eight proximity probes it computes
//! the unbalance in one to four planes, and judges whether the deployed model still describes the machine.
//!
//! | module | content |
//! |---|---|
//! | [`reading`] | readings: probe vectors at one speed |
//! | [`model`] | the deployed model: shaft, supports, forcings and probes |
//! | [`response`] | dynamic stiffness at a speed, factorised once: influence of the unbalance, and response without it |
//! | [`fit`] | the problem of phase II: least absolute residual within a disc per plane |
//! | [`polish`], [`swarm`] | its solution with a certificate, and the search without one |
//! | [`track`] | phase II: estimate of each reading within given bounds |
//! | [`stages`] | a reading is screened, averaged, bounded and estimated, as in a node |
//! | [`residual`] | residual of a reading |
//! | [`detector`] | residuals over time: floor, level, reference, flag, suspect bearing |
//! | [`thresholds`] | thresholds of the detector, in seconds |
//! | [`memory`] | data that must survive a loss of power |
//! | [`state`] | states of a monitor and their reasons |
//! | `can` | frames, messages, assembly of readings and results, ISO-TP |
//! | `command` | deployments and other commands: authenticated and numbered |
//! | [`extraction`] | 1x readings from samples of the probes and keyphasor marks |
//! | [`numerics`] | the calculations of a node, which may be compiled separately |
//! | [`monitor`] | readings in, state and reason out: the interface for firmware without CAN |
//! | `node` | frames in, frames out: the interface for boards |
//!
//! # Conventions
//! z along the shaft, rotation takes x into y. `u(t) = u_c cos Wt + u_s sin Wt`, phasor `Y = u_c − i u_s`, zero-to-peak,
//! t = 0 at the keyphasor mark. Unbalance at angle α: `Fx = U W² cos(Wt + α)`, `Fy = U W² sin(Wt + α)`.
//! Displacement µm, unbalance g·mm, force µN, stiffness N/m, damping N·s/m, mass kg, speed rad/s or rpm as named. Since
//! µN/(N/m) = µm and g·mm·(rad/s)² = µN, numbers in SI units carry over unchanged.
//!
//! # Guarantees
//! No heap, no I/O (time and frames are arguments), no recursion, no `dyn`, no function pointers, f32 throughout. No input
//! causes a panic: `tests/no-panic` links the whole public interface against a missing panic handler. Errors are flat and
//! `Copy`. A refused value leaves the state unchanged. Equal inputs give equal bits.
//!
//! # Features
//! | feature | default | adds |
//! |---|---|---|
//! | `can` | yes | the modules `can` and `node` |
//! | `command` | yes | the module `command`; with `can`, deployments to a node |
//! | `large-models` | yes | room for more supports, knots and forcings: [`model::MAX_SUPPORTS`] and its neighbours |
//! | `mac` | no | readings and results with a message authentication code; needs the first two |
//! | `serde` | no | [`thresholds::Thresholds`] by field name, for desktop programs |
//! | `defmt` | no | `defmt::Format` for states, readings and errors |
//!
//! Features only add functions. Without any of them the crate suits firmware with another bus or none.
//!
//! # Dependencies and their use
//! - [`nalgebra`]: fixed-size matrices and vectors of a model ([`model`], [`response`]); products and storage only, its
//!   decompositions keep panics. A model is made of these types: take them from here, and the versions
//!   agree. The same for [`heapless`].
//! - `libm`: exact square root and arctangent on every target; `micromath`: sine, cosine and root of the swarm's random
//!   starts, nothing else (both in one private file).
//! - [`heapless`]: lists of terms and the queue of frames, bounded at compile time.
//! - `crc`: the checksums of models, memories, readings and results.
//! - `hmac`, `sha2` (feature `command`): the authentication code of commands.
//! - `embedded-can` (feature `can`): the frame trait that drivers speak.
//! - `rand_xoshiro`, `rand_core`: the swarm's random numbers, the same bits everywhere; times of sending in a conflict.
//! - `defmt` (feature `defmt`): logs of a few bytes.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

/// The examples of the page that introduces the crate.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use heapless;
pub use nalgebra;

mod admission;
#[cfg(feature = "can")]
pub mod can;
mod checksum;
#[cfg(feature = "command")]
pub mod command;
pub mod detector;
#[cfg(test)]
mod error_tests;
pub mod extraction;
pub mod fit;
mod linear;
pub mod memory;
pub mod model;
mod model_error;
pub mod monitor;
#[cfg(feature = "can")]
pub mod node;
pub mod numerics;
mod packed;
pub mod polish;
pub mod reading;
pub mod residual;
pub mod response;
mod scalar;
pub mod stages;
pub mod state;
mod support;
pub mod swarm;
#[cfg(test)]
mod testing;
pub mod thresholds;
pub mod track;
