//! How unknowns are searched.

pub mod scale;
