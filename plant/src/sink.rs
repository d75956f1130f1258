//! A store that a gateway writes items to.

use anyhow::Result;

use crate::item::{Item, Kind};
use crate::numbering::Last;

pub trait Sink: Send {
    /// Has a bus for this gateway alone, as long as this lives: two that call a bus alike would number its items twice.
    ///
    /// # Errors
    /// One sentence if another gateway keeps it.
    fn claim(&mut self, plant: &str, bus: &str) -> Result<()>;

    /// The last number that is kept of each monitor of a plant's bus, by kind.
    ///
    /// # Errors
    /// If it cannot be read.
    fn last(&mut self, plant: &str, bus: &str) -> Result<Vec<(u8, Kind, Last)>>;

    /// Keeps items, those that it has already once. When it returns they are kept, whatever happens then.
    ///
    /// # Errors
    /// If not all of them are; they may be put again.
    fn put(&mut self, items: &[Item]) -> Result<()>;

    /// What it is, for messages.
    fn description(&self) -> String;
}

/// What a second gateway for a bus is told.
pub fn is_kept(place: &str, plant: &str, bus: &str) -> String {
    format!("another gateway keeps bus {bus} of {plant} in {place}; end it, or give one of them another name")
}
