//! A recording, put together: the readings and results of every node in it.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use rotor_edge_core::can::{Assembler, Frame, Message, MonitorResult, PROTOCOL_VERSION, ResultAssembler};
use rotor_edge_core::model::Pair;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::Reading;

use super::log::{LogEntry, LogLine};
use super::mac::{Checker, RefusalCounts};
use super::states::States;
pub use super::timed::Timed;

/// The unbalance of the planes that a result has, g·mm.
pub fn planes_of(result: &MonitorResult) -> &[Pair] {
    let planes = usize::from(result.planes).min(result.unbalance_g_mm.len());
    &result.unbalance_g_mm[..planes]
}

/// The decimal number that was meant: the shortest that is this f32.
pub fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| f64::from(value))
}

/// All that one node was told and said.
#[derive(Debug, Clone, Default)]
pub struct NodeRecord {
    pub readings: Vec<Timed<Reading>>,
    pub results: Vec<Timed<MonitorResult>>,
    /// Heartbeats of this version of the protocol.
    pub heartbeats: u64,
    /// What it said of itself.
    pub states: States,
    /// Puts readings together and counts what became of them.
    pub assembler: Assembler,
    /// Puts results together and counts those that were damaged.
    pub result_assembler: ResultAssembler,
}

impl NodeRecord {
    fn take(&mut self, node: u8, time_us: u64, frame: &Frame) {
        let timeout_us = NodeConfig::new(node).reading_timeout_us;
        if let Some(whole) = self.assembler.receive(timeout_us, time_us, frame) {
            self.readings.push(Timed { time_us, what: whole.reading });
        }
        if let Some(what) = self.result_assembler.receive(frame) {
            self.results.push(Timed { time_us, what });
        }
        if let Ok((_, message)) = Message::decode(frame) {
            self.heartbeats +=
                u64::from(matches!(message, Message::Heartbeat { version: PROTOCOL_VERSION, .. }));
            self.states.take(time_us, &message);
        }
    }

    /// Whether anything of it can only come from our protocol: a checksum that fits, or a heartbeat.
    fn is_ours(&self) -> bool {
        !self.readings.is_empty() || !self.results.is_empty() || self.heartbeats > 0
    }
}

#[derive(Debug, Clone, Default)]
pub struct DecodedLog {
    /// By number of the monitor.
    pub nodes: BTreeMap<u8, NodeRecord>,
    /// Whole lines of the log.
    pub frames: u64,
    /// Of these, messages of our protocol.
    pub ours: u64,
    /// Lines that were torn, by a loss of power for one, and passed over.
    pub torn: u64,
    /// Time of the first line, µs.
    pub start_us: u64,
    channel: Option<String>,
    checker: Option<Checker>,
}

impl DecodedLog {
    /// Puts a log together; `name` is for messages.
    ///
    /// # Errors
    /// One sentence if no more lines are whole than torn, if nothing in the log is ours, or if it holds several buses.
    pub fn of(log: impl Iterator<Item = Result<LogLine>>, name: &str) -> Result<Self> {
        Self::checked(log, name, None)
    }

    /// The same; of the checker's monitor only what bears a right MAC.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn checked(
        log: impl Iterator<Item = Result<LogLine>>,
        name: &str,
        checker: Option<Checker>,
    ) -> Result<Self> {
        let mut all = Self { checker, ..Self::default() };
        let mut first_torn = None;
        for line in log {
            match line? {
                LogLine::Whole(logged) => all.take(logged, name)?,
                LogLine::Torn(why) => {
                    all.torn += 1;
                    first_torn.get_or_insert(why);
                }
            }
        }
        if let Some(why) = first_torn.filter(|_| all.torn >= all.frames) {
            bail!(why);
        }
        all.nodes.retain(|_, record| record.is_ours());
        match (all.frames, all.nodes.is_empty()) {
            (0, _) => bail!("{name}: the log holds no frame"),
            (_, true) if all.refused().is_some_and(|refused| refused.any()) => {
                bail!(
                    "{name}: no frame of the log has a valid message authentication code (MAC), expected the key of its monitor; {}",
                    all.refused().unwrap_or_default()
                )
            }
            (frames, true) => bail!(
                "{name}: a log of another protocol: none of its {frames} frames completes a reading, a result or a heartbeat of rotor-edge"
            ),
            _ => Ok(all),
        }
    }

    /// What was not believed; `None` where no MACs were checked.
    pub fn refused(&self) -> Option<RefusalCounts> {
        self.checker.as_ref().map(Checker::refused)
    }

    fn take(&mut self, logged: LogEntry, name: &str) -> Result<()> {
        if self.frames == 0 {
            self.start_us = logged.time_us;
        }
        self.frames += 1;
        let Some(frame) = logged.frame.and_then(|frame| frame.ours()) else { return Ok(()) };
        if Message::decode(&frame).is_err() && !frame.is_mac() {
            return Ok(());
        }
        self.ours += 1;
        let channel = self.channel.get_or_insert_with(|| logged.channel.clone());
        if *channel != logged.channel {
            bail!(
                "{name}, row {}: frames of {channel} and of {}; nodes of two buses may have the same number, keep one bus: grep ' {channel} '",
                logged.row,
                logged.channel
            );
        }
        let believed = self.checker.as_mut().map_or(vec![frame], |c| c.take(logged.time_us, &frame));
        for frame in &believed {
            self.nodes.entry(frame.node()).or_default().take(frame.node(), logged.time_us, frame);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::can::{MAX_READING_FRAMES, NumberedReading, reading_frames};
    use rotor_edge_core::reading::ProbeVector;

    use super::*;
    use crate::bus::wire::WireFrame;

    fn reading(number: u16) -> Reading {
        let vector = ProbeVector { cos_um: f32::from(number), sin_um: 1.0 };
        Reading::new(9000.0, &[vector; 4]).unwrap()
    }

    fn logged(frames: impl IntoIterator<Item = (&'static str, Frame)>) -> Vec<Result<LogLine>> {
        let line = |(row, (channel, frame)): (u64, (&str, Frame))| {
            Ok(LogLine::Whole(LogEntry {
                row,
                time_us: 1_000 * row,
                channel: channel.into(),
                frame: Some(WireFrame::from(&frame)),
            }))
        };
        (1..).zip(frames).map(line).collect()
    }

    fn frames(node: u8, sequence: u16, number: u16) -> heapless::Vec<Frame, MAX_READING_FRAMES> {
        reading_frames(node, &NumberedReading::new(sequence, reading(number)))
    }

    fn refusal(log: Vec<Result<LogLine>>) -> String {
        DecodedLog::of(log.into_iter(), "x.log").unwrap_err().to_string()
    }

    #[test]
    fn interleaved_node_readings_are_separated_with_last_time() {
        let mixed = frames(1, 7, 1).into_iter().zip(frames(2, 8, 2));
        let log = logged(mixed.flat_map(|(a, b)| [("can0", a), ("can0", b)]));
        let all = DecodedLog::of(log.into_iter(), "x.log").unwrap();
        assert_eq!((all.frames, all.ours, all.start_us), (12, 12, 1_000));
        let of_node = |node: &NodeRecord| {
            let [Timed { time_us, what }] = &node.readings[..] else { panic!("one reading each") };
            (*time_us, what.probes().to_vec())
        };
        let found: Vec<_> = all.nodes.values().map(of_node).collect();
        let expected = [(11_000, 1), (12_000, 2)].map(|(time_us, n)| (time_us, reading(n).probes().to_vec()));
        assert_eq!(found, expected);
    }

    #[test]
    fn torn_lines_are_skipped_unless_as_many_as_whole_ones() {
        let torn = || Ok(LogLine::Torn("x.log, row 3: torn".into()));
        let mut log = logged(frames(1, 7, 1).into_iter().chain(frames(1, 8, 2)).map(|frame| ("can0", frame)));
        log.insert(2, torn());
        let all = DecodedLog::of(log.into_iter(), "x.log").unwrap();
        assert_eq!((all.torn, all.nodes[&1].readings.len()), (1, 2));
        let mut half = logged(frames(1, 7, 1).into_iter().map(|frame| ("can0", frame)));
        half.extend((0..6).map(|_| torn()));
        assert_eq!(refusal(half), "x.log, row 3: torn");
    }

    #[test]
    fn foreign_protocol_is_refused_even_with_our_identifiers() {
        let foreign = |id| Frame::standard(id, &[9; 8]).unwrap();
        let other = logged((0..0x800).map(|id| ("can0", foreign(id))));
        assert!(refusal(other).contains("x.log: a log of another protocol: none of its 2048 frames"));
        assert!(refusal(vec![]).contains("holds no frame"));
    }

    #[test]
    fn two_buses_in_one_log_are_refused_with_the_row() {
        let frames = frames(1, 7, 1);
        let log = logged([("can0", frames[0]), ("can1", frames[1])]);
        assert!(refusal(log).contains("row 2: frames of can0 and of can1"));
    }
}
