use std::vec::Vec;

use embedded_can::{ExtendedId, Frame as _, Id, StandardId};

use super::*;
use crate::reading::{ProbeVector, Reading, probe_vectors};
use crate::residual::Bearing;

const TIMEOUT_US: u64 = 200_000;
const NODE: u8 = 5;

fn reading(number: u16) -> Reading {
    let first = f32::from(number);
    Reading { speed_rpm: 9000.0, probes: probe_vectors(&[first, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) }
}

fn frames(sequence: u16) -> Vec<Frame> {
    reading_frames(NODE, &NumberedReading::new(sequence, reading(sequence))).into_iter().collect()
}

/// Sequence numbers of the readings that came out whole, and what was counted.
fn feed(frames: impl IntoIterator<Item = Frame>) -> (Vec<u16>, Counters) {
    let mut assembler = Assembler::new();
    let mut whole = Vec::new();
    for frame in frames {
        if let Some(assembled) = assembler.receive(TIMEOUT_US, 0, &frame) {
            assert_eq!(assembled.reading, reading(assembled.sequence));
            whole.push(assembled.sequence);
        }
    }
    (whole, *assembler.counters())
}

fn without(mut frames: Vec<Frame>, place: usize) -> Vec<Frame> {
    frames.remove(place);
    frames
}

fn every_message() -> Vec<Message> {
    let mut messages = std::vec![
        Message::ReadingEnd { sequence: 7, count: 4, crc32: 0x1234_5678 },
        Message::Status { sequence: 9, flags: 15, suspect: Some(Bearing::Two), streak: 300 },
        Message::Status { sequence: 9, flags: 0, suspect: None, streak: 0 },
        Message::Unbalance { plane: 0, unbalance_g_mm: [1.5, -2.5] },
        Message::Unbalance { plane: 1, unbalance_g_mm: [1.5, -2.5] },
        Message::Static([3.0, 4.0]),
        Message::Dynamic([5.0, 6.0]),
        Message::Residual { e_um: 7.0, ratio: 0.125 },
        Message::ResultEnd { sequence: 7, count: 6, crc32: 0x8765_4321 },
        Message::Counters { repeated: 1, late: 2, incomplete: 3, stray: 4 },
        Message::Discards { skipped: 5, resynchronised: 6, overflowed: 7, unsolved: 8 },
    ];
    messages.extend([
        Message::Commands { accepted: 1, refused: 2, forged: 3, replayed: 4 },
        Message::Transfers { broken: 5, conflicts: 6, model_checksum: 0x89ab_cdef },
        Message::Version { protocol: 2, oldest: 1, model_schema: 1, shapes: 6 },
        Message::VersionQuery,
    ]);
    for keyphasor in [Keyphasor::NotStated, Keyphasor::Locked, Keyphasor::Missing, Keyphasor::Unsteady] {
        let (sequence, valid_mask, speed_rpm) = (0xabcd, 13, 11_000.5);
        messages.push(Message::ReadingStart { sequence, valid_mask, keyphasor, speed_rpm });
    }
    let states = [
        NodeState::Waiting,
        NodeState::Tracking,
        NodeState::Suspicious,
        NodeState::Flagged,
        NodeState::Conflict,
        NodeState::Listening,
    ];
    for state in states {
        messages.push(Message::Heartbeat { version: 1, state, readings: 65_535, lost: 1, rejected: 2 });
    }
    for probe in 0..4 {
        messages.push(Message::ProbeVector { probe, vector: ProbeVector { cos_um: 1.0, sin_um: -1.0 } });
    }
    messages
}

#[test]
fn every_message_comes_back_from_its_frame() {
    for message in every_message() {
        assert_eq!(Message::decode(&message.encode(NODE)), Ok((NODE, message)));
    }
}

#[test]
fn bytes_of_a_start_are_the_documented_ones() {
    let frame = Message::ReadingStart {
        sequence: 0x0102,
        valid_mask: 15,
        keyphasor: Keyphasor::NotStated,
        speed_rpm: 1.0,
    }
    .encode(3);
    assert_eq!(frame.raw_id(), 8 * 32 + 3);
    assert_eq!(frame.bytes(), [0x02, 0x01, 15, 0, 0, 0, 0x80, 0x3f]);
}

#[test]
fn identifiers_rise_in_the_order_of_sending_and_type_goes_before_node() {
    let ids: Vec<u16> = frames(1).iter().map(Frame::raw_id).collect();
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(frame_id(8, MAX_NODE) < frame_id(9, 0));
}

#[test]
fn unknown_short_and_impossible_frames_are_refused() {
    let frame = |message_type, bytes: &[u8]| Frame::standard(frame_id(message_type, NODE), bytes).unwrap();
    for message_type in (0..8).chain(14..16).chain(23..32).chain(37..62) {
        assert_eq!(Message::decode(&frame(message_type, &[0; 8])), Err(CanError::UnknownType));
    }
    assert_eq!(Message::decode(&frame(8, &[0; 7])), Err(CanError::WrongLength));
    assert_eq!(Message::decode(&frame(16, &[0, 0, 0, 3, 0, 0, 0, 0])), Err(CanError::BadValue));
    assert_eq!(Message::decode(&frame(32, &[1, 6, 0, 0, 0, 0, 0, 0])), Err(CanError::BadValue));
}

#[test]
fn the_frame_trait_takes_standard_data_frames_only() {
    let id = StandardId::new(0x123).unwrap();
    let frame = <Frame as embedded_can::Frame>::new(id, &[1, 2]).unwrap();
    assert_eq!((frame.id(), frame.dlc(), frame.data()), (Id::Standard(id), 2, &[1, 2][..]));
    assert!(<Frame as embedded_can::Frame>::new(ExtendedId::ZERO, &[]).is_none());
    assert!(Frame::new_remote(id, 2).is_none());
    assert!(Frame::standard(1, &[0; 9]).is_none());
}

#[test]
fn readings_in_order_all_arrive_across_the_wrap_of_the_sequence() {
    let (whole, counters) = feed([65_534, 65_535, 0, 1].into_iter().flat_map(frames));
    assert_eq!(whole, [65_534, 65_535, 0, 1]);
    assert_eq!(counters, Counters::default());
}

#[test]
fn any_order_of_the_vectors_will_do() {
    let mut shuffled = frames(3);
    shuffled.swap(1, 4);
    shuffled.swap(2, 3);
    assert_eq!(feed(shuffled).0, [3]);
}

#[test]
fn any_one_frame_lost_loses_its_reading_and_no_other() {
    for place in 0..READING_FRAMES {
        let stream = [frames(1), without(frames(2), place), frames(3)].concat();
        let (whole, counters) = feed(stream);
        assert_eq!(whole, [1, 3], "frame {place} lost");
        assert_eq!(counters.lost, 1);
        let stray = if place == 0 { 5 } else { 0 };
        assert_eq!(
            (counters.incomplete, counters.stray),
            (u16::from(place != 0), stray),
            "frame {place} lost"
        );
    }
}

#[test]
fn every_frame_twice_changes_nothing_but_the_stray_ends() {
    let doubled = (1..4).flat_map(frames).flat_map(|frame| [frame, frame]);
    let (whole, counters) = feed(doubled);
    assert_eq!(whole, [1, 2, 3]);
    assert_eq!(counters, Counters { stray: 3, ..Counters::default() });
}

#[test]
fn a_repeated_reading_is_counted_and_not_evaluated() {
    let (whole, counters) = feed([frames(1), frames(1), frames(2)].concat());
    assert_eq!(whole, [1, 2]);
    assert_eq!(counters, Counters { repeated: 1, ..Counters::default() });
}

#[test]
fn an_older_reading_is_late_and_a_jump_ahead_counts_what_it_left_out() {
    let (whole, counters) = feed([frames(10), frames(14), frames(12), frames(15)].concat());
    assert_eq!(whole, [10, 14, 15]);
    assert_eq!(counters, Counters { lost: 3, late: 1, ..Counters::default() });
}

#[test]
fn a_restarted_sender_is_followed_at_its_third_reading() {
    let (whole, counters) = feed([1000, 0, 1, 2, 3].into_iter().flat_map(frames));
    assert_eq!(whole, [1000, 2, 3]);
    assert_eq!(counters, Counters { late: 2, resynchronised: 1, ..Counters::default() });
}

#[test]
fn one_stale_reading_over_and_over_is_never_followed() {
    let (whole, counters) = feed([1000, 7, 7, 7, 7, 1001].into_iter().flat_map(frames));
    assert_eq!(whole, [1000, 1001]);
    assert_eq!(counters.late, 4);
}

#[test]
fn a_changed_byte_and_a_vector_of_another_reading_are_rejected() {
    for place in 0..READING_FRAMES - 1 {
        for byte in 0..8 {
            let mut stream = frames(1);
            let mut bytes = *stream[place].full_payload().unwrap();
            bytes[byte] ^= 1;
            stream[place] = Frame::standard(stream[place].raw_id(), &bytes).unwrap();
            let (whole, counters) = feed(stream);
            assert_eq!((whole, counters.rejected), (std::vec![], 1), "frame {place}, byte {byte}");
        }
    }
    let mut mixed = frames(2);
    mixed[1] = frames(1)[1];
    assert_eq!(feed(mixed).1.rejected, 1);
}

#[test]
fn a_reading_open_too_long_is_dropped_and_its_rest_is_stray() {
    let mut assembler = Assembler::new();
    let sent = frames(1);
    for frame in &sent[..3] {
        assembler.receive(TIMEOUT_US, 1_000, frame);
    }
    assembler.poll(TIMEOUT_US, 1_000 + TIMEOUT_US);
    assert_eq!(assembler.counters().incomplete, 0);
    assembler.poll(TIMEOUT_US, 1_001 + TIMEOUT_US);
    assert_eq!(assembler.counters().incomplete, 1);
    for frame in &sent[3..] {
        assert_eq!(assembler.receive(TIMEOUT_US, 2_000 + TIMEOUT_US, frame), None);
    }
    assert_eq!(assembler.counters().stray, 3);
}

#[test]
fn a_lost_probe_arrives_as_lost_by_its_mask_or_as_not_a_number() {
    let mut lost = reading(1);
    lost.probes[2] = ProbeVector::LOST;
    let mut assembler = Assembler::new();
    let mut whole = None;
    for frame in reading_frames(NODE, &NumberedReading::new(1, lost)) {
        whole = whole.or(assembler.receive(TIMEOUT_US, 0, &frame));
    }
    let probes = whole.unwrap().reading.probes;
    assert!(!probes[2].is_finite() && probes[3] == lost.probes[3]);
}

#[test]
fn checksum_is_that_of_zlib() {
    // Python: binascii.crc32(b"12345678") == 0x9AE0DAAF
    assert_eq!(crc32([*b"12345678"].iter()), 0x9ae0_daaf);
}

fn result(sequence: u16) -> MonitorResult {
    MonitorResult {
        sequence,
        flags: FLAG_FLAGGED | FLAG_AT_BOUND_2,
        suspect: Some(Bearing::One),
        streak: 4,
        unbalance_g_mm: [[1.0, 2.0], [3.0, 4.0]],
        static_g_mm: [4.0, 6.0],
        dynamic_g_mm: [-1.0, -1.0],
        e_um: 12.0,
        ratio: 0.25,
    }
}

#[test]
fn a_result_comes_back_from_its_frames_and_not_from_fewer() {
    let mut assembler = ResultAssembler::new();
    let sent = result_frames(NODE, &result(8));
    let got: Vec<_> = sent.iter().filter_map(|frame| assembler.receive(frame)).collect();
    assert_eq!(got, [result(8)]);
    for place in 0..RESULT_FRAMES {
        let mut assembler = ResultAssembler::new();
        let cut = without(sent.iter().copied().collect(), place);
        let next = result_frames(NODE, &result(9));
        let got: Vec<_> = cut.iter().chain(&next).filter_map(|frame| assembler.receive(frame)).collect();
        assert_eq!(got, [result(9)], "frame {place} lost");
        assert_eq!(assembler.damaged(), u16::from(place != 0));
    }
}
