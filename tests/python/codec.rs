//! The core's codec on standard input and output, for tests in other languages: `101#0700…` a line, what it means as JSON.
//!
//! `{"name", "node", "signals", "encoded"}` with the names of `core/rotor-edge.dbc`; a float is given as its 32 bits, and
//! `encoded` is what the core makes of the decoded message again. `{"error"}` if the core does not understand the frame.
//! The line `protocol` gives the version and every message type that the core knows.

use std::io::{BufRead, Write};

use rotor_edge_core::can::{
    CanError, FLAG_AT_BOUND_1, FLAG_AT_BOUND_2, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, Message,
    PROTOCOL_VERSION, TYPE_TO_HOST, TYPE_TO_NODE,
};
use rotor_edge_core::residual::Bearing;
use serde_json::{Value, json};

const PROBES: [&str; 4] = ["Probe1X", "Probe1Y", "Probe2X", "Probe2Y"];
const PLANES: [&str; 2] = ["UnbalancePlane1", "UnbalancePlane2"];

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
        [TYPE_TO_NODE, TYPE_TO_HOST].contains(message_type)
            || Message::decode(&frame) != Err(CanError::UnknownType)
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
fn signals(message: &Message) -> (&'static str, Value) {
    match *message {
        Message::ReadingStart { sequence, valid_mask, keyphasor, speed_rpm } => {
            let valid = |probe: u8| valid_mask >> probe & 1;
            let signals = json!({
                "Sequence": sequence,
                "Probe1XValid": valid(0),
                "Probe1YValid": valid(1),
                "Probe2XValid": valid(2),
                "Probe2YValid": valid(3),
                "Keyphasor": keyphasor as u8,
                "Speed": speed_rpm.to_bits(),
            });
            ("ReadingStart", signals)
        }
        Message::ProbeVector { probe, vector } => {
            (PROBES[usize::from(probe)], vector_signals([vector.cos_um, vector.sin_um]))
        }
        Message::ReadingEnd { sequence, count, crc32 } => {
            ("ReadingEnd", json!({ "Sequence": sequence, "Vectors": count, "Checksum": crc32 }))
        }
        Message::Status { sequence, flags, suspect, streak } => {
            let flag = |bit: u8| u8::from(flags & bit != 0);
            let signals = json!({
                "Sequence": sequence,
                "Suspicious": flag(FLAG_SUSPICIOUS),
                "Flagged": flag(FLAG_FLAGGED),
                "AtBound1": flag(FLAG_AT_BOUND_1),
                "AtBound2": flag(FLAG_AT_BOUND_2),
                "Suspect": suspect.map_or(0, |bearing| match bearing {
                    Bearing::One => 1,
                    Bearing::Two => 2,
                }),
                "Streak": streak,
            });
            ("Status", signals)
        }
        Message::Unbalance { plane, unbalance_g_mm } => {
            (PLANES[usize::from(plane)], vector_signals(unbalance_g_mm))
        }
        Message::Static(unbalance_g_mm) => ("StaticUnbalance", vector_signals(unbalance_g_mm)),
        Message::Dynamic(unbalance_g_mm) => ("DynamicUnbalance", vector_signals(unbalance_g_mm)),
        Message::Residual { e_um, ratio } => {
            ("Residual", json!({ "Sum": e_um.to_bits(), "Ratio": ratio.to_bits() }))
        }
        Message::ResultEnd { sequence, count, crc32 } => {
            ("ResultEnd", json!({ "Sequence": sequence, "Frames": count, "Checksum": crc32 }))
        }
        Message::Heartbeat { version, state, readings, lost, rejected } => {
            let signals = json!({
                "Protocol": version,
                "State": state as u8,
                "Readings": readings,
                "Lost": lost,
                "Rejected": rejected,
            });
            ("Heartbeat", signals)
        }
        Message::Counters { repeated, late, incomplete, stray } => {
            let signals =
                json!({ "Repeated": repeated, "Late": late, "Incomplete": incomplete, "Stray": stray });
            ("Counters", signals)
        }
        Message::Discards { skipped, resynchronised, overflowed, unsolved } => {
            let signals = json!({
                "Skipped": skipped,
                "Resynchronised": resynchronised,
                "Overflowed": overflowed,
                "Unsolved": unsolved,
            });
            ("Discards", signals)
        }
        Message::Commands { accepted, refused, forged, replayed } => {
            let signals =
                json!({ "Accepted": accepted, "Refused": refused, "Forged": forged, "Replayed": replayed });
            ("Commands", signals)
        }
        Message::Transfers { broken, conflicts, model_checksum } => {
            let signals =
                json!({ "Broken": broken, "Conflicts": conflicts, "ModelChecksum": model_checksum });
            ("Transfers", signals)
        }
        Message::Version { protocol, oldest, model_schema, shapes } => {
            let signals = json!({
                "Protocol": protocol,
                "OldestProtocol": oldest,
                "ModelSchema": model_schema,
                "Shapes": shapes,
            });
            ("Version", signals)
        }
        Message::VersionQuery => ("VersionQuery", json!({})),
    }
}

fn vector_signals([cos, sin]: [f32; 2]) -> Value {
    json!({ "Cos": cos.to_bits(), "Sin": sin.to_bits() })
}
