//! What the clients of a server share: who is there, what went over the bus, and the recording.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::bus::log::{Clock, LogWriter};
use crate::bus::wire::WireFrame;

/// Frames that wait for one client, at most: about two seconds of a full bus at 1 Mbit/s.
pub const QUEUE_FRAMES: usize = 16_384;

/// What waits to be sent to a client.
#[derive(Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// A frame and when it was on the bus.
    Frame(u64, WireFrame),
    /// An answer, in a packet of its own.
    Answer(&'static str),
    /// The answer to joining.
    Joined(&'static str),
}

/// A client's number.
pub type Number = u64;

struct Client {
    name: String,
    joined: bool,
    dropped: u64,
    queue: SyncSender<Outgoing>,
}

/// What happened so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Clients that came.
    pub clients: u64,
    /// Frames that went over the bus.
    pub frames: u64,
    /// Copies that a client missed because it did not read.
    pub dropped: u64,
    /// Lines, messages and frames of clients that were refused.
    pub refused: u64,
}

struct State {
    clients: BTreeMap<Number, Client>,
    counts: Counts,
    log: Option<LogWriter<File>>,
}

/// The bus itself.
pub struct Hub {
    clock: Clock,
    state: Mutex<State>,
}

impl Hub {
    /// A bus without clients, recorded if there is a log.
    pub fn new(log: Option<LogWriter<File>>) -> Self {
        let state = State { clients: BTreeMap::new(), counts: Counts::default(), log };
        Self { clock: Clock::default(), state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // every change is whole before anything can panic
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What happened so far.
    pub fn counts(&self) -> Counts {
        self.state().counts
    }

    /// A new client: its number and what it is to be sent.
    pub fn enter(&self, name: String) -> (Number, Receiver<Outgoing>) {
        let (queue, outgoing) = sync_channel(QUEUE_FRAMES);
        let mut state = self.state();
        state.counts.clients += 1;
        let number = state.counts.clients;
        state.clients.insert(number, Client { name, joined: false, dropped: 0, queue });
        (number, outgoing)
    }

    /// A client is gone.
    pub fn leave(&self, number: Number) {
        let gone = self.state().clients.remove(&number);
        if let Some(client) = gone.filter(|client| client.dropped > 0) {
            eprintln!(
                "{} left; it missed {} frames because it did not read them",
                client.name, client.dropped
            );
        }
    }

    /// Says something to a client. One that does not read misses answers as it misses frames.
    pub fn answer(&self, number: Number, text: &'static str) {
        if let Some(client) = self.state().clients.get(&number) {
            let _ = client.queue.try_send(Outgoing::Answer(text));
        }
    }

    /// From now on the client gets all frames; none of them goes ahead of the answer, none after it is missed.
    pub fn join(&self, number: Number, text: &'static str) {
        if let Some(client) = self.state().clients.get_mut(&number) {
            client.joined = true;
            let _ = client.queue.try_send(Outgoing::Joined(text));
        }
    }

    /// From now on the client gets no frames.
    pub fn part(&self, number: Number) {
        if let Some(client) = self.state().clients.get_mut(&number) {
            client.joined = false;
        }
    }

    /// Counts what a client sent in vain.
    pub fn refuse(&self, number: u64) {
        self.state().counts.refused += number;
    }

    /// Puts frames of one client on the bus: the same order for all others and for the recording.
    ///
    /// # Errors
    /// If the recording cannot be written.
    pub fn publish(&self, from: Number, frames: &[WireFrame]) -> io::Result<()> {
        if frames.is_empty() {
            return Ok(());
        }
        let mut state = self.state();
        let State { clients, counts, log } = &mut *state;
        let time_us = self.clock.now_us();
        // first, so that whatever was heard is in the recording
        if let Some(log) = log {
            log.write(time_us, frames)?;
        }
        counts.frames += frames.len() as u64;
        for (_, client) in clients.iter_mut().filter(|(number, client)| **number != from && client.joined) {
            for frame in frames {
                if let Err(TrySendError::Full(_)) = client.queue.try_send(Outgoing::Frame(time_us, *frame)) {
                    if client.dropped == 0 {
                        eprintln!(
                            "{} does not read: frames are dropped for it, and for nobody else",
                            client.name
                        );
                    }
                    client.dropped += 1;
                    counts.dropped += 1;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u32) -> WireFrame {
        WireFrame::data(id, false, &[]).unwrap()
    }

    fn ids(queue: &Receiver<Outgoing>) -> Vec<u32> {
        let frame = |outgoing| match outgoing {
            Outgoing::Frame(_, frame) => Some(frame.id()),
            _ => None,
        };
        queue.try_iter().filter_map(frame).collect()
    }

    #[test]
    fn frames_go_to_all_others_that_joined() {
        let hub = Hub::new(None);
        let [a, b, c] = ["a", "b", "c"].map(|name| hub.enter(name.into()));
        [a.0, b.0].into_iter().for_each(|number| hub.join(number, ""));
        hub.publish(a.0, &[frame(1), frame(2)]).unwrap();
        hub.join(c.0, "");
        hub.publish(b.0, &[frame(3)]).unwrap();
        hub.part(c.0);
        hub.publish(b.0, &[frame(4)]).unwrap();
        assert_eq!([&a, &b, &c].map(|client| ids(&client.1)), [vec![3, 4], vec![1, 2], vec![3]]);
        hub.leave(a.0);
        hub.publish(b.0, &[frame(5)]).unwrap();
        assert_eq!(hub.counts(), Counts { clients: 3, frames: 5, dropped: 0, refused: 0 });
    }

    #[test]
    fn a_client_that_does_not_read_misses_the_rest_and_nobody_else_does() {
        let hub = Hub::new(None);
        let [from, idle, eager] = ["from", "idle", "eager"].map(|name| hub.enter(name.into()));
        [idle.0, eager.0].into_iter().for_each(|number| hub.join(number, ""));
        let all = QUEUE_FRAMES + 100;
        let mut heard = 0;
        for _ in 0..all {
            hub.publish(from.0, &[frame(1)]).unwrap();
            heard += ids(&eager.1).len();
        }
        assert_eq!(heard, all);
        // the answer to joining took one place
        assert_eq!(hub.counts().dropped, 101);
        assert_eq!(ids(&idle.1).len(), QUEUE_FRAMES - 1);
    }
}
