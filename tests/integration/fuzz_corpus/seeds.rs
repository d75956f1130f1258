//! Inputs from which a fuzzer finds the rest: what the formats were made for.

use std::collections::BTreeMap;

use rotor_edge_core::can::{COUNTER_PAIRS, Frame, Keyphasor, Message};
use rotor_edge_core::command::{Answer, Command, Detail, Outcome, write_request};
use rotor_edge_core::memory::Memory;
use rotor_edge_core::model::{Description, Forcing, ForcingLaw, Model, ModelError, Pedestal};
use rotor_edge_core::reading::ProbeVector;
use rotor_edge_core::state::{NodeState, Reason, Status};
use rotor_edge_core::thresholds::Thresholds;

use super::decoders::command::{KEY, NODE};
use super::decoders::model::{encoded, machine};

/// What the names of seeds begin with; other names are those of inputs that a fuzzer found.
pub const PREFIX: &str = "seed-";

type Named = (String, Vec<u8>);

/// The seeds of a target by the names of their files.
pub fn of(target: &str) -> BTreeMap<String, Vec<u8>> {
    let seeds: Vec<Named> = match target {
        "node" => nodes(),
        "memory" => memories(),
        "message" => messages(),
        "assembler" => assemblers(),
        "result_assembler" => results(),
        "isotp" => transfers(),
        "slcan" => lines(),
        "model" => models(),
        "request" => {
            vec![named("deploy", [&[0], &[5, 0, 0, 0, 0, 0, 0, 0][..], &[0; 8], &[9, 0, 1], b"body"])]
        }
        "answer" => answers(),
        "thresholds" => vec![named("default", [Thresholds::DEFAULT.encode()])],
        "extraction" => vec![named("turns", [&[40, 2, 100, 0, 0][..], &[0; 200], &[3; 90]])],
        _ => Vec::new(),
    };
    seeds.into_iter().collect()
}

fn named<const N: usize>(name: &str, parts: [impl AsRef<[u8]>; N]) -> Named {
    (format!("{PREFIX}{name}"), parts.iter().flat_map(|part| part.as_ref()).copied().collect())
}

/// As `Bytes::frame` reads it.
fn frame(frame: &Frame) -> Vec<u8> {
    [&frame.raw_id().to_le_bytes()[..], &[frame.bytes().len() as u8], frame.bytes()].concat()
}

fn messages() -> Vec<Named> {
    let status = Status {
        state: NodeState::Flagged,
        reason: Reason::Age,
        cause: Reason::Rise,
        suspect: Some(1),
        ..Status::default()
    };
    let vector = ProbeVector { cos_um: 1.0, sin_um: -2.0 };
    let all = [
        Message::ReadingStart {
            sequence: 1,
            valid_mask: 15,
            keyphasor: Keyphasor::Locked,
            probes: 4,
            speed_rpm: 9e3,
        },
        Message::ProbeVector { probe: 7, vector },
        Message::Gaps { group: 1, gaps_mv: [-9000, 0, 1, i16::MIN] },
        Message::ReadingEnd { sequence: 1, frames: 5, crc32: 77 },
        Message::Unbalance { plane: 3, unbalance_g_mm: [1.0, 2.0] },
        Message::Limits { floor_um: 0.5, level_um: f32::NAN },
        Message::ResultEnd { sequence: 1, frames: 7, crc32: 77 },
        Message::State(status),
        Message::Counters { pair: COUNTER_PAIRS as u8 - 1, values: [1, u32::MAX] },
        Message::Model { checksum: 1, probes: 4, planes: 2, on_trial: true },
        Message::VersionQuery,
    ];
    let name = |number: usize| format!("{number:02}");
    all.iter().enumerate().map(|(number, m)| named(&name(number), [frame(&m.encode(NODE))])).collect()
}

/// Speed, four probes, none lost, as `Bytes::reading` reads it.
fn reading(speed_rpm: u16) -> Vec<u8> {
    let parts: [i16; 8] = [800, -200, 150, 760, 420, 90, -60, 400];
    let vectors = parts.iter().flat_map(|part| part.to_le_bytes());
    speed_rpm.to_le_bytes().into_iter().chain([3]).chain(vectors).chain([0]).collect()
}

/// Two whole readings, one without its end, and a stray frame.
fn assemblers() -> Vec<Named> {
    let whole =
        |sequence: u8, disturbance: u8| [vec![1, sequence, 0], reading(9000), vec![disturbance]].concat();
    let query = [vec![0], frame(&Message::VersionQuery.encode(NODE))].concat();
    vec![named("readings", [whole(1, 0), whole(2, 0), whole(3, 1 + (5 << 2)), query])]
}

fn results() -> Vec<Named> {
    let numbers: Vec<u8> = (0..16).flat_map(|number| (number as f32).to_le_bytes()).collect();
    let whole =
        |disturbance: u8| [&[1][..], &numbers, &[7, 0, 3, 1, 4, 2, 0, 15, 10, 1, disturbance]].concat();
    vec![named("results", [whole(0), whole(2)])]
}

/// A first and a consecutive frame, then a message over a line that loses every fifth frame.
fn transfers() -> Vec<Named> {
    let steps = [&[2][..], &[8, 0x10, 14, 1, 2, 3, 4, 5, 6], &[8, 0x21, 7, 8, 9, 10, 11, 12, 13]].concat();
    let message: Vec<u8> = (0..200).collect();
    vec![named("whole", [&steps[..], &[0], &message]), named("lossy", [&steps[..], &[5], &message])]
}

fn lines() -> Vec<Named> {
    vec![named(
        "session",
        [b"C\rS6\rO\rt1233AABBCC\rt7FF80011223344556677\rV\rt0000\rr1230\rT000001231AA\r\x07"],
    )]
}

fn without_crc32(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.truncate(bytes.len() - 4);
    bytes
}

fn models() -> Vec<Named> {
    let plain = machine();
    let description = plain.description();
    let mut supports = description.supports.to_vec();
    supports[0].hardening_per_um2 = 1e-4;
    supports[1].pedestal =
        Some(Pedestal { stiffness_n_m: [2e8, 1e8], damping_n_s_m: [1e4; 2], mass_kg: [30.0, 20.0] });
    let mut probes = description.probes.to_vec();
    probes[3].mount = Some(1);
    let forcing =
        Forcing { shape: description.planes[0], amplitude: [1e3, -2e3], law: ForcingLaw::SpeedSquared };
    let rich = Model::<2, 8, 4>::new(&Description {
        internal_damping_s: 1e-5,
        supports: &supports,
        forcings: &[forcing],
        probes: &probes,
        masked: 0b0001,
        ..description
    })
    .expect("a machine");
    [("plain", encoded(&plain)), ("rich", encoded(&rich))]
        .into_iter()
        .map(|(name, bytes)| named(name, [without_crc32(bytes)]))
        .collect()
}

/// The request's end comes first, as `answer` takes it.
fn answers() -> Vec<Named> {
    let mut request = [0; 30];
    write_request(&mut request, &KEY, NODE, Command::GetThresholds, 5, &[]).expect("there is room");
    let answer = |outcome, detail, thresholds| {
        let answer =
            Answer { node: NODE, command: 5, outcome, counter: 5, model_checksum: 7, detail, thresholds };
        // another key: as it comes, it must not be confirmed
        [&request[..], &answer.encode(&request, None)].concat()
    };
    let size = Detail::Model { error: ModelError::Probes, asked: 8, held: 4 };
    vec![
        named("thresholds", [answer(Outcome::Accepted, Detail::None, Some(Thresholds::DEFAULT))]),
        named("size", [answer(Outcome::Model, size, None)]),
        named("forged", [answer(Outcome::Forged, Detail::None, None)]),
    ]
}

/// Of the machine's model, with two planes.
fn memory() -> Vec<u8> {
    let unbalance = [[3000.0, 4000.0], [-1000.0, 2000.0]];
    Memory::new(machine().checksum(), &Default::default(), &unbalance, &[6000.0; 4]).encode().to_vec()
}

fn memories() -> Vec<Named> {
    vec![named("learning", [without_crc32(memory())])]
}

/// A step's number, time and bytes, as `node` takes them.
fn nodes() -> Vec<Named> {
    const ANY: u8 = 0;
    const READING: u8 = 2;
    const COMMAND: u8 = 3;
    const POLL: u8 = 4;
    const SAVED: u8 = 5;
    const QUERY: u8 = 6;
    const RESTORE: u8 = 7;
    const LOAD: u8 = 8;
    const THRESHOLDS: u8 = 9;
    // 255 times 2^12 µs: about a second
    let step = |kind: u8, bytes: &[u8]| [&[kind | 0xc0, 255][..], bytes].concat();
    let a_reading = || step(READING, &[&[1][..], &reading(9000)].concat());
    let days: Vec<u8> = (0..40).flat_map(|_| a_reading()).collect();
    let command = |command: u8| [step(COMMAND, &[command, 1, 0, 0]), step(SAVED, &[0])].concat();
    let stored = without_crc32(memory());
    let restored = step(RESTORE, &[&[stored.len() as u8][..], &stored].concat());
    let set = Thresholds::DEFAULT.encode();
    let thresholds = step(THRESHOLDS, &[&[set.len() as u8][..], &set].concat());
    let heard = step(ANY, &frame(&Message::State(Status::default()).encode(NODE)));
    vec![
        named("tracks", [days.clone(), step(POLL, &[]), step(SAVED, &[0])]),
        named("commands", [days, command(0), command(1), command(2), command(3), command(4), a_reading()]),
        named(
            "restarts",
            [restored, thresholds, a_reading(), step(LOAD, &[15]), step(QUERY, &[]), step(LOAD, &[0])],
        ),
        named("conflict", [heard, a_reading(), step(POLL, &[]), step(QUERY, &[])]),
    ]
}
