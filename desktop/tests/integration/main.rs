//! The desktop crate against published figures, other programs and machines made for it.

mod effects;
mod films;
#[cfg(feature = "lstm")]
mod lstm;
mod published;
mod repeated;
mod rotor_file;
mod shaft_stiffness;
mod simulate;
mod tracking;
