//! Messages, readings and results.

use rotor_edge_core::can::{
    Assembler, Frame, Message, MonitorResult, NumberedReading, ResultAssembler, reading_frames, result_frames,
};

use super::Bytes;

/// A frame; what it says is the same after being written again, reserved bytes and NaN payloads apart.
pub fn message(bytes: &[u8]) {
    let frame = Bytes(bytes).frame();
    if let Ok((node, message)) = Message::decode(&frame) {
        let again = message.encode(node);
        let (node_again, message_again) = Message::decode(&again).expect("it was written here");
        assert_eq!((again.raw_id(), node_again), (frame.raw_id(), node));
        assert_eq!(format!("{message:?}"), format!("{message_again:?}"));
    }
}

/// A reading to within the bits of NaN.
fn shown(reading: &NumberedReading) -> String {
    format!("{reading:?}")
}

fn assembled(frames: &[Frame]) -> Option<NumberedReading> {
    let mut assembler = Assembler::new();
    frames.iter().filter_map(|frame| assembler.receive(u64::MAX, 0, frame)).last()
}

/// Frames at arbitrary times; a reading that comes out is the same after being sent again.
pub fn assembler(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (mut assembler, mut time_us) = (Assembler::new(), 0);
    while !bytes.is_empty() {
        time_us += u64::from(bytes.u8()) * 1000;
        assembler.poll(200_000, time_us);
        if let Some(reading) = assembler.receive(200_000, time_us, &bytes.frame()) {
            assert!((1..=8).contains(&reading.reading.probes().len()));
            let again = assembled(&reading_frames(3, &reading)).expect("it was written here");
            assert_eq!(shown(&reading), shown(&again));
        }
    }
}

/// Frames of a monitor; a result that comes out is the same after being sent again.
pub fn result_assembler(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut assembler = ResultAssembler::new();
    while !bytes.is_empty() {
        if let Some(result) = assembler.receive(&bytes.frame()) {
            let mut own = ResultAssembler::new();
            let again: Option<MonitorResult> =
                result_frames(3, &result).iter().filter_map(|frame| own.receive(frame)).last();
            assert_eq!(format!("{result:?}"), format!("{:?}", again.expect("it was written here")));
        }
    }
}
