//! Full-precision model of a rotor on two bearings: what the controller's model is made from,
//! checked against and identified with.
//!
//! | module | holds |
//! |---|---|
//! | [`machine`] | the machine as drawn, `rotor.toml`, how far it may be off, the terms it states |
//! | [`shaft`] | Timoshenko elements; K, M, G of the shaft with its disks; shape functions |
//! | [`bearing`] | what holds the shaft |
//! | [`effects`] | what a file's effects add to a machine's terms; one file an effect |
//! | [`model`] | supports, forcings and readings on a shaft; the response at running speed |
//! | [`receptance`] | the same response by a small update of a shaft solved once |
//! | [`measurement`] | measured 1x vibration, and `measured.csv` |
//! | [`unbalance`] | g·mm and degrees; static and dynamic parts |
//! | [`fit`] | hypotheses fitted to measurements |
//! | [`identify`] | bearings and unbalance from measurements: phase I and phase II |
//! | [`track`] | the unbalance of a long record, while bearings change |
//! | [`prognosis`] | where the unbalance is going |
//! | [`startup`] | a single-disk rotor from its start-up: the simple model, and where it fails |
//! | [`balance`] | correction weights from the model and from trial runs |
//! | [`compare`], [`diagnose`] | where a model misses; which effect is missing, and adding it |
//!
//! # Conventions
//! z along the shaft, rotation takes x into y. A probe reads `u(t) = u_c cos Ωt + u_s sin Ωt` from the
//! keyphasor mark on; as a phasor `Y = u_c − i u_s`, `u = Re(Y e^{iΩt})`. Unbalance `U` at angle α
//! pulls with `U Ω² cos(Ωt + α)` in x and `U Ω² sin(Ωt + α)` in y: the phasor `F = U Ω² e^{iα}` in x and
//! `−iF` in y. Everything inside is in SI units and radians; files and reports use µm, g·mm, rpm
//! and degrees, and their names say so.

pub mod balance;
pub mod bearing;
pub mod check;
pub mod compare;
pub mod diagnose;
pub mod effects;
mod error;
pub mod fit;
pub mod identify;
pub mod inference;
pub mod machine;
pub mod measurement;
pub mod model;
pub mod prognosis;
pub mod receptance;
pub mod shaft;
pub mod startup;
#[cfg(test)]
mod testing;
pub mod track;
pub mod unbalance;

pub use error::Error;
