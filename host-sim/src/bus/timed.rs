//! What came over a bus, and when.

/// Something and when it was complete on the bus, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timed<T> {
    /// As the recording counts time.
    pub time_us: u64,
    pub what: T,
}
