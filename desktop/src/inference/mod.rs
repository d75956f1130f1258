//! How unknowns are searched.

pub mod convergence;
pub mod evidence;
pub mod scale;
pub mod scatter;
pub mod significance;
