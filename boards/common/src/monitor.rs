//! The node with its storage: what every board runs.

#[cfg(test)]
mod tests;

use rotor_edge_core::can::Frame;
use rotor_edge_core::model::{Model, ModelError};
use rotor_edge_core::node::{Node, NodeConfig, NodeError};
use static_cell::StaticCell;

use crate::flash::Mapped;
use crate::slots::{Change, Slots, Stored};

/// Shape functions a plane, as the desktop makes models for controllers.
pub const SHAPES: usize = 6;
/// The model that a board starts with until one is deployed: the sample machine's.
pub const OWN_MODEL: &[u8] = include_bytes!("../../sample/model.bin");

/// A board's model.
pub type BoardModel = Model<SHAPES>;
/// A board's node.
pub type BoardNode = Node<SHAPES>;
/// Where a model is decoded to.
pub type ModelCell = StaticCell<Result<BoardModel, ModelError>>;

/// Where the node and what it is made of lie: in static memory, made one after another. Together on the stack, the start
/// would be its deepest point; for the same reason nothing here is inlined.
pub struct Place {
    model: ModelCell,
    node: StaticCell<Result<BoardNode, NodeError>>,
}

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    /// Empty.
    pub const fn new() -> Self {
        Self { model: StaticCell::new(), node: StaticCell::new() }
    }
}

/// A node and where it keeps model and counter.
pub struct Monitor<F> {
    /// The node.
    pub node: &'static mut BoardNode,
    slots: Slots<F>,
}

/// What a monitor started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Start {
    /// Last counter accepted before.
    pub counter: u64,
    /// The model was deployed; otherwise it is [`OWN_MODEL`].
    pub deployed: bool,
}

/// Why a monitor does not start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StartError {
    /// The model is refused.
    Model(ModelError),
    /// The settings are refused.
    Node(NodeError),
}

impl<F: Mapped> Monitor<F> {
    /// Starts with what was stored last, or with the board's own model. Each place serves once.
    ///
    /// Errors: [`StartError`].
    pub fn start(place: &'static Place, flash: F, config: NodeConfig) -> Result<(Self, Start), StartError> {
        let slots = Slots::new(flash);
        let Stored { counter, state } = slots.load();
        let stored = state.ok().map(|state| state.model);
        let model = decode(&place.model, stored.unwrap_or(OWN_MODEL)).map_err(StartError::Model)?;
        let deployed = stored.is_some();
        let node = create(place, config, model).map_err(StartError::Node)?;
        node.restore_counter(counter);
        Ok((Self { node, slots }, Start { counter, deployed }))
    }

    /// Hands a frame to the node and stores what it then wants stored. `may_write`: the supply will last.
    pub fn receive(&mut self, time_us: u64, frame: &Frame, may_write: bool) {
        hear(self.node, time_us, frame);
        self.store(time_us, may_write);
    }

    #[inline(never)]
    fn store(&mut self, time_us: u64, may_write: bool) {
        if let Some(save) = self.node.to_save() {
            let stored = may_write
                && self.slots.save(save.counter, Change { model: save.model, thresholds: None }).is_ok();
            self.node.saved(time_us, stored);
        }
    }
}

#[inline(never)]
fn hear(node: &mut BoardNode, time_us: u64, frame: &Frame) {
    node.receive(time_us, frame);
}

/// Decodes a model into static memory; a cell serves once.
///
/// Errors: those of [`Model::decode`].
#[inline(never)]
pub fn decode(cell: &'static ModelCell, bytes: &[u8]) -> Result<&'static BoardModel, ModelError> {
    cell.init_with(|| Model::decode(bytes)).as_ref().map_err(|error| *error)
}

#[inline(never)]
fn create(
    place: &'static Place,
    config: NodeConfig,
    model: &BoardModel,
) -> Result<&'static mut BoardNode, NodeError> {
    place.node.init_with(|| Node::new(config, model.clone())).as_mut().map_err(|error| *error)
}
