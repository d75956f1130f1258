//! Rotor unbalance at the machine's edge: each 1x reading of one to eight proximity probes becomes the unbalance in one to
//! four planes, and a verdict on whether the deployed model still describes the machine.
//!
//! | module | what it is |
//! |---|---|
//! | [`reading`] | what arrives: the probe vectors at one speed |
//! | [`model`] | what was deployed: a shaft plus supports, forcings and probes |
//! | [`response`] | dynamic stiffness at a speed, solved once: influence of the unbalance and what is there without it |
//! | [`fit`] | the problem of phase II: least absolute residual within a disc per plane |
//! | [`polish`], [`swarm`] | its certified solution, and the search where there is no certificate |
//! | [`track`] | phase II: the estimate of each reading within the bounds given |
//! | [`stages`] | a reading screened, averaged, bounded and estimated, as a node does it |
//! | [`residual`] | what the model leaves unexplained in a reading |
//! | [`detector`] | residuals over time: floor, level, reference, flag, suspected bearing |
//! | [`thresholds`] | what is judged by, in seconds |
//! | [`memory`] | what must survive a loss of power |
//! | [`state`] | what a monitor may say of the machine, and why |
//! | `can` | frames, messages, assembly of readings and results, ISO-TP |
//! | `command` | deployment of a model and what else changes a monitor: authenticated and numbered |
//! | [`extraction`] | raw probe samples and keyphasor marks to the 1x reading |
//! | [`numerics`] | what a node calculates with, which may be compiled apart from it |
//! | [`monitor`] | readings in, state and reason out: all that firmware without CAN calls |
//! | `node` | frames in, frames out: all that a board calls |
//!
//! # Conventions
//! z along the shaft, rotation takes x into y. `u(t) = u_c cos Wt + u_s sin Wt`, phasor `Y = u_c − i u_s`, zero-to-peak,
//! t = 0 at the keyphasor mark. Unbalance at angle α: `Fx = U W² cos(Wt + α)`, `Fy = U W² sin(Wt + α)`.
//! Displacement µm, unbalance g·mm, force µN, stiffness N/m, damping N·s/m, mass kg, speed rad/s or rpm as named. Since
//! µN/(N/m) = µm and g·mm·(rad/s)² = µN, numbers in SI units carry over unchanged.
//!
//! # What it promises
//! No heap, no I/O (time and frames are arguments), no recursion, no `dyn`, no function pointers, f32 throughout. Nothing
//! panics, whatever arrives: `tests/no-panic` links the whole public path against a panic handler that does not exist.
//! Errors are flat and `Copy`; a value refused leaves the state as it was. Equal inputs give equal bits.
//!
//! # Features
//! | feature | default | adds |
//! |---|---|---|
//! | `can` | yes | the modules `can` and `node` |
//! | `command` | yes | the module `command`; with `can`, deployments to a node |
//! | `large-models` | yes | room for more supports, knots and forcings: [`model::MAX_SUPPORTS`] and its neighbours |
//! | `mac` | no | readings and results with a message authentication code; needs the first two |
//! | `serde` | no | [`thresholds::Thresholds`] by the names of their fields, for programs on a desk |
//! | `defmt` | no | `defmt::Format` for states, readings and errors |
//!
//! Features only add. Without any of them everything else is there, for firmware with another bus or none.
//!
//! # Dependencies, and where each earns its place
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
