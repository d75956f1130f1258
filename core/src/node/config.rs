//! Settings of a node, and why it refuses some.

use core::error::Error;
use core::fmt;

use crate::can::MAX_NODE;
#[cfg(feature = "command")]
use crate::command::Key;
use crate::model::ModelError;
use crate::thresholds::{ThresholdError, Thresholds};
use crate::track::TrackConfig;

/// Settings of a node; start from [`NodeConfig::new`] and set what differs. Features and later versions add fields.
///
/// ```
/// # use rotor_edge_core::node::NodeConfig;
/// let mut config = NodeConfig::new(3);
/// config.heartbeat_period_us = 500_000;
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct NodeConfig {
    /// Its number on the bus, 0 to [`MAX_NODE`](crate::can::MAX_NODE).
    pub node: u8,
    /// How the unbalance is followed.
    pub track: TrackConfig,
    /// What it judges by until others are restored or set.
    pub thresholds: Thresholds,
    /// From a reading's start to its end at most, µs.
    pub reading_timeout_us: u64,
    pub heartbeat_period_us: u64,
    /// From the first [`Node::poll`](super::Node::poll) to the first frame: time to learn that somebody else uses the number, µs.
    pub listen_us: u64,
    /// Between two savings of the memory when nothing of note happens, µs.
    pub memory_period_us: u64,
    /// Without a key, the node takes no commands.
    #[cfg(feature = "command")]
    pub key: Option<Key>,
    /// Take only readings with a right [MAC](crate::can::mac), and send a MAC with every result, heartbeat and state. Without
    /// a key no reading is taken.
    #[cfg(feature = "mac")]
    pub authenticated: bool,
    /// By so much the nonce that is stored is ahead of the readings at most: as long after a restart nothing is taken,
    /// µs if readings are numbered so.
    #[cfg(feature = "mac")]
    pub nonce_reserve: u64,
    /// A number that no other device has, such as its serial number: in a conflict, it sets the times of sending apart.
    pub seed: u64,
}

impl NodeConfig {
    /// [`NodeConfig::reading_timeout_us`] of a node that sets no other.
    pub const READING_TIMEOUT_US: u64 = 200_000;
    /// [`NodeConfig::heartbeat_period_us`] of a node that sets no other.
    pub const HEARTBEAT_PERIOD_US: u64 = 1_000_000;

    /// Usual settings: 100 ms of listening, memory every hour, no key, no MACs and a minute of reserve for their nonces.
    pub fn new(node: u8) -> Self {
        Self {
            node,
            track: TrackConfig::default(),
            thresholds: Thresholds::DEFAULT,
            reading_timeout_us: Self::READING_TIMEOUT_US,
            heartbeat_period_us: Self::HEARTBEAT_PERIOD_US,
            listen_us: 100_000,
            memory_period_us: 3_600_000_000,
            #[cfg(feature = "command")]
            key: None,
            #[cfg(feature = "mac")]
            authenticated: false,
            #[cfg(feature = "mac")]
            nonce_reserve: 60_000_000,
            seed: 0,
        }
    }
}

/// Why a node cannot start or take a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NodeError {
    /// The node's number is above [`MAX_NODE`](crate::can::MAX_NODE).
    Node,
    Thresholds(ThresholdError),
    Model(ModelError),
}

impl fmt::Display for NodeError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node => write!(formatter, "the node's number is above {MAX_NODE}"),
            Self::Thresholds(error) => write!(formatter, "the thresholds are refused: {error}"),
            Self::Model(error) => write!(formatter, "the model is refused: {error}"),
        }
    }
}

impl Error for NodeError {}

impl From<ModelError> for NodeError {
    fn from(error: ModelError) -> Self {
        Self::Model(error)
    }
}
