//! Items as rows.

use rusqlite::Row;
use rusqlite::types::Value;
use serde::Serialize;

use crate::item::{Body, Item};

/// Probes and planes that a row has columns for.
const PROBES: usize = 8;
const PLANES: usize = 4;

/// A row of the view `newest`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Newest {
    /// Number of its source in the store.
    pub source: i64,
    pub plant: String,
    pub bus: String,
    pub node: u8,
    /// Its last heartbeat, µs since 1970.
    pub heard_us: Option<i64>,
    /// Its state then.
    pub state: Option<String>,
    pub reason: Option<String>,
    /// What raised its flag, as it told when its state changed last.
    pub cause: Option<String>,
    /// When it told that it came into this state, µs since 1970; none if that was not heard.
    pub since_us: Option<i64>,
    /// Its last result, µs since 1970.
    pub result_us: Option<i64>,
    /// Whether the flag was up then.
    pub flagged: Option<bool>,
    /// Bearing suspected then, from 1; where that result suspects none, the one of its last change of state.
    pub suspect: Option<u8>,
    /// Residual then, µm.
    pub residual_um: Option<f64>,
    /// Residual over the sum of features then.
    pub ratio: Option<f64>,
}

impl Newest {
    pub(super) fn of(row: &Row) -> rusqlite::Result<Self> {
        Ok(Self {
            source: row.get("source")?,
            plant: row.get("plant")?,
            bus: row.get("bus")?,
            node: row.get("node")?,
            heard_us: row.get("heard_us")?,
            state: row.get("state")?,
            reason: row.get("reason")?,
            cause: row.get("cause")?,
            since_us: row.get("since_us")?,
            result_us: row.get("result_us")?,
            flagged: row.get("flagged")?,
            suspect: row.get("suspect")?,
            residual_um: row.get("residual_um")?,
            ratio: row.get("ratio")?,
        })
    }
}

/// A 32-bit number is one of 64 bits exactly.
fn real(value: Option<f32>) -> Value {
    value.map_or(Value::Null, |v| Value::Real(v.into()))
}

fn integer(value: impl Into<i64>) -> Value {
    Value::Integer(value.into())
}

/// As many pairs as a row has columns for.
fn pairs(given: &[[Option<f32>; 2]], columns: usize) -> impl Iterator<Item = Value> {
    let none = std::iter::repeat([None; 2]);
    given.iter().copied().chain(none).take(columns).flatten().map(real)
}

/// In the order of the columns of the item's table.
pub(crate) fn values(source: i64, item: &Item) -> Vec<Value> {
    let optional = |number: Option<u8>| number.map_or(Value::Null, integer);
    // an epoch is counted up from zero
    let epoch = Value::Integer(item.epoch as i64);
    let head = [
        Value::Integer(source),
        epoch,
        integer(item.sequence),
        integer(item.time_us),
        integer(item.is_clock_doubtful),
    ];
    let mut row = Vec::from(head);
    match &item.body {
        Body::Reading(reading) => {
            row.extend([
                real(reading.speed_rpm),
                reading.keyphasor.clone().into(),
                integer(reading.probes_um.len() as u32),
            ]);
            row.extend(pairs(&reading.probes_um, PROBES));
            row.extend(reading.gaps_v.iter().copied().chain(std::iter::repeat(None)).take(PROBES).map(real));
        }
        Body::Result(result) => {
            row.extend([integer(result.is_suspicious), integer(result.is_flagged), optional(result.suspect)]);
            row.extend([result.reason.clone().into(), integer(result.streak), integer(result.redundancy)]);
            row.extend([integer(result.used_mask), integer(result.planes_g_mm.len() as u32)]);
            row.extend(pairs(&result.planes_g_mm, PLANES));
            row.extend(pairs(&[result.static_g_mm, result.dynamic_g_mm], 2));
            row.extend([result.residual_um, result.ratio, result.floor_um, result.level_um].map(real));
        }
        Body::State(state) => {
            row.extend([
                state.state.clone().into(),
                state.reason.clone().into(),
                integer(state.missing_mask),
            ]);
            row.extend([state.cause.clone().into(), optional(state.suspect), real(state.age_s)]);
        }
        Body::Heartbeat(heartbeat) => {
            row.extend([
                integer(heartbeat.protocol),
                heartbeat.state.clone().into(),
                heartbeat.reason.clone().into(),
            ]);
            row.push(integer(heartbeat.readings));
        }
    }
    row
}
