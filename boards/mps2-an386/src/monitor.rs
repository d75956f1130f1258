//! The node with its storage: what the firmware runs and what the programs of `src/bin` measure and torment.

use embedded_storage::nor_flash::NorFlash;
use rotor_edge_boards::slots::Slots;
use rotor_edge_core::can::Frame;
use rotor_edge_core::command::{KEY_BYTES, Key};
use rotor_edge_core::model::{Model, ModelError};
use rotor_edge_core::node::{Node, NodeConfig, NodeError};
use static_cell::StaticCell;

use crate::sample::{self, SHAPES};

/// The node's number.
pub const NUMBER: u8 = 1;
/// The sample node's key, known to everybody; a device gets one of its own.
pub const KEY: Key = Key([0x52; KEY_BYTES]);

/// The node of this board.
pub type BoardNode = Node<SHAPES>;
/// Its model.
pub type BoardModel = Model<SHAPES>;
/// Where a model is decoded to.
pub type ModelCell = StaticCell<Result<BoardModel, ModelError>>;

const MODEL_BYTES: usize = BoardModel::max_size_bytes();

// What the node is made of lies in static memory and is made one after another: together on the stack, the start would
// be its deepest point. For the same reason nothing here is inlined.
static BUFFER: StaticCell<[u8; MODEL_BYTES]> = StaticCell::new();
static MODEL: ModelCell = ModelCell::new();
static NODE: StaticCell<Result<BoardNode, NodeError>> = StaticCell::new();

/// A node and where it keeps its model and counter.
pub struct Monitor<F: NorFlash> {
    /// The node.
    pub node: &'static mut BoardNode,
    slots: Slots<F>,
}

/// What a monitor started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Start {
    /// Last counter accepted before.
    pub counter: u64,
    /// The model was deployed; otherwise it is the firmware's own.
    pub deployed: bool,
}

impl<F: NorFlash> Monitor<F> {
    /// Starts with what was stored last, or with the firmware's own model. To be called once.
    ///
    /// # Panics
    /// If the firmware's own model is refused, which the tests rule out.
    pub fn start(flash: F) -> (Self, Start) {
        let mut slots = Slots::new(flash);
        let (counter, stored) = slots.load(BUFFER.init_with(|| [0; MODEL_BYTES])).unwrap_or_default();
        let node = create(decode(&MODEL, stored.unwrap_or(sample::MODEL)));
        node.restore_counter(counter);
        (Self { node, slots }, Start { counter, deployed: stored.is_some() })
    }

    /// Hands a frame to the node and stores what it then wants stored.
    #[inline(never)]
    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        self.node.receive(time_us, frame);
        self.store(time_us);
    }

    #[inline(never)]
    fn store(&mut self, time_us: u64) {
        if let Some(save) = self.node.to_save() {
            let stored = self.slots.save(save.counter, save.model).is_ok();
            self.node.saved(time_us, stored);
        }
    }
}

/// Decodes a model into static memory.
///
/// # Panics
/// If the model is refused; a stored one was checked before it was stored.
#[inline(never)]
pub fn decode(cell: &'static ModelCell, bytes: &[u8]) -> &'static BoardModel {
    match cell.init_with(|| Model::decode(bytes)) {
        Ok(model) => model,
        Err(error) => panic!("the model is refused: {error:?}"),
    }
}

#[inline(never)]
fn create(model: &BoardModel) -> &'static mut BoardNode {
    let config = NodeConfig { key: Some(KEY), ..NodeConfig::new(NUMBER) };
    match NODE.init_with(|| Node::new(config, model.clone())) {
        Ok(node) => node,
        Err(error) => panic!("the node refuses to start: {error:?}"),
    }
}
