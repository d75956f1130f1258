//! The machine as drawn, how far it may be off, and the terms that it states.

mod bearing;
pub mod bearings;
mod coupling;
pub mod drawing;
mod identity;
pub mod place;
mod segment;
pub mod terms;
pub mod tolerance;
pub mod weights;
