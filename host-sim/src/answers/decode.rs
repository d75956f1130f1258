//! Answer of `decode`.

use serde::Serialize;

use super::monitor_result::{StateChange, TimedResult};
use crate::bus::decoded::{DecodedLog, NodeRecord};
use crate::bus::mac::RefusalCounts;
use crate::bus::states::name;

/// Readings and results of a recorded log.
#[derive(Serialize)]
pub struct LogAnswer {
    pub frames: u64,
    pub ours: u64,
    pub torn: u64,
    /// What was not believed; null without a key.
    pub refused: Option<RefusalCounts>,
    pub nodes: Vec<LogNode>,
}

/// What one node was told and said.
#[derive(Serialize)]
pub struct LogNode {
    pub node: u8,
    pub readings: usize,
    pub heartbeats: u64,
    pub state: Option<String>,
    pub states: Vec<StateChange>,
    pub counters: LogCounters,
    pub results: Vec<TimedResult>,
}

/// What became of what was recorded.
#[derive(Serialize)]
pub struct LogCounters {
    pub lost: u32,
    pub rejected: u32,
    pub repeated: u32,
    pub late: u32,
    pub incomplete: u32,
    pub stray: u32,
    pub damaged_results: u16,
}

impl LogAnswer {
    pub fn of(all: &DecodedLog) -> Self {
        let nodes = all.nodes.iter().map(|(number, record)| LogNode::of(*number, record, all.start_us));
        let DecodedLog { frames, ours, torn, .. } = *all;
        Self { frames, ours, torn, refused: all.refused(), nodes: nodes.collect() }
    }
}

impl LogNode {
    fn of(node: u8, record: &NodeRecord, start_us: u64) -> Self {
        let c = record.assembler.counters();
        Self {
            node,
            readings: record.readings.len(),
            heartbeats: record.heartbeats,
            state: record.states.last().map(|timed| name(timed.what.state)),
            states: StateChange::all(&record.states, start_us),
            counters: LogCounters {
                lost: c.lost,
                rejected: c.rejected,
                repeated: c.repeated,
                late: c.late,
                incomplete: c.incomplete,
                stray: c.stray,
                damaged_results: record.result_assembler.damaged(),
            },
            results: record.results.iter().map(|timed| TimedResult::of(timed, start_us)).collect(),
        }
    }
}
