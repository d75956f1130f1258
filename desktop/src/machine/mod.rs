//! The machine as drawn, and how far it may be off.

mod bearing;
pub mod bearings;
mod coupling;
mod disk;
pub mod drawing;
mod identity;
pub mod place;
pub mod probes;
mod segment;
pub mod span;
pub(crate) mod taper;
pub mod tolerance;
pub mod weights;
