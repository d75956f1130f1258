//! Which monitor is commanded, over which bus and with whose key: arguments shared by the commands to a monitor.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::detector_arguments::node_number;
use crate::bus::{BusSpec, CanBus};
use crate::deploy::{Authority, read_key};

#[derive(Debug, Args)]
pub struct CommandTarget {
    /// The bus, such as slcan:127.0.0.1:29537, socketcand:127.0.0.1:29536 or socketcan:vcan0
    #[arg(long)]
    pub bus: BusSpec,
    /// The monitor's number, 0 to 30
    #[arg(long, default_value_t = 1)]
    node: u8,
    /// The monitor's key
    #[arg(long)]
    key: PathBuf,
    /// Number of this command, above all earlier ones; milliseconds since 1970 if absent
    #[arg(long)]
    counter: Option<u64>,
}

impl CommandTarget {
    ///
    /// # Errors
    /// If there is no such number, or the key cannot be read.
    pub fn authority(&self) -> Result<Authority> {
        Authority::new(read_key(&self.key)?, node_number(self.node)?, self.counter)
    }

    /// Joins the bus.
    ///
    /// # Errors
    /// One sentence on what is wrong with the bus, and what to do.
    pub fn open(&self) -> Result<Box<dyn CanBus>> {
        self.bus.open()
    }
}
