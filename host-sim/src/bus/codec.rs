//! What the two text protocols have in common: bytes in, frames and messages out.

use super::wire::WireFrame;

/// One item of the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StreamItem {
    Frame(WireFrame),
    /// Anything else that is whole: a command or an answer.
    Text(String),
    Garbage,
}

/// Takes a stream apart, wherever it was split.
pub trait Decoder: Default + Send {
    /// Takes one byte; what it completes.
    fn push(&mut self, byte: u8) -> Option<StreamItem>;
}

/// All that a stream holds.
#[cfg(test)]
pub fn decode_all<D: Decoder>(stream: &[u8]) -> Vec<StreamItem> {
    let mut decoder = D::default();
    stream.iter().filter_map(|byte| decoder.push(*byte)).collect()
}
