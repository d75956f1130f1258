//! A monitor's counters, as the frames of its heartbeat tell them.

use rotor_edge_core::can::{Counters, Message};

/// Puts what one frame tells into its place; other messages change nothing.
pub fn take(counters: &mut Counters, message: &Message) {
    match *message {
        Message::Heartbeat { readings, lost, rejected, .. } => {
            *counters = Counters { readings, lost, rejected, ..*counters };
        }
        Message::Counters { repeated, late, incomplete, stray } => {
            *counters = Counters { repeated, late, incomplete, stray, ..*counters };
        }
        Message::Discards { skipped, resynchronised, overflowed, unsolved } => {
            *counters = Counters { skipped, resynchronised, overflowed, unsolved, ..*counters };
        }
        Message::Commands { accepted, refused, forged, replayed } => {
            *counters = Counters { accepted, refused, forged, replayed, ..*counters };
        }
        Message::Transfers { broken, conflicts, .. } => {
            *counters = Counters { broken, conflicts, ..*counters };
        }
        _ => {}
    }
}
