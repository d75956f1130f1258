//! The node's settings, the sample machine's model with the seal, and its record.

use rotor_edge_core::command::{KEY_BYTES, Key};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{Reading, probe_vectors};

/// The node's number.
pub const NUMBER: u8 = 1;
/// Its key, known to everybody; a device gets one of its own.
pub const KEY: Key = Key([0x52; KEY_BYTES]);
/// The model with the seal.
pub const BETTER: &[u8] = include_bytes!("../../sample/better.bin");
const READINGS: &[u8] = include_bytes!("../../sample/readings.bin");

/// Every row of the record.
pub fn readings() -> impl Iterator<Item = Reading> + Clone {
    let (rows, _) = READINGS.as_chunks::<36>();
    rows.iter().map(|row| {
        let (values, _) = row.as_chunks::<4>();
        let value = |place: usize| values.get(place).map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes));
        Reading { speed_rpm: value(0), probes: probe_vectors(&core::array::from_fn(|i| value(1 + i))) }
    })
}

/// How the node runs here.
pub fn config() -> NodeConfig {
    NodeConfig { key: Some(KEY), ..NodeConfig::new(NUMBER) }
}
