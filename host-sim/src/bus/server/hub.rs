//! What the clients of a server share: who is there, what went over the bus, and the recording. Frames wait once for all of
//! them, so that a client that does not read costs no memory and misses them alone.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::stderr_logger::StderrLogger;
use crate::bus::log::{Clock, LogWriter};
use crate::bus::wire::WireFrame;

/// Frames that wait for clients, at most: about two seconds of a full bus at 1 Mbit/s.
pub const QUEUE_FRAMES: usize = 16_384;
/// Answers that wait for one client, at most.
const QUEUE_ANSWERS: usize = 256;
/// Items that a client takes at once: nobody else gets at the bus meanwhile.
const TAKEN_AT_ONCE: usize = 512;
/// Clients at once: each takes two threads.
pub const MAX_CLIENTS: usize = 1_000;

/// What is to be sent to a client.
#[derive(Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// A frame and when it was on the bus.
    Frame(u64, WireFrame),
    /// An answer, in a packet of its own.
    Answer(&'static str),
    Joined(&'static str),
}

pub type Number = u64;

struct Client {
    name: String,
    joined: bool,
    dropped: u64,
    /// Number of the frame that it is to be sent next.
    next: u64,
    /// Answers, each with the number of the frame that it goes before.
    answers: VecDeque<(u64, Outgoing)>,
    news: Arc<Condvar>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    pub clients: u64,
    /// Frames that went over the bus.
    pub frames: u64,
    /// Copies that a client missed because it did not read.
    pub dropped: u64,
    /// Lines, messages and frames of clients that were refused.
    pub refused: u64,
    /// Connections that were turned away: too many at once, or not of the protocol.
    pub turned_away: u64,
}

struct HubState {
    clients: BTreeMap<Number, Client>,
    counts: Counts,
    /// The last frames, with their time and whose they are.
    frames: VecDeque<(u64, Number, WireFrame)>,
    log: Option<LogWriter<File>>,
    log_error: Option<io::Error>,
}

impl HubState {
    /// Number of the oldest frame that still waits.
    fn oldest(&self) -> u64 {
        self.counts.frames - self.frames.len() as u64
    }
}

pub struct Hub {
    clock: Clock,
    logger: StderrLogger,
    state: Mutex<HubState>,
}

impl Hub {
    /// A bus without clients, recorded if there is a log.
    pub fn new(log: Option<LogWriter<File>>, logger: StderrLogger) -> Self {
        let state = HubState {
            clients: BTreeMap::new(),
            counts: Counts::default(),
            frames: VecDeque::new(),
            log,
            log_error: None,
        };
        Self { clock: Clock::default(), logger, state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, HubState> {
        // every change is whole before anything can panic
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn counts(&self) -> Counts {
        self.state().counts
    }

    /// Why the recording ended before the bus.
    pub fn take_log_error(&self) -> Option<io::Error> {
        self.state().log_error.take()
    }

    /// Says something to whoever runs the bus.
    pub fn tell(&self, text: String) {
        self.logger.tell(text);
    }

    /// A new client's number; `None` if there are as many as there may be.
    pub fn enter(&self, name: String) -> Option<Number> {
        let mut state = self.state();
        if state.clients.len() >= MAX_CLIENTS {
            return None;
        }
        state.counts.clients += 1;
        let number = state.counts.clients;
        let client = Client {
            name,
            joined: false,
            dropped: 0,
            next: state.counts.frames,
            answers: VecDeque::new(),
            news: Arc::default(),
        };
        state.clients.insert(number, client);
        Some(number)
    }

    pub fn leave(&self, number: Number) {
        let Some(client) = self.state().clients.remove(&number) else { return };
        client.news.notify_all();
        if client.dropped > 0 {
            let Client { name, dropped, .. } = client;
            self.tell(format!("{name} left; it missed {dropped} frames because it did not read them"));
        }
    }

    /// Counts a connection that was turned away, and says so the first time.
    pub fn turn_away(&self, why: &str) {
        let mut state = self.state();
        state.counts.turned_away += 1;
        if state.counts.turned_away == 1 {
            self.tell(format!("a connection was turned away: {why}; others are only counted"));
        }
    }

    /// Says something to a client. One that does not read misses answers as it misses frames.
    pub fn answer(&self, number: Number, text: &'static str) {
        self.put(number, Outgoing::Answer(text));
    }

    /// From now on the client gets all frames; none of them goes ahead of the answer, none after it is missed.
    pub fn join(&self, number: Number, text: &'static str) {
        self.put(number, Outgoing::Joined(text));
    }

    fn put(&self, number: Number, what: Outgoing) {
        let mut state = self.state();
        let now = state.counts.frames;
        let Some(client) = state.clients.get_mut(&number) else { return };
        if matches!(what, Outgoing::Joined(_)) && !client.joined {
            (client.joined, client.next) = (true, now);
        }
        if client.answers.len() < QUEUE_ANSWERS {
            client.answers.push_back((now, what));
            client.news.notify_all();
        }
    }

    /// From now on the client gets no frames.
    pub fn part(&self, number: Number) {
        if let Some(client) = self.state().clients.get_mut(&number) {
            client.joined = false;
        }
    }

    /// Whether the client gets frames.
    pub fn is_joined(&self, number: Number) -> bool {
        self.state().clients.get(&number).is_some_and(|client| client.joined)
    }

    /// Counts what a client sent in vain.
    pub fn refuse(&self, number: u64) {
        self.state().counts.refused += number;
    }

    /// Waits until there is something for the client, and appends it to `items`; `false` once the client is gone.
    pub fn take(&self, number: Number, items: &mut Vec<Outgoing>) -> bool {
        let mut state = self.state();
        loop {
            let (oldest, end) = (state.oldest(), state.counts.frames);
            let HubState { clients, frames, .. } = &mut *state;
            let Some(client) = clients.get_mut(&number) else { return false };
            while items.len() < TAKEN_AT_ONCE {
                let waits = client.joined && client.next < end;
                match client.answers.front() {
                    Some((before, _)) if !waits || *before <= client.next => {
                        items.extend(client.answers.pop_front().map(|(_, answer)| answer));
                    }
                    _ if waits => {
                        let (time_us, from, frame) = frames[(client.next - oldest) as usize];
                        client.next += 1;
                        if from != number {
                            items.push(Outgoing::Frame(time_us, frame));
                        }
                    }
                    _ => break,
                }
            }
            if !items.is_empty() {
                return true;
            }
            let news = Arc::clone(&client.news);
            state = news.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Puts frames of one client on the bus: the same order for all others and for the recording.
    pub fn publish(&self, from: Number, frames: &[WireFrame]) {
        if frames.is_empty() {
            return;
        }
        let mut state = self.state();
        let time_us = self.clock.now_us();
        // first, so that whatever was heard is in the recording
        if let Some(log) = &mut state.log
            && let Err(e) = log.write(time_us, frames)
        {
            self.tell(format!(
                "the recording ends here, as the file cannot be written ({e}); the bus goes on"
            ));
            (state.log, state.log_error) = (None, Some(e));
        }
        for frame in frames {
            if state.frames.len() == QUEUE_FRAMES {
                self.drop_oldest(&mut state);
            }
            state.frames.push_back((time_us, from, *frame));
            state.counts.frames += 1;
        }
        for (_, client) in state.clients.iter().filter(|(number, client)| **number != from && client.joined) {
            client.news.notify_all();
        }
    }

    fn drop_oldest(&self, state: &mut HubState) {
        let oldest = state.oldest();
        let Some((_, of, _)) = state.frames.pop_front() else { return };
        for (number, client) in state.clients.iter_mut().filter(|(_, c)| c.joined && c.next == oldest) {
            client.next += 1;
            if *number == of {
                continue;
            }
            if client.dropped == 0 {
                let name = &client.name;
                self.tell(format!("{name} does not read: frames are dropped for it, and for nobody else"));
            }
            client.dropped += 1;
            state.counts.dropped += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u32) -> WireFrame {
        WireFrame::data(id, false, &[]).unwrap()
    }

    fn hub() -> Hub {
        Hub::new(None, StderrLogger::silent())
    }

    /// The frames that wait for a client, of which there is something.
    fn ids(hub: &Hub, number: Number) -> Vec<u32> {
        let mut items = Vec::new();
        // something to end the waiting
        hub.answer(number, "end");
        while items.last() != Some(&Outgoing::Answer("end")) {
            let mut some = Vec::new();
            assert!(hub.take(number, &mut some));
            items.extend(some);
        }
        let frame = |outgoing| match outgoing {
            Outgoing::Frame(_, frame) => Some(frame.id()),
            _ => None,
        };
        items.into_iter().filter_map(frame).collect()
    }

    #[test]
    fn frames_go_to_all_others_that_joined() {
        let hub = hub();
        let [a, b, c] = ["a", "b", "c"].map(|name| hub.enter(name.into()).unwrap());
        [a, b].into_iter().for_each(|number| hub.join(number, ""));
        hub.publish(a, &[frame(1), frame(2)]);
        hub.join(c, "");
        hub.publish(b, &[frame(3)]);
        assert_eq!([a, b, c].map(|client| ids(&hub, client)), [vec![3], vec![1, 2], vec![3]]);
        hub.part(c);
        hub.publish(b, &[frame(4)]);
        assert_eq!([a, b, c].map(|client| ids(&hub, client)), [vec![4], vec![], vec![]]);
        hub.leave(a);
        hub.publish(b, &[frame(5)]);
        assert!(!hub.take(a, &mut Vec::new()), "it is gone");
        assert_eq!(hub.counts(), Counts { clients: 3, frames: 5, ..Counts::default() });
    }

    #[test]
    fn no_frame_goes_ahead_of_the_answer_to_joining() {
        let hub = hub();
        let [a, b] = ["a", "b"].map(|name| hub.enter(name.into()).unwrap());
        hub.publish(b, &[frame(1)]);
        hub.join(a, "ok");
        hub.publish(b, &[frame(2)]);
        hub.answer(a, "later");
        hub.publish(b, &[frame(3)]);
        let mut items = Vec::new();
        assert!(hub.take(a, &mut items));
        let frames: Vec<bool> = items.iter().map(|item| matches!(item, Outgoing::Frame(..))).collect();
        assert_eq!((&items[0], frames), (&Outgoing::Joined("ok"), vec![false, true, false, true]));
    }

    #[test]
    fn slow_client_misses_the_oldest_and_others_nothing() {
        let hub = hub();
        let [from, idle, eager] = ["from", "idle", "eager"].map(|name| hub.enter(name.into()).unwrap());
        [from, idle, eager].into_iter().for_each(|number| hub.join(number, ""));
        let all = QUEUE_FRAMES + 100;
        let mut heard = 0;
        for _ in 0..all {
            hub.publish(from, &[frame(1)]);
            heard += ids(&hub, eager).len();
        }
        assert_eq!(heard, all);
        assert_eq!(hub.counts().dropped, 100);
        assert_eq!(ids(&hub, idle).len(), QUEUE_FRAMES);
    }

    #[test]
    fn clients_beyond_the_most_are_turned_away_until_one_leaves() {
        let hub = hub();
        let first = (0..MAX_CLIENTS).filter_map(|_| hub.enter(String::new())).min().unwrap();
        assert_eq!(hub.enter("one more".into()), None);
        hub.leave(first);
        assert!(hub.enter("one more".into()).is_some());
    }
}
