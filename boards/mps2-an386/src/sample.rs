//! The node's settings, the sample machine's model with the seal, and its record.

use rotor_edge_core::command::{KEY_BYTES, Key};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{ProbeVector, Reading};

/// The node's number.
pub const NUMBER: u8 = 1;
/// Its key, known to everybody; a device gets one of its own.
pub const KEY: Key = Key([0x52; KEY_BYTES]);
pub const MODEL: &[u8] = include_bytes!("../../sample/model.bin");
/// The model with the seal.
pub const BETTER: &[u8] = include_bytes!("../../sample/better.bin");
const READINGS: &[u8] = include_bytes!("../../sample/readings.bin");

/// Every row of the record.
pub fn readings() -> impl Iterator<Item = Reading> + Clone {
    let (rows, _) = READINGS.as_chunks::<36>();
    rows.iter().filter_map(|row| {
        let (values, _) = row.as_chunks::<4>();
        let value = |place: usize| values.get(place).map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes));
        let probe = |probe: usize| ProbeVector { cos_um: value(1 + 2 * probe), sin_um: value(2 + 2 * probe) };
        Reading::new(value(0), &[0, 1, 2, 3].map(probe))
    })
}

/// How the node runs here.
pub fn config() -> NodeConfig {
    let mut config = NodeConfig::new(NUMBER);
    config.key = Some(KEY);
    config
}
