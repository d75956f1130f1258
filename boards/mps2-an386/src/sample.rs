//! The sample machine's models and record, as `boards/sample` holds them.

use rotor_edge_core::reading::{Reading, probe_vectors};

/// Shape functions a plane.
pub const SHAPES: usize = 6;
/// The model that phase I makes.
pub const MODEL: &[u8] = include_bytes!("../../sample/model.bin");
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
