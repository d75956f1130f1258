//! The node with its storage: what every board runs.
//!
//! It starts empty in static memory, and takes up what was stored: model and thresholds from the slots, memory from the
//! journal, the counter from whichever holds the higher one. Whatever of it is missing, it runs and can be deployed to.

#[cfg(test)]
mod tests;

use rotor_edge_board_numerics::Fast;
pub use rotor_edge_board_numerics::{BoardModel, PLANES, PROBES, SHAPES};
use rotor_edge_core::can::Frame;
use rotor_edge_core::node::{Node, NodeConfig, NodeError, Save};
use rotor_edge_core::state::Reason;
use static_cell::StaticCell;

use crate::flash::{Mapped, SaveError};
use crate::journal::{Journal, MEMORY_BYTES, Record};
use crate::slots::{Change, Missing, Slots};

/// A board's node.
pub type BoardNode = Node<SHAPES, PROBES, PLANES, Fast>;

/// Where the node lies: in static memory, and made there. On the stack as well, the start would be its deepest point.
pub struct Place(StaticCell<Result<BoardNode, NodeError>>);

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    pub const fn new() -> Self {
        Self(StaticCell::new())
    }
}

/// A node and where it keeps what must survive.
pub struct Monitor<F> {
    pub node: &'static mut BoardNode,
    slots: Slots<F>,
    journal: Journal<F>,
}

/// What a monitor started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Start {
    /// Last counter accepted before.
    pub counter: u64,
    /// A model, or why there is none.
    pub model: Result<(), Reason>,
    /// The thresholds are those that were set; otherwise those of the settings.
    pub has_thresholds: bool,
    /// What was learned with this model is known again.
    pub is_remembered: bool,
}

impl<F: Mapped> Monitor<F> {
    /// Starts with what was stored last. Each place serves once.
    ///
    /// Errors: those of [`Node::new`].
    pub fn start(
        place: &'static Place,
        slots: F,
        journal: F,
        config: NodeConfig,
    ) -> Result<(Self, Start), NodeError> {
        let node = create(place, config)?;
        let (slots, journal) = (Slots::new(slots), Journal::new(journal));
        let start = restore(node, &slots, &journal);
        Ok((Self { node, slots, journal }, start))
    }

    /// Starts anew in the same place with what was stored last: what a loss of power leaves, where there is none.
    ///
    /// Errors: those of [`Node::new`].
    pub fn restart(&mut self, config: NodeConfig) -> Result<Start, NodeError> {
        renew(self.node, config)?;
        Ok(restore(self.node, &self.slots, &self.journal))
    }

    /// Hands a frame to the node and stores what it then wants stored. `may_write`: the supply will last.
    pub fn receive(&mut self, time_us: u64, frame: &Frame, may_write: bool) {
        hear(self.node, time_us, frame);
        self.store(time_us, may_write);
    }

    /// Polls the node and stores what it then wants stored.
    pub fn poll(&mut self, time_us: u64, may_write: bool) {
        self.node.poll(time_us);
        self.store(time_us, may_write);
    }

    fn store(&mut self, time_us: u64, may_write: bool) {
        while let Some(save) = self.node.to_save() {
            let counter = self.node.command_counter();
            let stored = may_write && keep(&mut self.slots, &mut self.journal, &save, counter).is_ok();
            self.node.saved(time_us, stored);
        }
    }
}

#[inline(never)]
fn create(place: &'static Place, config: NodeConfig) -> Result<&'static mut BoardNode, NodeError> {
    place.0.init_with(|| Node::new(config)).as_mut().map_err(|error| *error)
}

/// By itself, for two nodes are on the stack meanwhile, and [`restore`] needs much of it.
#[inline(never)]
fn renew(node: &mut BoardNode, config: NodeConfig) -> Result<(), NodeError> {
    *node = Node::new(config)?;
    Ok(())
}

#[inline(never)]
fn restore<F: Mapped>(node: &mut BoardNode, slots: &Slots<F>, journal: &Journal<F>) -> Start {
    let stored = slots.load();
    let record = journal.last();
    let counter = record.map_or(0, |record| record.counter).max(stored.counter);
    node.restore_counter(counter);
    #[cfg(feature = "mac")]
    node.restore_nonce(record.map_or(0, |record| record.nonce));
    let thresholds = stored.state.map_or(&[][..], |state| state.thresholds);
    let has_thresholds = !thresholds.is_empty() && node.restore_thresholds(thresholds).is_ok();
    let model = node.load(stored.state.map(|state| state.model).map_err(|missing| match missing {
        Missing::Nothing => Reason::NothingStored,
        Missing::Damaged => Reason::Damaged,
    }));
    let is_remembered = record.is_some_and(|record| node.restore(record.memory));
    Start { counter, model, has_thresholds, is_remembered }
}

#[inline(never)]
fn hear(node: &mut BoardNode, time_us: u64, frame: &Frame) {
    node.receive(time_us, frame);
}

/// Stores what a node wants stored. A counter or a nonce alone goes beside the memory: a record instead of an erasure.
#[inline(never)]
fn keep<F: Mapped>(
    slots: &mut Slots<F>,
    journal: &mut Journal<F>,
    save: &Save<'_>,
    last_counter: u64,
) -> Result<(), SaveError> {
    let last = journal.last();
    let nonce = last.map_or(0, |record| record.nonce);
    let record = match save {
        Save::Memory(memory) => return journal.append(Record { counter: last_counter, nonce, memory }),
        Save::Command { counter, model: None, thresholds: None } => (*counter, nonce),
        Save::Nonce(nonce) => (last_counter, *nonce),
        Save::Command { counter, model, thresholds } => {
            let thresholds = thresholds.as_ref().map(|thresholds| &thresholds[..]);
            return slots.save(*counter, Change { model: *model, thresholds });
        }
    };
    let mut memory = [0; MEMORY_BYTES];
    let last = last.map_or(&[][..], |record| record.memory);
    let length = last.len();
    for (to, from) in memory.iter_mut().zip(last) {
        *to = *from;
    }
    let (counter, nonce) = record;
    journal.append(Record { counter, nonce, memory: memory.get(..length).unwrap_or_default() })
}
