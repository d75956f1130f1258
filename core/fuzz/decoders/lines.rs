//! SLCAN.

use rotor_edge_core::can::slcan::{Decoder, SlcanLine, encode};

/// Text of an adapter; a frame that is understood is written and understood again.
pub fn slcan(bytes: &[u8]) {
    let (mut decoder, mut again) = (Decoder::new(), Decoder::new());
    for line in bytes.iter().filter_map(|&byte| decoder.push(byte)) {
        if let SlcanLine::Frame(frame) = line {
            let lines: Vec<SlcanLine> = encode(&frame).iter().filter_map(|&byte| again.push(byte)).collect();
            assert_eq!(lines, [line]);
        }
    }
}
