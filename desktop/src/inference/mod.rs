//! How unknowns are searched.

pub mod scale;
pub mod scatter;
pub mod significance;
