//! What holds the shaft.

pub mod support;
