use std::vec::Vec;

use super::*;
use crate::can::{MonitorResult, NumberedReading, reading_frames, result_frames};
use crate::model::MAX_PLANES;
use crate::reading::{ProbeVector, Reading};
use crate::state::Reason;

const KEY: Key = Key([9; 32]);
const NODE: u8 = 4;
const FRESH: u64 = 1_700_000_000_000_000;
const TIMEOUT_US: u64 = 200_000;

fn reading(sequence: u16) -> Vec<Frame> {
    let vector = ProbeVector { cos_um: 1.5, sin_um: -2.0 };
    let reading = Reading::new(9000.0, &[vector; 4]).unwrap().with_gaps_v(&[-9.0; 4]);
    reading_frames(NODE, &NumberedReading::new(sequence, reading)).into_iter().collect()
}

fn result() -> Vec<Frame> {
    let result = MonitorResult {
        sequence: 7,
        flags: 0,
        suspect: None,
        redundancy: 4,
        streak: 0,
        used_mask: 15,
        reason: Reason::None,
        planes: 2,
        unbalance_g_mm: [[3.0, 4.0]; MAX_PLANES],
        static_g_mm: [6.0, 8.0],
        dynamic_g_mm: [0.0; 2],
        e_um: 0.1,
        ratio: 0.01,
        floor_um: 0.2,
        level_um: 0.1,
    };
    result_frames(NODE, &result).into_iter().collect()
}

fn authenticated(direction: Direction, nonce: u64, mut group: Vec<Frame>) -> Vec<Frame> {
    group.extend(mac_frames(&KEY, direction, NODE, nonce, &group));
    group
}

/// What the last of these frames leads to, or the first error.
fn heard(gate: &mut Gate, frames: &[Frame]) -> Result<Option<Group>, MacError> {
    let mut last = Ok(None);
    for frame in frames {
        last = Ok(gate.receive(&KEY, TIMEOUT_US, 0, frame)?);
    }
    last
}

fn to_node(last: u64) -> Gate {
    Gate::new(Direction::ToNode, last)
}

#[test]
fn flipped_bit_in_authenticated_reading_is_refused() {
    for (direction, group) in [(Direction::ToNode, reading(7)), (Direction::ToHost, result())] {
        let whole = authenticated(direction, FRESH, group);
        assert!(heard(&mut Gate::new(direction, 0), &whole).unwrap().is_some());
        for (place, frame) in whole.iter().enumerate() {
            for bit in 0..64 + 11 {
                let mut payload = *frame.full_payload().unwrap();
                let mut id = frame.raw_id();
                match bit {
                    0..64 => payload[bit / 8] ^= 1 << (bit % 8),
                    _ => id ^= 1 << (bit - 64),
                }
                let mut changed = whole.clone();
                changed[place] = Frame::standard(id, &payload).unwrap();
                // a gate is given the frames of its own node
                changed.retain(|frame| frame.node() == NODE);
                let taken = heard(&mut Gate::new(direction, 0), &changed);
                assert!(!matches!(taken, Ok(Some(_))), "frame {place}, bit {bit}: {taken:?}");
            }
        }
    }
}

#[test]
fn another_key_node_direction_or_command_code_is_forged() {
    let (group, mut gate) = (reading(7), to_node(0));
    let with = |mac: [Frame; 2]| [&group[..], &mac].concat();
    let other = mac_frames(&Key([8; 32]), Direction::ToNode, NODE, FRESH, &group);
    assert_eq!(heard(&mut gate, &with(other)), Err(MacError::Forged));
    // the code of another direction and that of another node, under the identifiers that are expected
    for [head, code] in [
        mac_frames(&KEY, Direction::ToHost, NODE, FRESH, &group),
        mac_frames(&KEY, Direction::ToNode, NODE + 1, FRESH, &group),
    ] {
        let moved = |frame: Frame, kind| Frame::full(kind, NODE, *frame.full_payload().unwrap());
        let mac = [moved(head, TYPE_READING_NONCE), moved(code, TYPE_READING_CODE)];
        assert_eq!(heard(&mut gate, &with(mac)), Err(MacError::Forged));
    }
    assert_eq!(gate.last(), 0);
}

#[test]
fn nonce_only_grows_and_a_recording_is_told_from_a_forgery() {
    let mut gate = to_node(FRESH);
    for (nonce, expected) in [
        (FRESH, Err(MacError::Replayed)),
        (FRESH - 1, Err(MacError::Replayed)),
        (FRESH + 1, Ok(true)),
        (FRESH + 1, Err(MacError::Replayed)),
        (MAX_NONCE, Ok(true)),
        (u64::MAX, Err(MacError::Replayed)),
    ] {
        let taken = heard(&mut gate, &authenticated(Direction::ToNode, nonce, reading(7)));
        assert_eq!(taken.map(|group| group.is_some()), expected, "{nonce}");
    }
    gate.raise(0);
    assert_eq!(gate.last(), MAX_NONCE);
}

#[test]
fn each_lost_frame_costs_its_group_alone_and_is_no_forgery() {
    let first = authenticated(Direction::ToNode, FRESH, reading(7));
    let second = authenticated(Direction::ToNode, FRESH + 1, reading(8));
    for lost in 0..first.len() {
        let mut gate = to_node(0);
        let mut frames = first.clone();
        frames.remove(lost);
        let errors: Vec<MacError> =
            frames.iter().filter_map(|frame| gate.receive(&KEY, TIMEOUT_US, 0, frame).err()).collect();
        // without its last frame it waits, until the next one begins
        let is_told = lost + 1 < first.len();
        assert_eq!(errors, [MacError::Incomplete].repeat(usize::from(is_told)), "frame {lost}");
        let outcomes: Vec<_> = second.iter().map(|frame| gate.receive(&KEY, TIMEOUT_US, 0, frame)).collect();
        let errors = outcomes.iter().filter(|outcome| outcome.is_err()).count();
        assert_eq!(errors, usize::from(!is_told), "frame {lost}");
        assert!(matches!(outcomes.last(), Some(Ok(Some(_)))), "frame {lost}");
    }
}

#[test]
fn duplicate_or_reordered_frames_before_code_are_harmless() {
    let whole = authenticated(Direction::ToNode, FRESH, reading(7));
    let twice: Vec<Frame> = whole.iter().flat_map(|frame| [*frame, *frame]).collect();
    let taken = |frames: &[Frame]| {
        let mut gate = to_node(0);
        let outcomes: Vec<_> = frames.iter().map(|frame| gate.receive(&KEY, TIMEOUT_US, 0, frame)).collect();
        assert!(outcomes.iter().all(Result::is_ok), "{outcomes:?}");
        outcomes.into_iter().filter_map(|outcome| outcome.ok().flatten()).count()
    };
    assert_eq!(taken(&twice), 1);
    let mut turned = whole.clone();
    let (start, end) = (1, whole.len() - 1);
    turned[start..end].reverse();
    assert_eq!(taken(&turned), 1);
}

#[test]
fn a_group_kept_back_for_longer_than_the_time_out_is_incomplete() {
    let whole = authenticated(Direction::ToNode, FRESH, reading(7));
    let (code, before) = whole.split_last().unwrap();
    for (late_us, expected) in [(TIMEOUT_US, Ok(true)), (TIMEOUT_US + 1, Err(MacError::Incomplete))] {
        let mut gate = to_node(0);
        assert_eq!(heard(&mut gate, before), Ok(None));
        let taken = gate.receive(&KEY, TIMEOUT_US, late_us, code);
        assert_eq!(taken.map(|group| group.is_some()), expected);
    }
}

#[test]
fn a_state_is_a_group_of_its_own_or_part_of_its_heartbeat() {
    let frame = |kind| Frame::full(kind, NODE, [1; 8]);
    let heartbeat: Vec<Frame> = (TYPE_HEARTBEAT..=TYPE_MODEL).map(frame).collect();
    let mut gate = Gate::new(Direction::ToHost, 0);
    for (nonce, group) in
        (1..).zip([std::vec![frame(TYPE_STATE)], heartbeat.clone(), result(), std::vec![frame(TYPE_STATE)]])
    {
        let taken = heard(&mut gate, &authenticated(Direction::ToHost, nonce, group.clone()));
        assert_eq!(taken.unwrap().unwrap().as_slice(), group);
    }
    assert_eq!(heartbeat.len(), MAX_GROUP_FRAMES);
}

#[test]
fn guesses_have_one_attempt_for_each_group() {
    let whole = authenticated(Direction::ToNode, FRESH, reading(7));
    let (code, before) = whole.split_last().unwrap();
    let mut gate = to_node(0);
    assert_eq!(heard(&mut gate, before), Ok(None));
    let guess = Frame::full(TYPE_READING_CODE, NODE, [0; 8]);
    assert_eq!(gate.receive(&KEY, TIMEOUT_US, 0, &guess), Err(MacError::Forged));
    assert_eq!(gate.receive(&KEY, TIMEOUT_US, 0, code), Ok(None), "not even the right one counts then");
}

#[test]
fn a_code_is_as_documented() {
    // Python: hmac.digest(bytes([9] * 32), b"rotor-edge seal" + bytes.fromhex("0401" + "01" * 8 + "c403" + "01" + "02" + "00" * 6), "sha256")[:8]
    let group = [Frame::full(TYPE_READING_START, NODE, [1; 8])];
    let [head, code] = mac_frames(&KEY, Direction::ToNode, NODE, 2, &group);
    assert_eq!((head.raw_id(), head.bytes()), (0x3c4, &[1, 2, 0, 0, 0, 0, 0, 0][..]));
    assert_eq!((code.raw_id(), code.bytes()), (0x3e4, &PYTHON[..]));
}

const PYTHON: [u8; 8] = [0x8e, 0xa8, 0xb4, 0x5d, 0x19, 0x6a, 0x42, 0x16];
