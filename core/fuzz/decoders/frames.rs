//! Messages, readings and results.

use rotor_edge_core::can::{
    Assembler, Frame, Message, MonitorResult, NumberedReading, ResultAssembler, reading_frames, result_frames,
};
use rotor_edge_core::state::Reason;

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

/// Frames that belong together, one of them left out, changed or moved to the end; in order as they are for `what` zero.
fn disturbed(frames: &[Frame], bytes: &mut Bytes) -> Vec<Frame> {
    let mut frames = frames.to_vec();
    let what = bytes.u8();
    let at = usize::from(what >> 2) % frames.len();
    match what % 4 {
        1 => drop(frames.remove(at)),
        2 => frames[at] = bytes.frame(),
        3 => {
            let late = frames.remove(at);
            frames.push(late);
        }
        _ => {}
    }
    frames
}

/// Single frames and whole readings at arbitrary times; a reading that comes out is the same after being sent again.
pub fn assembler(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (mut assembler, mut time_us) = (Assembler::new(), 0);
    while !bytes.is_empty() {
        let step = bytes.u8();
        time_us += u64::from(step) * 1000;
        let frames = match step % 2 {
            0 => vec![bytes.frame()],
            _ => {
                let reading = NumberedReading::new(bytes.u16(), bytes.reading());
                disturbed(&reading_frames(3, &reading), &mut bytes)
            }
        };
        assembler.poll(200_000, time_us);
        for frame in frames {
            if let Some(reading) = assembler.receive(200_000, time_us, &frame) {
                assert!((1..=8).contains(&reading.reading.probes().len()));
                let again = assembled(&reading_frames(3, &reading)).expect("it was written here");
                assert_eq!(shown(&reading), shown(&again));
            }
        }
    }
}

fn result(bytes: &mut Bytes) -> MonitorResult {
    let mut pair = || [bytes.f32(), bytes.f32()];
    let (unbalance_g_mm, static_g_mm, dynamic_g_mm) = ([pair(), pair(), pair(), pair()], pair(), pair());
    let ([e_um, ratio], [floor_um, level_um]) = (pair(), pair());
    MonitorResult {
        sequence: bytes.u16(),
        flags: bytes.u8(),
        suspect: Some(bytes.u8()).filter(|suspect| *suspect < 8),
        redundancy: bytes.u8() & 0xf,
        streak: bytes.u16(),
        used_mask: bytes.u8(),
        reason: Reason::from_code(bytes.u8()),
        planes: 1 + bytes.u8() % 4,
        unbalance_g_mm,
        static_g_mm,
        dynamic_g_mm,
        e_um,
        ratio,
        floor_um,
        level_um,
    }
}

/// Single frames and whole results; a result that comes out is the same after being sent again.
pub fn result_assembler(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut assembler = ResultAssembler::new();
    while !bytes.is_empty() {
        let frames = match bytes.u8() % 2 {
            0 => vec![bytes.frame()],
            _ => disturbed(&result_frames(3, &result(&mut bytes)), &mut bytes),
        };
        for result in frames.iter().filter_map(|frame| assembler.receive(frame)) {
            let mut own = ResultAssembler::new();
            let again: Option<MonitorResult> =
                result_frames(3, &result).iter().filter_map(|frame| own.receive(frame)).last();
            assert_eq!(format!("{result:?}"), format!("{:?}", again.expect("it was written here")));
        }
    }
}
