//! From a transferred message to a command carried out, stored first.

use super::Node;
use crate::can::isotp::IsoTp;
use crate::can::isotp::Progress;
use crate::can::{Frame, TYPE_TO_HOST};
use crate::command::{
    ANSWER_BYTES, Answer, CODE_BYTES, Command, HEAD_BYTES, Key, MAX_REQUEST_BYTES, Outcome, Request,
    open_request,
};
use crate::model::{Model, ModelError};

/// What must survive a loss of power before a command takes effect: the two belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Save<'a> {
    /// Last counter accepted, for [`Node::restore_counter`].
    pub counter: u64,
    /// The new model's bytes, for [`Model::decode`]; `None` if the model stays.
    pub model: Option<&'a [u8]>,
}

/// A command that waits for the board to store it.
#[derive(Debug, Clone, Copy)]
struct Pending {
    command: Command,
    counter: u64,
}

/// The way in and out for commands.
#[derive(Debug, Clone)]
pub(super) struct Desk {
    link: IsoTp<MAX_REQUEST_BYTES, ANSWER_BYTES>,
    last_counter: u64,
    pending: Option<Pending>,
    model_checksum: u32,
}

impl Desk {
    pub fn new(model_checksum: u32) -> Self {
        Self { link: IsoTp::new(), last_counter: 0, pending: None, model_checksum }
    }

    pub fn model_checksum(&self) -> u32 {
        self.model_checksum
    }

    pub fn model_replaced(&mut self, checksum: u32) {
        self.model_checksum = checksum;
    }

    fn answer(
        &mut self,
        time_us: u64,
        key: Option<&Key>,
        node: u8,
        outcome: Outcome,
        error: Option<ModelError>,
    ) {
        let request = self.link.message();
        let answer = Answer {
            node,
            command: request.get(1).copied().unwrap_or_default(),
            outcome,
            counter: self.last_counter,
            model_checksum: self.model_checksum,
            model_error: error,
        };
        let bytes = answer.encode(request, key);
        // An answer that is still on its way belongs to a host that fell silent: it goes first, until its time is up.
        let _ = self.link.send(time_us, &bytes);
    }
}

impl<const N: usize, const PROBES: usize, const PLANES: usize> Node<N, PROBES, PLANES> {
    /// Takes up the counter stored last, after a restart.
    pub fn restore_counter(&mut self, counter: u64) {
        self.desk.last_counter = self.desk.last_counter.max(counter);
    }

    /// Last counter accepted.
    pub fn command_counter(&self) -> u64 {
        self.desk.last_counter
    }

    /// What a command waits for. The board stores it, both or neither, and calls [`Node::saved`].
    pub fn to_save(&self) -> Option<Save<'_>> {
        let Pending { command, counter } = self.desk.pending?;
        let model = match command {
            Command::Deploy => Some(self.pending_body()),
            Command::Restart => None,
        };
        Some(Save { counter, model })
    }

    /// Whether what [`Node::to_save`] gave is stored: the command takes effect and is answered, or is refused.
    pub fn saved(&mut self, time_us: u64, stored: bool) {
        let Some(Pending { command, counter }) = self.desk.pending.take() else {
            return;
        };
        if !stored {
            return self.conclude(time_us, Outcome::Storage, None);
        }
        self.desk.last_counter = counter;
        let done = match command {
            Command::Deploy => Model::decode(self.pending_body()).map(|model| self.adopt(model)),
            Command::Restart => {
                self.restart();
                Ok(())
            }
        };
        match done {
            Ok(()) => self.conclude(time_us, Outcome::Accepted, None),
            Err(error) => self.conclude(time_us, Outcome::Model, Some(error)),
        }
    }

    /// A payload of the connection towards this node.
    pub(super) fn transfer(&mut self, time_us: u64, payload: &[u8]) {
        // The message must stay whole until it is stored.
        if self.desk.pending.is_some() {
            return;
        }
        match self.desk.link.receive(time_us, payload) {
            Progress::None => {}
            Progress::Broken(_) => self.count(|c| &mut c.broken),
            Progress::Complete => self.open(time_us),
        }
        self.pump(time_us);
    }

    /// Time-outs of a transfer, and frames that have become due.
    pub(super) fn poll_transfer(&mut self, time_us: u64) {
        if self.desk.link.check_time(time_us).is_err() {
            self.count(|c| &mut c.broken);
        }
        self.pump(time_us);
    }

    fn open(&mut self, time_us: u64) {
        let Self { config, desk, .. } = &*self;
        let opened = open_request(desk.link.message(), config.key.as_ref(), config.node, desk.last_counter);
        match opened {
            Err(outcome) => self.conclude(time_us, outcome, None),
            Ok(Request { command, counter, body }) => {
                let refused = match command {
                    Command::Deploy => Model::<N, PROBES, PLANES>::decode(body).err(),
                    Command::Restart => None,
                };
                match refused {
                    Some(error) => self.conclude(time_us, Outcome::Model, Some(error)),
                    None => self.desk.pending = Some(Pending { command, counter }),
                }
            }
        }
    }

    fn conclude(&mut self, time_us: u64, outcome: Outcome, error: Option<ModelError>) {
        self.count(|c| match outcome {
            Outcome::Accepted => &mut c.accepted,
            Outcome::Forged => &mut c.forged,
            Outcome::Replayed => &mut c.replayed,
            Outcome::Malformed | Outcome::NoKey | Outcome::Model | Outcome::Storage => &mut c.refused,
        });
        let (key, node) = (self.config.key, self.config.node);
        self.desk.answer(time_us, key.as_ref(), node, outcome, error);
        self.pump(time_us);
    }

    /// The body of the request last received; its head and code were checked when it was opened.
    fn pending_body(&self) -> &[u8] {
        let message = self.desk.link.message();
        let end = message.len().saturating_sub(CODE_BYTES);
        message.get(HEAD_BYTES..end).unwrap_or_default()
    }

    fn pump(&mut self, time_us: u64) {
        while !self.queue.is_full()
            && let Some(payload) = self.desk.link.poll(time_us)
        {
            let _ = self.queue.push_back(Frame::full(TYPE_TO_HOST, self.config.node, payload));
        }
    }
}
