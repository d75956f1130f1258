//! Bytes of each version of the wire formats: what was once sent is still understood, and means the same.
//!
//! The files in `tests/wire` come from the documented layouts by a script without any code of this project.

use rotor_edge_core::can::{
    Assembler, Counters, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, Keyphasor, Message, ResultAssembler,
    flag_at_bound,
};
use rotor_edge_core::command::{Answer, Command, Detail, Key, Outcome, open_request};
use rotor_edge_core::model::{ForcingLaw, Knot, KnotRange, Model, ModelError, Noise, Pedestal};
use rotor_edge_core::state::{NodeState, Reason, Status};
use rotor_edge_core::thresholds::Thresholds;

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

#[test]
fn protocol_3_frames_keep_meaning_and_encoding() {
    let (mut readings, mut results) = (Assembler::new(), ResultAssembler::new());
    let (mut reading, mut result, mut others) = (None, None, Vec::new());
    for frame in frames(include_str!("../wire/protocol-3.txt")) {
        let (node, message) = Message::decode(&frame).unwrap();
        assert_eq!((node, message.encode(NODE)), (NODE, frame), "{message:?}");
        reading = reading.or(readings.receive(1_000_000, 0, &frame));
        result = result.or(results.receive(&frame));
        if frame.message_type() >= 32 {
            others.push(message);
        }
    }
    let reading = reading.expect("a whole reading");
    assert_eq!((reading.sequence, reading.keyphasor), (513, Keyphasor::Locked));
    let reading = reading.reading;
    assert_eq!((reading.speed_rpm, reading.valid_mask()), (9000.5, 0b11101));
    for (probe, number) in reading.probes().iter().zip(0u8..).filter(|(_, number)| *number != 1) {
        let number = f32::from(number);
        assert_eq!((probe.cos_um, probe.sin_um), (1.5 + number, -2.25 * number));
    }
    let gaps_v = reading.gaps_v();
    assert_eq!([gaps_v[0], gaps_v[1], gaps_v[4]], [-9.0, -10.5, 0.125]);
    assert!(gaps_v.len() == 5 && gaps_v[2].is_nan() && gaps_v[3].is_nan());

    let result = result.expect("a whole result");
    assert_eq!((result.sequence, result.streak, result.suspect), (513, 4, Some(1)));
    assert_eq!(result.flags, FLAG_SUSPICIOUS | FLAG_FLAGGED | flag_at_bound(2));
    assert_eq!((result.redundancy, result.used_mask, result.reason), (2, 0b11101, Reason::Rise));
    assert_eq!(result.planes, 3);
    assert_eq!(result.unbalance_g_mm, [[100.5, -200.25], [300.0, 0.125], [-7.5, 8.0], [0.0; 2]]);
    assert_eq!((result.static_g_mm, result.dynamic_g_mm), ([400.5, -200.125], [-50.0, 25.5]));
    assert_eq!((result.e_um, result.ratio, result.floor_um, result.level_um), (12.5, 0.375, 3.25, 6.5));

    let (state, reason, missing_mask) = (NodeState::Flagged, Reason::Probes, 0b10);
    let mut expected = vec![
        Message::Heartbeat { version: 3, state, reason, missing_mask, readings: 100_000 },
        Message::State(Status {
            state,
            reason,
            missing_mask,
            cause: Reason::Rise,
            suspect: Some(1),
            age_s: 0.5,
        }),
    ];
    expected.extend((0..10).map(|pair| {
        let first = 70_000 + 2 * u32::from(pair);
        Message::Counters { pair, values: [first, first + 1] }
    }));
    expected.extend([
        Message::Model { checksum: 0xdead_beef, probes: 5, planes: 3, on_trial: false },
        Message::Version { protocol: 3, oldest: 3, model_schema: 2, shapes: 6, probes: 8, planes: 4 },
        Message::VersionQuery,
    ]);
    assert_eq!(others, expected);
}

#[test]
fn counters_of_protocol_3_have_their_places() {
    let mut counters = Counters::default();
    for frame in frames(include_str!("../wire/protocol-3.txt")) {
        if let Ok((_, Message::Counters { pair, values })) = Message::decode(&frame) {
            counters.set_pair(pair, values);
        }
    }
    let c = counters;
    let received = [c.lost, c.rejected, c.repeated, c.late, c.incomplete, c.stray, c.skipped];
    let others = [c.resynchronised, c.overflowed, c.unsolved, c.accepted, c.refused, c.forged, c.replayed];
    let last = [c.broken, c.conflicts, c.partial, c.unmodelled, c.unsaved, c.changes];
    assert!(received.into_iter().chain(others).chain(last).eq(70_000..70_020));
}

#[test]
fn a_model_of_schema_3_is_refused_by_name() {
    let bytes = hex(include_str!("../wire/model-3.hex"));
    assert_eq!(Model::<2, 4, 2>::decode(&bytes), Err(ModelError::Schema));
}

#[test]
fn a_model_of_schema_4_is_read_as_it_was_written() {
    let bytes = hex(include_str!("../wire/model-4.hex"));
    let model = Model::<2, 4, 2>::decode(&bytes).unwrap();
    let decoded = model.description();
    let shaft = decoded.shaft;
    assert_eq!((decoded.machine, shaft.forward_s2[1]), ([0xc0, 0xff, 0xee, 0x01], 1.5e-6));
    assert_eq!((shaft.backward_s2[0], shaft.springs_n_m.as_slice()), (5.5e-6, &[6e6, 7e6][..]));
    assert_eq!((decoded.planes[1][1], decoded.internal_damping_s, decoded.masked), (1.8e-4, 1e-6, 0b10));
    let support = &decoded.supports[1];
    assert_eq!((support.shape.forward[1], support.shape.backward[1]), (3e-4, 2.5e-4));
    assert_eq!((support.stiffness_n_m[1][1], support.damping_n_s_m[0][0]), (5e6, 300.0));
    assert_eq!((support.mass_kg, support.stiffness_slope), (0.5, 0.25));
    assert_eq!((support.reference_speed_rad_s, support.hardening_per_um2), (600.0, 1e-5));
    assert_eq!((decoded.supports[0].table, support.table), (None, Some(KnotRange { first: 0, count: 2 })));
    let pedestal = Pedestal { stiffness_n_m: [1e8, 2e8], damping_n_s_m: [1e4, 2e4], mass_kg: [3.0, 4.0] };
    assert_eq!((decoded.supports[0].pedestal, support.pedestal), (None, Some(pedestal)));
    let knot = Knot {
        speed_rad_s: 1000.0,
        stiffness_n_m: [[2e5, 1.0], [2.0, 2e5]],
        damping_n_s_m: [[10.0, 0.0], [0.0, 20.0]],
    };
    assert_eq!((decoded.knots.len(), decoded.knots[1]), (2, knot));
    let laws = [ForcingLaw::Constant, ForcingLaw::SpeedSquared];
    assert_eq!([decoded.forcings[0].law, decoded.forcings[1].law], laws);
    assert_eq!(decoded.forcings[1].amplitude, [9.0, 10.0]);
    assert_eq!((decoded.probes[1].direction, decoded.probes[1].runout_um), ([0.0, 1.0], [0.5, -0.5]));
    assert_eq!((decoded.probes[2].bearing, decoded.probes[2].mount), (1, Some(1)));
    assert_eq!(decoded.initial_unbalance_g_mm, &[[30.0, 40.0], [-10.0, 20.0]]);
    assert_eq!(
        (decoded.unbalance_floor_g_mm, decoded.noise),
        (5.0, Noise { relative: 0.0625, floor_um: 0.25 })
    );
    assert_eq!(decoded.speed_range_rpm, [600.0, 12_000.0]);
    let mut again = vec![0; bytes.len()];
    assert_eq!(model.encode(&mut again), Ok(bytes.len()));
    assert_eq!(again, bytes);
}

#[test]
fn a_request_and_answers_of_wire_version_2_are_confirmed() {
    let request = hex(include_str!("../wire/request-2.hex"));
    let opened = open_request(&request, Some(&KEY), NODE, 0).unwrap();
    assert_eq!((opened.command, opened.counter), (Command::SetThresholds, 0x0304_0506_0708));
    let thresholds = Thresholds {
        rise: 0.25,
        ratio_limit: 0.5,
        ratio_floor: 0.125,
        floor_um: 1.5,
        average_s: 2.0,
        persistence_s: 20.0,
        level_s: 86_400.0,
        learning_s: 90.0,
        growth: 1.25,
        growth_s: 43_200.0,
        age_limit_s: 30.0,
        gap_range_v: [-17.0, -3.0],
        persistence_readings: 4,
        learning_readings: 12,
    };
    assert_eq!(Thresholds::decode(opened.body), Ok(thresholds));
    assert_eq!(thresholds.encode(), opened.body);
    let refused = Answer {
        node: NODE,
        command: 1,
        outcome: Outcome::Model,
        counter: 41,
        model_checksum: 0xdead_beef,
        detail: Detail::Model { error: ModelError::Probes, asked: 8, held: 4 },
        thresholds: None,
    };
    let (outcome, detail) = (Outcome::Accepted, Detail::None);
    let told = Answer { command: 5, outcome, detail, thresholds: Some(thresholds), ..refused };
    for (bytes, expected) in
        [(include_str!("../wire/refusal-2.hex"), refused), (include_str!("../wire/answer-2.hex"), told)]
    {
        assert_eq!(Answer::decode(&hex(bytes), &request, &KEY), Some((expected, true)));
        assert_eq!(expected.encode(&request, Some(&KEY)).as_slice(), hex(bytes));
    }
}
