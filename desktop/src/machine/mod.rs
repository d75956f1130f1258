//! The machine as drawn: its file, how far it may be off, and the terms that it states.

mod bearing;
pub mod bearings;
mod coupling;
pub mod drawing;
mod identity;
mod loads;
mod materials;
pub mod place;
pub mod ross;
pub mod rotor_file;
mod segment;
mod stated;
mod table_file;
pub mod terms;
pub mod tolerance;
mod validation;
pub mod weights;

pub(crate) use validation::SCHEMA;
