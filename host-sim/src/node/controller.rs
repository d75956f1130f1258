//! The core with what a board does for it: calls it when something is due, and stores what it must not forget.

use anyhow::{Result, anyhow};
use rotor_edge_core::can::Frame;
use rotor_edge_core::node::{NodeConfig, Save};
use rotor_edge_core::state::Reason;

use super::store::Store;
use crate::bus::mac::present_us;
use crate::edge::EdgeNode;

/// A node with its store.
pub struct Controller {
    node: EdgeNode,
    store: Store,
    config: NodeConfig,
    lacks_model: Option<Reason>,
    /// Why something could not be stored that must not be forgotten.
    unsaved: Option<String>,
    last_us: u64,
}

impl Controller {
    /// Starts from what is stored, at `time_us`; without a model that can be used the node says so on the bus.
    ///
    /// # Errors
    /// If the node refuses its number or its thresholds.
    pub fn start(config: NodeConfig, store: Store, time_us: u64) -> Result<Self> {
        let mut node =
            EdgeNode::new(config).map_err(|e| anyhow!("the controller refuses to start: {e:?}"))?;
        node.restore_counter(store.counter());
        if config.authenticated {
            node.restore_nonce(store.nonce().unwrap_or_else(present_us));
        }
        if let Some(thresholds) = store.thresholds() {
            // those of another version are none: the settings stay, and `thresholds` shows them
            let _ = node.restore_thresholds(thresholds);
        }
        let lacks_model = node.load(store.model()).err();
        if let Some(memory) = store.memory() {
            node.restore(memory);
        }
        node.poll(time_us);
        Ok(Self { node, store, config, lacks_model, unsaved: None, last_us: time_us })
    }

    /// Why it started without a model.
    pub fn lacks_model(&self) -> Option<Reason> {
        self.lacks_model
    }

    /// Why what it learned could not be stored when that was last tried.
    pub fn unsaved(&self) -> Option<&str> {
        self.unsaved.as_deref()
    }

    pub fn node(&self) -> &EdgeNode {
        &self.node
    }

    /// Loses its power and starts again from what it stored.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn cut_power(&mut self, config: NodeConfig, time_us: u64) -> Result<()> {
        let store = std::mem::replace(&mut self.store, Store::in_memory());
        *self = Self::start(config, store, time_us)?;
        Ok(())
    }

    /// When something is due next, µs.
    pub fn due_us(&self) -> u64 {
        self.node.poll_at().max(self.last_us)
    }

    /// Does what is due first, if it is due until `until_us`, and says when that was.
    pub fn poll_next(&mut self, until_us: u64) -> Option<u64> {
        let due_us = Some(self.due_us()).filter(|due_us| *due_us <= until_us)?;
        self.node.poll(due_us);
        self.last_us = due_us;
        self.keep(due_us);
        if self.node.is_trial_over(due_us) {
            self.cut_power(self.config, due_us).expect("settings that it has started with before");
        }
        Some(due_us)
    }

    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        self.node.receive(time_us, frame);
        self.last_us = self.last_us.max(time_us);
        self.keep(time_us);
    }

    /// The next frame to send.
    pub fn transmit(&mut self) -> Option<Frame> {
        self.node.transmit()
    }

    fn keep(&mut self, time_us: u64) {
        while let Some(save) = self.node.to_save() {
            // a command that cannot be stored is refused, and nothing is lost
            let is_learned = !matches!(save, Save::Command { .. });
            let stored = match save {
                Save::Command { counter, model, thresholds } => {
                    self.store.save_command(counter, model, thresholds.as_ref().map(|bytes| &bytes[..]))
                }
                Save::Memory(memory) => self.store.save_memory(&memory),
                Save::Nonce(nonce) => self.store.save_nonce(nonce),
            };
            self.node.saved(time_us, stored.is_ok());
            if is_learned {
                self.unsaved = stored.err().map(|error| format!("{error:#}"));
            }
        }
    }
}
