//! ISO-TP.

use rotor_edge_core::can::isotp::{IsoTp, Progress};

use super::Bytes;

const RX: usize = 100;
const TX: usize = 300;

/// One end among arbitrary payloads, and then a message across a line that now and then loses a frame: it arrives whole or
/// not at all, and nobody waits for ever.
pub fn isotp(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (mut one, mut other) = (IsoTp::<RX, TX>::new(), IsoTp::<TX, RX>::new());
    let mut time_us = 0;
    for _ in 0..bytes.u8() {
        let step = bytes.u8();
        time_us += u64::from(step) * 4000;
        let payload = bytes.slice(usize::from(step % 10));
        if one.receive(time_us, payload) == Progress::Complete {
            assert!((1..=RX).contains(&one.message().len()));
        }
        if step & 0x40 != 0 {
            let _ = one.send(time_us, bytes.slice(usize::from(step)));
        }
        if step & 0x80 != 0 {
            let _ = one.check_time(time_us);
        }
        assert!(one.poll_at().is_none_or(|at_us| at_us <= time_us + 1_000_001));
        one.poll(time_us);
    }
    // what is due is sent, and nobody answers for longer than any time-out
    while let Some(at_us) = one.poll_at() {
        time_us = time_us.max(at_us);
        let _ = (one.poll(time_us), one.check_time(time_us));
    }
    assert!(!one.is_sending());
    let losses = bytes.u8();
    let message = bytes.slice(TX);
    if one.send(time_us, message).is_err() {
        return assert!(message.is_empty());
    }
    let mut sent: u32 = 0;
    let mut arrives = || {
        sent += 1;
        losses == 0 || !sent.is_multiple_of(u32::from(losses))
    };
    while one.is_sending() {
        while let Some(payload) = one.poll(time_us) {
            if arrives() && other.receive(time_us, &payload) == Progress::Complete {
                assert_eq!(other.message(), message);
            }
        }
        while let Some(payload) = other.poll(time_us) {
            if arrives() {
                one.receive(time_us, &payload);
            }
        }
        time_us += 100_000;
        let _ = (one.check_time(time_us), other.check_time(time_us));
    }
    assert!(losses != 0 || other.message() == message);
}
