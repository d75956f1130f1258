//! The laws by which bearings hold the shaft.

pub mod film;
