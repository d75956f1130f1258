//! The identifiers that a node must hear, as a controller's acceptance filters: the rest never wakes the processor.

use rotor_edge_core::can::{BROADCAST_NODE, TYPE_VERSION_QUERY, frame_id};

/// Bits of a standard identifier.
const ALL: u16 = 0x7ff;

/// A frame passes whose identifier equals `id` in the bits of `mask`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Filter {
    /// What the bits must be.
    pub id: u16,
    /// Bits that count.
    pub mask: u16,
}

impl Filter {
    /// Whether a standard identifier passes.
    pub fn passes(self, id: u16) -> bool {
        (id ^ self.id) & self.mask == 0
    }
}

/// Everything with the node's number, its own frames included (to learn that somebody else uses the number), and the
/// version query to all.
pub fn filters(node: u8) -> [Filter; 2] {
    let number = frame_id(0, BROADCAST_NODE);
    [
        Filter { id: frame_id(0, node), mask: number },
        Filter { id: frame_id(TYPE_VERSION_QUERY, BROADCAST_NODE), mask: ALL },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rotor_edge_core::can::{Frame, MAX_NODE};

    #[test]
    fn filter_passes_own_number_and_query_to_all() {
        for node in 0..=MAX_NODE {
            for id in 0..=ALL {
                let frame = Frame::standard(id, &[]).unwrap();
                let wanted = frame.node() == node
                    || (frame.node() == BROADCAST_NODE && frame.message_type() == TYPE_VERSION_QUERY);
                assert_eq!(filters(node).iter().any(|filter| filter.passes(id)), wanted, "{id:#x}");
            }
        }
    }
}
