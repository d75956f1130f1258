//! Bytes of each version of the wire formats: what was once sent is still understood, and means the same.
//!
//! The files in `tests/wire` come from the documented layouts by a script without any code of this project.

use rotor_edge_core::can::{Assembler, Frame, Keyphasor, Message, NodeState, ResultAssembler};
use rotor_edge_core::command::{Answer, Command, Key, Outcome, open_request};
use rotor_edge_core::model::{ForcingLaw, Model, ModelError, Pedestal};
use rotor_edge_core::reading::probe_vectors;
use rotor_edge_core::residual::Bearing;

const NODE: u8 = 7;
const KEY: Key = Key([0x11; 32]);

fn hex(text: &str) -> Vec<u8> {
    let digits: Vec<u32> = text.chars().filter_map(|c| c.to_digit(16)).collect();
    digits.chunks(2).map(|pair| (pair[0] * 16 + pair[1]) as u8).collect()
}

fn frames(text: &str) -> Vec<Frame> {
    let frame = |line: &str| {
        let (id, payload) = line.split_once('#').unwrap();
        Frame::standard(u16::from_str_radix(id, 16).unwrap(), &hex(payload)).unwrap()
    };
    text.lines().map(frame).collect()
}

/// Reading, result and the other messages of a version; each also encodes to the same bytes again.
fn understood(text: &str, keyphasor: Keyphasor) -> Vec<Message> {
    let (mut readings, mut results) = (Assembler::new(), ResultAssembler::new());
    let (mut reading, mut result, mut others) = (None, None, Vec::new());
    for frame in frames(text) {
        let (node, message) = Message::decode(&frame).unwrap();
        assert_eq!((node, message.encode(NODE)), (NODE, frame), "{message:?}");
        reading = reading.or(readings.receive(1_000_000, 0, &frame));
        result = result.or(results.receive(&frame));
        if frame.message_type() >= 32 {
            others.push(message);
        }
    }
    let reading = reading.expect("a whole reading");
    assert_eq!((reading.sequence, reading.keyphasor, reading.reading.speed_rpm), (513, keyphasor, 9000.5));
    let vectors = probe_vectors(&[1.5, 0.0, 2.5, -2.25, 3.5, -4.5, 4.5, -6.75]);
    assert_eq!(reading.reading.probes, vectors);
    let result = result.expect("a whole result");
    assert_eq!(
        (result.sequence, result.flags, result.suspect, result.streak),
        (513, 3, Some(Bearing::Two), 4)
    );
    assert_eq!(result.unbalance_g_mm, [[100.5, -200.25], [300.0, 0.125]]);
    assert_eq!((result.static_g_mm, result.dynamic_g_mm), ([400.5, -200.125], [-50.0, 25.5]));
    assert_eq!((result.e_um, result.ratio), (12.5, 0.375));
    others
}

fn heartbeat(version: u8) -> [Message; 3] {
    [
        Message::Heartbeat { version, state: NodeState::Flagged, readings: 1000, lost: 2, rejected: 3 },
        Message::Counters { repeated: 4, late: 5, incomplete: 6, stray: 7 },
        Message::Discards { skipped: 8, resynchronised: 9, overflowed: 10, unsolved: 11 },
    ]
}

#[test]
fn frames_of_protocol_1_mean_what_they_meant() {
    assert_eq!(understood(include_str!("wire/protocol-1.txt"), Keyphasor::NotStated), heartbeat(1));
}

#[test]
fn frames_of_protocol_2_mean_what_they_meant() {
    let mut expected = heartbeat(2).to_vec();
    expected.extend([
        Message::Commands { accepted: 12, refused: 13, forged: 14, replayed: 15 },
        Message::Transfers { broken: 16, conflicts: 17, model_checksum: 0xdead_beef },
        Message::Version { protocol: 2, oldest: 1, model_schema: 1, shapes: 6 },
        Message::VersionQuery,
    ]);
    assert_eq!(understood(include_str!("wire/protocol-2.txt"), Keyphasor::Locked), expected);
}

#[test]
fn a_model_of_schema_1_is_read_as_it_was_written() {
    let bytes = hex(include_str!("wire/model-1.hex"));
    let model = Model::<2>::decode(&bytes).unwrap();
    assert_eq!(model.mass[(0, 1)], 3.0);
    assert_eq!((model.planes[1][1], model.internal_damping_s), (0.6, 1e-6));
    let support = &model.supports[1];
    assert_eq!((support.stiffness_n_m[1][1], support.damping_n_s_m[0][0]), (5e6, 300.0));
    assert_eq!((support.mass_kg, support.stiffness_slope), (0.5, 0.25));
    assert_eq!((support.reference_speed_rad_s, support.hardening_per_um2), (600.0, 1e-5));
    let pedestal = Pedestal { stiffness_n_m: 1e8, damping_n_s_m: 1e4, mass_kg: 3.0 };
    assert_eq!((model.supports[0].pedestal, support.pedestal), (None, Some(pedestal)));
    let laws = [ForcingLaw::Constant, ForcingLaw::SpeedSquared];
    assert_eq!([model.forcings[0].law, model.forcings[1].law], laws);
    assert_eq!(model.forcings[1].amplitude, [9.0, 10.0]);
    assert_eq!((model.probes[3].direction, model.probes[3].runout_um), ([0.0, 1.0], [0.5, -0.5]));
    assert_eq!(model.initial_unbalance_g_mm, [[30.0, 40.0], [-10.0, 20.0]]);
    assert_eq!((model.unbalance_floor_g_mm, model.speed_range_rpm), (5.0, [600.0, 12_000.0]));
    let mut again = vec![0; bytes.len()];
    assert_eq!(model.encode(&mut again), Ok(bytes.len()));
    assert_eq!(again, bytes);
}

#[test]
fn a_request_and_an_answer_of_wire_version_1_are_confirmed() {
    let (request, answer) = (hex(include_str!("wire/request-1.hex")), hex(include_str!("wire/answer-1.hex")));
    let opened = open_request(&request, Some(&KEY), NODE, 0).unwrap();
    assert_eq!((opened.command, opened.counter), (Command::Deploy, 0x0102_0304_0506_0708));
    assert_eq!(opened.body, hex(include_str!("wire/model-1.hex")));
    let expected = Answer {
        node: NODE,
        command: 1,
        outcome: Outcome::Model,
        counter: 41,
        model_checksum: 0xdead_beef,
        model_error: Some(ModelError::IllConditioned),
    };
    assert_eq!(Answer::decode(&answer, &request, &KEY), Some((expected, true)));
    assert_eq!(expected.encode(&request, Some(&KEY)).as_slice(), answer);
}
