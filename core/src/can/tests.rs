mod results;

use std::vec::Vec;

use embedded_can::{ExtendedId, Frame as _, Id, StandardId};

use super::*;
use crate::model::MAX_PLANES;
use crate::reading::{ProbeVector, Reading};
use crate::state::{NodeState, Reason, Status};

const TIMEOUT_US: u64 = 200_000;
const NODE: u8 = 5;
/// Frames of [`reading`].
const READING_FRAMES: usize = 6;

/// Four probes, no gap voltages.
fn reading(number: u16) -> Reading {
    probes(number, 4)
}

fn probes(number: u16, count: usize) -> Reading {
    let vector = |probe: usize| {
        let cos_um = f32::from(number) + probe as f32;
        ProbeVector { cos_um, sin_um: 1.0 - 2.0 * cos_um }
    };
    Reading::new(9000.0, &core::array::from_fn::<_, 8, _>(vector)[..count]).unwrap()
}

fn frames(sequence: u16) -> Vec<Frame> {
    numbered_frames(sequence, reading(sequence))
}

fn numbered_frames(sequence: u16, reading: Reading) -> Vec<Frame> {
    reading_frames(NODE, &NumberedReading { sequence, keyphasor: Keyphasor::NotStated, reading })
        .into_iter()
        .collect()
}

/// What an assembler makes of these frames alone.
fn assembled(frames: &[Frame]) -> (Option<Reading>, Counters) {
    let mut assembler = Assembler::new();
    let whole: Vec<_> = frames.iter().filter_map(|frame| assembler.receive(TIMEOUT_US, 0, frame)).collect();
    assert!(whole.len() < 2);
    (whole.first().map(|numbered| numbered.reading), *assembler.counters())
}

/// Equal, with NaN equal to NaN.
fn same(a: &Reading, b: &Reading) -> bool {
    let bits = |reading: &Reading| {
        let probes: Vec<_> =
            reading.probes().iter().map(|p| [p.cos_um, p.sin_um].map(f32::to_bits)).collect();
        let gaps: Vec<_> = reading.gaps_v().iter().map(|gap_v| gap_v.to_bits()).collect();
        (reading.speed_rpm.to_bits(), probes, gaps)
    };
    bits(a) == bits(b)
}

/// Sequence numbers of the readings that came out whole, and what was counted.
fn feed(frames: impl IntoIterator<Item = Frame>) -> (Vec<u16>, Counters) {
    let mut assembler = Assembler::new();
    let mut whole = Vec::new();
    for frame in frames {
        if let Some(assembled) = assembler.receive(TIMEOUT_US, 0, &frame) {
            assert!(same(&assembled.reading, &reading(assembled.sequence)));
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
        Message::ReadingEnd { sequence: 7, frames: 4, crc32: 0x1234_5678 },
        Message::Static([3.0, 4.0]),
        Message::Dynamic([5.0, 6.0]),
        Message::Residual { e_um: 7.0, ratio: 0.125 },
        Message::Limits { floor_um: 8.0, level_um: 9.5 },
        Message::ResultEnd { sequence: 7, frames: 6, crc32: 0x8765_4321 },
        Message::Model { checksum: 0x89ab_cdef, probes: 8, planes: 4, on_trial: true },
        Message::Version { protocol: 3, oldest: 3, model_schema: 2, shapes: 6, probes: 4, planes: 2 },
        Message::VersionQuery,
    ];
    for keyphasor in Keyphasor::ALL {
        let (sequence, valid_mask, speed_rpm) = (0xabcd, 13, 11_000.5);
        messages.push(Message::ReadingStart { sequence, valid_mask, keyphasor, probes: 8, speed_rpm });
    }
    for probe in 0..8 {
        messages.push(Message::ProbeVector { probe, vector: ProbeVector { cos_um: 1.0, sin_um: -1.0 } });
    }
    for group in 0..2 {
        messages.push(Message::Gaps { group, gaps_mv: [-9000, i16::MAX, GAP_NOT_STATED_MV, 0] });
    }
    for suspect in [None, Some(0), Some(14)] {
        let (sequence, flags, redundancy, streak) = (9, 63, 15, 300);
        let (used_mask, reason) = (0b1011_0111, Reason::Jump);
        messages.push(Message::Status { sequence, flags, suspect, redundancy, streak, used_mask, reason });
    }
    for plane in 0..4 {
        messages.push(Message::Unbalance { plane, unbalance_g_mm: [1.5, -2.5] });
    }
    for state in NodeState::ALL {
        let (reason, missing_mask, readings) = (Reason::Probes, 0x81, u32::MAX);
        messages.push(Message::Heartbeat { version: 3, state, reason, missing_mask, readings });
    }
    for cause in Reason::ALL.into_iter().chain([Reason::Unknown(30)]) {
        let (state, reason, missing_mask, age_s) = (NodeState::Flagged, Reason::Age, 3, f32::INFINITY);
        for suspect in [None, Some(0), Some(6)] {
            messages.push(Message::State(Status { state, reason, missing_mask, cause, suspect, age_s }));
        }
    }
    for pair in 0..COUNTER_PAIRS as u8 {
        messages.push(Message::Counters { pair, values: [1, u32::MAX] });
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
        keyphasor: Keyphasor::Missing,
        probes: 4,
        speed_rpm: 1.0,
    }
    .encode(3);
    assert_eq!(frame.raw_id(), 8 * 32 + 3);
    assert_eq!(frame.bytes(), [0x02, 0x01, 15, 0x42, 0, 0, 0x80, 0x3f]);
}

#[test]
fn identifiers_rise_in_sending_order_and_type_precedes_node() {
    let gaps = probes(1, 8).with_gaps_v(&[-9.0; 8]);
    let ids: Vec<u16> = numbered_frames(1, gaps).iter().map(Frame::raw_id).collect();
    assert_eq!(ids.len(), MAX_READING_FRAMES);
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(frame_id(8, MAX_NODE) < frame_id(9, 0));
}

#[test]
fn reason_of_a_newer_node_is_taken_with_its_number() {
    let frame = |message_type, bytes: &[u8]| Frame::standard(frame_id(message_type, NODE), bytes).unwrap();
    let heartbeat = Message::decode(&frame(TYPE_HEARTBEAT, &[3, 1, 200, 0, 0, 0, 0, 0]));
    let is_told = matches!(heartbeat, Ok((_, Message::Heartbeat { reason: Reason::Unknown(200), .. })));
    assert!(is_told, "{heartbeat:?}");
}

#[test]
fn unknown_short_and_impossible_frames_are_refused() {
    let frame = |message_type, bytes: &[u8]| Frame::standard(frame_id(message_type, NODE), bytes).unwrap();
    for message_type in (0..8).chain(30..32).chain(45..48).chain(50..62) {
        assert_eq!(Message::decode(&frame(message_type, &[0; 8])), Err(CanError::UnknownType));
    }
    assert_eq!(Message::decode(&frame(8, &[0; 7])), Err(CanError::WrongLength));
    for (message_type, bytes) in [
        (TYPE_READING_START, [0, 0, 0, 0x44, 0, 0, 0, 0]),
        (TYPE_HEARTBEAT, [3, 10, 0, 0, 0, 0, 0, 0]),
        (TYPE_STATE, [10, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        assert_eq!(Message::decode(&frame(message_type, &bytes)), Err(CanError::BadValue), "{bytes:?}");
    }
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
            (u32::from(place != 0), stray),
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
fn older_reading_is_late_and_jump_counts_missing_ones() {
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
    lost.lose(0b0100);
    let (whole, _) = assembled(&numbered_frames(1, lost));
    assert_eq!(whole.unwrap().valid_mask(), 0b1011);
    assert_eq!(whole.unwrap().probes()[3], lost.probes()[3]);
    let (sequence, keyphasor, speed_rpm) = (1, Keyphasor::Locked, 9000.0);
    let start = Message::ReadingStart { sequence, valid_mask: 0b01, keyphasor, probes: 2, speed_rpm };
    let vector = ProbeVector { cos_um: 1.0, sin_um: 2.0 };
    let mut sent: Vec<_> = core::iter::once(start)
        .chain((0..2).map(|probe| Message::ProbeVector { probe, vector }))
        .map(|message| message.encode(NODE))
        .collect();
    let crc32 = crc32(sent.iter().filter_map(Frame::full_payload));
    sent.push(Message::ReadingEnd { sequence, frames: 3, crc32 }.encode(NODE));
    assert_eq!(assembled(&sent).0.unwrap().valid_mask(), 0b01, "a value that the mask does not vouch for");
}

#[test]
fn readings_of_one_to_eight_probes_survive_and_loss_is_noticed() {
    for count in 1..=8 {
        let sent = numbered_frames(1, probes(1, count));
        assert_eq!(sent.len(), count + 2);
        let (whole, counters) = assembled(&sent);
        assert!(same(&whole.unwrap(), &probes(1, count)), "{count} probes");
        assert_eq!(counters, Counters::default());
        for place in 0..sent.len() {
            assert_eq!(assembled(&without(sent.clone(), place)).0, None, "{count} probes, frame {place}");
        }
    }
}

#[test]
fn gap_voltages_survive_within_half_a_millivolt() {
    let stated = [f32::NAN, -9.8765, f32::NAN, f32::NAN, f32::NAN, f32::NAN, f32::NAN, -40.0];
    for (gaps_v, groups) in [(&stated[..4], 1), (&stated[4..8], 1), (&stated[..], 2)] {
        let reading = probes(1, 8).with_gaps_v(gaps_v);
        let sent = numbered_frames(1, reading);
        assert_eq!(sent.len(), 10 + groups);
        let (whole, _) = assembled(&sent);
        for (got, want) in whole.unwrap().gaps_v().iter().zip(reading.gaps_v()) {
            let want = if *want < -32.767 { -32.767 } else { *want };
            assert!((got - want).abs() <= 0.000_51 || (got.is_nan() && want.is_nan()), "{got} {want}");
        }
        for place in 0..sent.len() {
            assert_eq!(assembled(&without(sent.clone(), place)).0, None, "frame {place}");
        }
    }
    let unstated = probes(1, 3).with_gaps_v(&[f32::INFINITY; 3]);
    assert_eq!(numbered_frames(1, unstated).len(), 5);
}

#[test]
fn impossible_probe_count_and_extra_vector_are_rejected() {
    for probes in [0, 1, 3, 9, 15] {
        let (sequence, keyphasor, speed_rpm) = (1, Keyphasor::Locked, 9000.0);
        let start = Message::ReadingStart { sequence, valid_mask: 0xff, keyphasor, probes, speed_rpm };
        let vector = ProbeVector { cos_um: 1.0, sin_um: 2.0 };
        let vectors = (0..2).map(|probe| Message::ProbeVector { probe, vector });
        let mut sent: Vec<_> =
            core::iter::once(start).chain(vectors).map(|message| message.encode(NODE)).collect();
        let crc32 = crc32(sent.iter().filter_map(Frame::full_payload));
        sent.push(Message::ReadingEnd { sequence, frames: 3, crc32 }.encode(NODE));
        let (whole, counters) = assembled(&sent);
        assert_eq!((whole.is_none(), counters.rejected), (true, 1), "{probes} probes");
    }
}

#[test]
fn checksum_is_that_of_zlib() {
    // Python: binascii.crc32(b"12345678") == 0x9AE0DAAF
    assert_eq!(crc32([*b"12345678"].iter()), 0x9ae0_daaf);
}
