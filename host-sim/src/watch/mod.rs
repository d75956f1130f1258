//! What a listener learns of all monitors on a bus, and how a terminal shows it.
//!
//! | module | holds |
//! |---|---|
//! | [`Watch`] | everything heard: frames and the time in, no I/O |
//! | [`monitor`] | of one monitor: state, counters, model, results |
//! | [`load`] | how full the bus is |
//! | [`words`], [`reasons`] | a monitor's state and its reason in words, and what to do next |
//! | [`screen`] | which monitor is looked at, pause, keys |
//! | [`view`] | all of it drawn |
//! | [`terminal`] | the loop between bus, keys and terminal |

mod lists;
pub mod load;
pub mod monitor;
pub mod reasons;
pub mod screen;
pub mod terminal;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
pub mod view;
pub mod words;

use std::collections::BTreeMap;

use rotor_edge_core::can::{BROADCAST_NODE, Frame, Message};

use crate::bus::mac::Checker;
use load::Load;
use monitor::Monitor;

/// All that was heard on one bus.
#[derive(Debug, Clone)]
pub struct Watch {
    only: Option<u8>,
    monitors: BTreeMap<u8, Monitor>,
    load: Load,
    frames: u64,
    foreign: u64,
    now_us: u64,
    questions: Vec<Frame>,
    checker: Option<Checker>,
}

impl Watch {
    /// Begins to listen, to one number `only` or to all, and asks for versions.
    pub fn new(only: Option<u8>) -> Self {
        Self {
            only,
            monitors: BTreeMap::new(),
            load: Load::default(),
            frames: 0,
            foreign: 0,
            now_us: 0,
            questions: vec![Message::VersionQuery.encode(only.unwrap_or(BROADCAST_NODE))],
            checker: None,
        }
    }

    /// Believes of one monitor only what bears a right MAC: readings, results, heartbeats and states.
    pub fn checking(mut self, checker: Checker) -> Self {
        self.checker = Some(checker);
        self
    }

    /// Takes a frame heard at `time_us` since the start.
    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        self.pass(time_us);
        self.frames += 1;
        self.load.take(time_us, frame);
        match &mut self.checker {
            Some(checker) if checker.node() == frame.node() => {
                let believed = checker.take(time_us, frame);
                self.monitors.entry(frame.node()).or_default().refuse(checker.refused());
                believed.iter().for_each(|frame| self.hear(time_us, frame));
            }
            _ => self.hear(time_us, frame),
        }
    }

    fn hear(&mut self, time_us: u64, frame: &Frame) {
        let node = frame.node();
        match Message::decode(frame) {
            Ok((BROADCAST_NODE, _) | (_, Message::VersionQuery)) => {}
            Ok((_, message)) => {
                if self.only.is_none_or(|only| only == node) {
                    let monitor = self.monitors.entry(node).or_default();
                    if monitor.receive(time_us, frame, &message) {
                        self.questions.push(Message::VersionQuery.encode(node));
                    }
                }
            }
            Err(_) if frame.is_transfer() || frame.is_mac() => {}
            Err(_) => self.foreign += 1,
        }
    }

    /// Time goes on without a frame.
    pub fn pass(&mut self, time_us: u64) {
        self.now_us = self.now_us.max(time_us);
    }

    /// Frames to put on the bus: version queries, each once.
    pub fn questions(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.questions)
    }

    /// Monitors by number: those heard, and those that are sent readings without being heard.
    pub fn monitors(&self) -> impl Iterator<Item = (u8, &Monitor)> {
        let known = self.monitors.iter().filter(|(_, monitor)| monitor.is_known());
        known.map(|(node, monitor)| (*node, monitor))
    }

    pub fn monitor(&self, node: u8) -> Option<&Monitor> {
        self.monitors.get(&node).filter(|monitor| monitor.is_known())
    }

    /// Forgets the results of a monitor; what it is and its counters stay.
    pub fn clear(&mut self, node: u8) {
        if let Some(monitor) = self.monitors.get_mut(&node) {
            monitor.clear();
        }
    }

    /// The only number listened to, if not all.
    pub fn only(&self) -> Option<u8> {
        self.only
    }

    /// Since the start, µs.
    pub fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Frames heard, ours or not.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Of these, frames that are no message of this protocol.
    pub fn foreign(&self) -> u64 {
        self.foreign
    }

    /// How full the bus is.
    pub fn load(&self) -> &Load {
        &self.load
    }
}
