//! When the controller flags: arguments shared by the commands that run one.

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_core::can::MAX_NODE;
use rotor_edge_core::node::NodeConfig;

/// The controller's number, seed and thresholds.
#[derive(Debug, Args)]
pub struct Thresholds {
    /// The controller's number on the bus, 0 to 30
    #[arg(long, default_value_t = 1)]
    pub node: u8,
    /// Seed of the particle swarms (and of a simulated bus's faults)
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Rise of the residual above its running level that counts, relative
    #[arg(long, default_value_t = 0.5)]
    rise: f32,
    /// Residual over feature sum that counts by itself
    #[arg(long, default_value_t = 1.0 / 3.0)]
    ratio_limit: f32,
    /// Residual over feature sum below which a rise does not count
    #[arg(long, default_value_t = 0.1)]
    ratio_floor: f32,
    /// Readings in a row that raise the flag, 1 to 8
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=8))]
    persistence: u8,
    /// Largest unbalance of a plane relative to the reading before
    #[arg(long, default_value_t = 1.2)]
    pub growth: f32,
}

/// Refuses a node number that the bus has not.
///
/// # Errors
/// If it is above [`MAX_NODE`].
pub fn node_number(node: u8) -> Result<u8> {
    if node > MAX_NODE {
        bail!("--node {node}: expected a number from 0 to {MAX_NODE}");
    }
    Ok(node)
}

impl Thresholds {
    /// The controller's settings.
    ///
    /// # Errors
    /// Which argument is out of range.
    pub fn config(&self) -> Result<NodeConfig> {
        for (name, value, least) in [
            ("--growth", self.growth, 1.0),
            ("--rise", self.rise, 0.0),
            ("--ratio-limit", self.ratio_limit, 0.0),
            ("--ratio-floor", self.ratio_floor, 0.0),
        ] {
            if !value.is_finite() || value < least {
                bail!("{name} {value}: expected a number of at least {least}");
            }
        }
        let mut config = NodeConfig::new(node_number(self.node)?);
        config.track.seed = self.seed;
        config.track.growth = self.growth;
        config.residual.rise = self.rise;
        config.residual.ratio_limit = self.ratio_limit;
        config.residual.ratio_floor = self.ratio_floor;
        config.residual.persistence = self.persistence;
        Ok(config)
    }
}
