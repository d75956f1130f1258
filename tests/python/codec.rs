//! The core's codec on standard input and output, for tests in other languages: `101#0700…` a line, what it means as JSON.
//!
//! `{"name", "node", "signals", "encoded"}` with the names of `core/rotor-edge.dbc`; a float is given as its 32 bits, and
//! `encoded` is what the core makes of the decoded message again. `{"error"}` if the core does not understand the frame.
//! The line `protocol` gives the version and every message type that the core knows.

use std::io::{BufRead, Write};

use rotor_edge::bus::counters::NAMES;
use rotor_edge_core::can::{
    CanError, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, Message, PROTOCOL_VERSION, flag_at_bound,
};
use rotor_edge_core::state::Status;
use serde_json::{Map, Value, json};

fn main() -> std::io::Result<()> {
    let mut answers = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let answer = match line?.as_str() {
            "protocol" => protocol(),
            frame => decode(frame),
        };
        writeln!(answers, "{answer}")?;
        answers.flush()?;
    }
    Ok(())
}

fn protocol() -> Value {
    let is_known = |message_type: &u8| {
        let frame = Frame::full(*message_type, 0, [0; 8]);
        frame.is_transfer() || frame.is_mac() || Message::decode(&frame) != Err(CanError::UnknownType)
    };
    json!({ "version": PROTOCOL_VERSION, "types": (0..64).filter(is_known).collect::<Vec<u8>>() })
}

fn decode(line: &str) -> Value {
    let Some(frame) = frame(line) else {
        return json!({ "error": format!("\"{line}\" is no frame, expected such as 101#0700") });
    };
    let (node, message) = match Message::decode(&frame) {
        Ok(decoded) => decoded,
        Err(e) => return json!({ "error": format!("{e:?}") }),
    };
    let (name, signals) = signals(&message);
    let again = message.encode(node);
    let bytes: String = again.bytes().iter().map(|byte| format!("{byte:02X}")).collect();
    let encoded = format!("{:03X}#{bytes}", again.raw_id());
    json!({ "name": name, "node": node, "signals": signals, "encoded": encoded })
}

fn frame(line: &str) -> Option<Frame> {
    let (id, digits) = line.split_once('#')?;
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..digits.len()).step_by(2).map(byte).collect();
    Frame::standard(u16::from_str_radix(id, 16).ok()?, &bytes?)
}

/// Name and signals of a message in the DBC file.
fn signals(message: &Message) -> (String, Value) {
    match *message {
        Message::ReadingStart { sequence, valid_mask, keyphasor, probes, speed_rpm } => {
            let mut signals =
                numbered(8, |probe| (format!("Probe{}Valid", probe + 1), valid_mask >> probe & 1));
            signals.extend([
                ("Sequence".into(), sequence.into()),
                ("Keyphasor".into(), (keyphasor as u8).into()),
                ("Probes".into(), probes.into()),
                ("Speed".into(), speed_rpm.to_bits().into()),
            ]);
            ("ReadingStart".into(), signals.into())
        }
        Message::ProbeVector { probe, vector } => {
            (format!("Probe{}", probe + 1), vector_signals([vector.cos_um, vector.sin_um]))
        }
        Message::Gaps { group, gaps_mv } => {
            let first = 4 * group + 1;
            let signals = numbered(4, |k| (format!("Gap{}", first + k), gaps_mv[usize::from(k)]));
            (format!("Gaps{first}To{}", first + 3), signals.into())
        }
        Message::ReadingEnd { sequence, frames, crc32 } => end("ReadingEnd", sequence, frames, crc32),
        Message::Status { sequence, flags, suspect, redundancy, streak, used_mask, reason } => {
            let flag = |bit: u8| u8::from(flags & bit != 0);
            let mut signals = numbered(4, |k| (format!("AtBound{}", k + 1), flag(flag_at_bound(k))));
            signals.extend([
                ("Sequence".into(), sequence.into()),
                ("Suspicious".into(), flag(FLAG_SUSPICIOUS).into()),
                ("Flagged".into(), flag(FLAG_FLAGGED).into()),
                ("Suspect".into(), from_one(suspect).into()),
                ("Redundancy".into(), redundancy.into()),
                ("Streak".into(), streak.into()),
                ("Used".into(), used_mask.into()),
                ("Reason".into(), reason.code().into()),
            ]);
            ("Status".into(), signals.into())
        }
        Message::Unbalance { plane, unbalance_g_mm } => {
            (format!("UnbalancePlane{}", plane + 1), vector_signals(unbalance_g_mm))
        }
        Message::Static(unbalance_g_mm) => ("StaticUnbalance".into(), vector_signals(unbalance_g_mm)),
        Message::Dynamic(unbalance_g_mm) => ("DynamicUnbalance".into(), vector_signals(unbalance_g_mm)),
        Message::Residual { e_um, ratio } => {
            ("Residual".into(), json!({ "Sum": e_um.to_bits(), "Ratio": ratio.to_bits() }))
        }
        Message::Limits { floor_um, level_um } => {
            ("Limits".into(), json!({ "Floor": floor_um.to_bits(), "Level": level_um.to_bits() }))
        }
        Message::ResultEnd { sequence, frames, crc32 } => end("ResultEnd", sequence, frames, crc32),
        Message::Heartbeat { version, state, reason, missing_mask, readings } => {
            let signals = json!({
                "Protocol": version,
                "State": state as u8,
                "Reason": reason.code(),
                "Missing": missing_mask,
                "Readings": readings,
            });
            ("Heartbeat".into(), signals)
        }
        Message::State(Status { state, reason, missing_mask, cause, suspect, age_s }) => {
            let signals = json!({
                "State": state as u8,
                "Reason": reason.code(),
                "Missing": missing_mask,
                "Cause": cause.code(),
                "CauseSuspect": from_one(suspect),
                "Age": age_s.to_bits(),
            });
            ("State".into(), signals)
        }
        Message::Counters { pair, values } => {
            let names = NAMES[usize::from(pair)].map(capitalised);
            (format!("Counters{}", pair + 1), names.into_iter().zip(values.map(Value::from)).collect())
        }
        Message::Model { checksum, probes, planes, on_trial } => {
            let signals = json!({
                "Checksum": checksum, "Probes": probes, "Planes": planes, "OnTrial": u8::from(on_trial),
            });
            ("Model".into(), signals)
        }
        Message::Version { protocol, oldest, model_schema, shapes, probes, planes } => {
            let signals = json!({
                "Protocol": protocol,
                "OldestProtocol": oldest,
                "ModelSchema": model_schema,
                "Shapes": shapes,
                "ProbesHeld": probes,
                "PlanesHeld": planes,
            });
            ("Version".into(), signals)
        }
        Message::VersionQuery => ("VersionQuery".into(), json!({})),
        message => panic!("{message:?} is not a message of this DBC file"),
    }
}

/// Signals that are there several times.
fn numbered<T: Into<Value>>(times: u8, signal: impl Fn(u8) -> (String, T)) -> Map<String, Value> {
    (0..times).map(signal).map(|(name, value)| (name, value.into())).collect()
}

/// A number from 0 as the file has it: from 1, and 0 for none.
fn from_one(number: Option<u8>) -> u8 {
    number.map_or(0, |number| number + 1)
}

fn capitalised(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}

fn end(name: &str, sequence: u16, frames: u8, crc32: u32) -> (String, Value) {
    (name.into(), json!({ "Sequence": sequence, "Frames": frames, "Checksum": crc32 }))
}

fn vector_signals([cos, sin]: [f32; 2]) -> Value {
    json!({ "Cos": cos.to_bits(), "Sin": sin.to_bits() })
}
