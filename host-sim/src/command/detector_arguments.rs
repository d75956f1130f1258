//! How a controller judges: arguments shared by the commands that run one.

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_core::can::MAX_NODE;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::thresholds::Thresholds;

use super::setting::Setting;
use crate::deploy::out_of_bounds;

/// The controller's number, seed and thresholds.
#[derive(Debug, Args)]
pub struct DetectorArguments {
    /// The controller's number on the bus, 0 to 30
    #[arg(long, default_value_t = 1)]
    pub node: u8,
    /// Seed of the particle swarms (and of a simulated bus's faults)
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Relative rise of the residual above its running level that is suspicious
    #[arg(long, default_value_t = Thresholds::DEFAULT.rise)]
    rise: f32,
    /// Residual over feature sum that is suspicious by itself
    #[arg(long, default_value_t = Thresholds::DEFAULT.ratio_limit)]
    ratio_limit: f32,
    /// Residual over feature sum below which no rise is suspicious
    #[arg(long, default_value_t = Thresholds::DEFAULT.ratio_floor)]
    ratio_floor: f32,
    /// Suspicious readings in a row that raise the flag
    #[arg(long, default_value_t = Thresholds::DEFAULT.persistence_readings, value_parser = clap::value_parser!(u8).range(1..))]
    persistence: u8,
    /// Largest growth of a plane's unbalance in the time `growth_s`, a day unless it is set
    #[arg(long, default_value_t = Thresholds::DEFAULT.growth)]
    growth: f32,
    /// Age at which a verdict expires, s
    #[arg(long)]
    age_limit_s: Option<f32>,
    /// Any other threshold, as `rotor-edge thresholds` names it; may be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<Setting>,
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

impl DetectorArguments {
    /// The age limit, if the arguments state one.
    pub fn age_limit_s(&self) -> Option<f32> {
        let thresholds = self.thresholds().ok()?;
        let stated =
            self.age_limit_s.is_some() || self.set.iter().any(|setting| setting.is_of("age_limit_s"));
        stated.then_some(thresholds.age_limit_s)
    }

    /// The controller's settings.
    ///
    /// # Errors
    /// Which argument is out of range.
    pub fn config(&self) -> Result<NodeConfig> {
        let mut config = NodeConfig::new(node_number(self.node)?);
        config.track.seed = self.seed;
        config.thresholds = self.thresholds()?;
        Ok(config)
    }

    fn thresholds(&self) -> Result<Thresholds> {
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
        let thresholds = Thresholds {
            rise: self.rise,
            ratio_limit: self.ratio_limit,
            ratio_floor: self.ratio_floor,
            persistence_readings: self.persistence,
            growth: self.growth,
            age_limit_s: self.age_limit_s.unwrap_or(Thresholds::DEFAULT.age_limit_s),
            ..Thresholds::DEFAULT
        };
        checked(thresholds, &self.set)
    }
}

/// Thresholds with what was set, if that can be.
///
/// # Errors
/// Which threshold there is not, or is out of its bounds.
pub fn checked(mut thresholds: Thresholds, set: &[Setting]) -> Result<Thresholds> {
    for setting in set {
        setting.apply(&mut thresholds)?;
    }
    if let Err(error) = thresholds.check() {
        bail!("the thresholds cannot be: {}", out_of_bounds(error));
    }
    Ok(thresholds)
}
