//! What keeps items.

use anyhow::Result;

use crate::item::{Item, Kind};
use crate::numbering::Last;

/// Keeps items for good.
pub trait Keeper: Send {
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
