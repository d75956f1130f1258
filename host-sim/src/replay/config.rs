//! How a record is played.

use rotor_edge_core::node::NodeConfig;

use crate::bus::BusConfig;

#[derive(Debug, Clone)]
pub struct ReplayConfig {
    /// The controller; its age limit and its heartbeat follow the record's pace.
    pub node: NodeConfig,
    /// Age beyond which a verdict is none any more, s; from the record's pace if absent.
    pub age_limit_s: Option<f32>,
    /// Days before which the controller loses its power, and is back.
    pub power_cuts_d: Vec<f64>,
    /// The bus between host and controller.
    pub bus: BusConfig,
}

impl Default for ReplayConfig {
    fn default() -> Self {
        Self {
            node: NodeConfig::new(1),
            age_limit_s: None,
            power_cuts_d: Vec::new(),
            bus: BusConfig::default(),
        }
    }
}
