//! The laws by which bearings hold the shaft.

pub mod film;
pub mod magnetic;
pub mod squeeze_film;
