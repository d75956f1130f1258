//! From a transferred message to a command carried out, stored first.

use heapless::Vec;

use super::{Node, Save};
use crate::can::isotp::{IsoTp, Progress};
use crate::can::parts::{Ack, BURST_PARTS, Offer, answer_part, parts_of};
use crate::can::{Counters, Frame, TYPE_ACK, TYPE_ANSWER_PART, TYPE_TO_HOST};
use crate::command::{
    ANSWER_BYTES, Answer, CODE_BYTES, Command, Detail, HEAD_BYTES, MAX_REQUEST_BYTES, Outcome, Request,
    open_request,
};
use crate::model::{Counts, Model, ModelError};
use crate::numerics::Numerics;
use crate::state::Reason;
use crate::thresholds::Thresholds;

/// A command that waits for the board to store something.
#[derive(Debug, Clone, Copy)]
struct Pending {
    command: Command,
    counter: u64,
    /// The counter is stored; what is left is the memory without the flag.
    is_counted: bool,
}

/// Transfers of requests and answers, the last counter, the command that waits for storage, and the trial.
#[derive(Debug, Clone)]
pub(super) struct CommandHandler {
    link: IsoTp<MAX_REQUEST_BYTES, ANSWER_BYTES>,
    /// What is put together from parts in the link's buffer, while nothing came over the link itself.
    offer: Option<Offer>,
    /// The answer to what was offered, for as often as it is asked for.
    answer: Vec<u8, ANSWER_BYTES>,
    last_counter: u64,
    pending: Option<Pending>,
    /// Until when the model is on trial, if it is.
    trial_until_us: Option<u64>,
}

impl CommandHandler {
    pub fn new() -> Self {
        Self {
            link: IsoTp::new(),
            offer: None,
            answer: Vec::new(),
            last_counter: 0,
            pending: None,
            trial_until_us: None,
        }
    }

    /// Until when the model in use is on trial, if it is.
    pub fn trial_until_us(&self) -> Option<u64> {
        self.trial_until_us
    }

    /// While a command waits to be stored, its connection stands still.
    pub fn poll_at(&self) -> Option<u64> {
        self.link.poll_at()
    }
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// Takes up the counter stored last, after a restart.
    pub fn restore_counter(&mut self, counter: u64) {
        self.handler.last_counter = self.handler.last_counter.max(counter);
    }

    /// Last counter accepted.
    pub fn command_counter(&self) -> u64 {
        self.handler.last_counter
    }

    /// The model on trial was not confirmed in time: the board starts anew from what is stored, as after a loss of power.
    pub fn is_trial_over(&self, time_us: u64) -> bool {
        self.handler.trial_until_us.is_some_and(|until_us| time_us >= until_us)
    }

    /// What is to be stored now. The board stores it and calls [`Node::saved`], until there is nothing more.
    #[inline(never)]
    pub fn to_save(&self) -> Option<Save<'_>> {
        match self.handler.pending {
            Some(Pending { is_counted: true, .. }) if self.model().is_some() => {
                Some(Save::Memory(self.monitor.memory().acknowledged().encode()))
            }
            Some(Pending { command, counter, .. }) => {
                let body = self.handler.body();
                let model = command.model(body).filter(|(_, trial_s)| trial_s.is_none());
                let set = (command == Command::SetThresholds).then_some(body);
                let thresholds = set.and_then(|set| set.try_into().ok());
                Some(Save::Command { counter, model: model.map(|(model, _)| model), thresholds })
            }
            None => self.nonce_to_save().or_else(|| self.memory_to_save()),
        }
    }

    /// Whether what [`Node::to_save`] gave is stored: a command takes effect and is answered, or is refused.
    #[inline(never)]
    pub fn saved(&mut self, time_us: u64, stored: bool) {
        match self.handler.pending.take() {
            Some(pending) if !pending.is_counted => self.carry_out(time_us, pending, stored),
            pending => {
                if pending.is_some() || !self.nonce_saved(stored) {
                    self.memory_saved(time_us, stored);
                }
                if pending.is_some() {
                    self.end_acknowledge(time_us, stored);
                }
            }
        }
        self.save_scheduler.poll(time_us);
        self.announce(time_us);
    }

    fn carry_out(&mut self, time_us: u64, pending: Pending, stored: bool) {
        if !stored {
            return self.conclude(time_us, Outcome::Storage, Detail::None);
        }
        self.handler.last_counter = pending.counter;
        let is_on_trial = self.handler.trial_until_us.is_some();
        let body = self.handler.body();
        let mut detail = Detail::None;
        // What the message brings was checked when it was opened.
        match pending.command {
            Command::Deploy | Command::DeployAnother | Command::Trial => {
                detail = self.change_model(time_us, pending.command);
            }
            Command::SetThresholds => {
                if let Ok(thresholds) = Thresholds::decode(body) {
                    let _ = self.monitor.set_thresholds(thresholds);
                }
            }
            Command::Restart => self.restart(time_us),
            // The stored memory is that of the model before, whose flag stays up.
            Command::Acknowledge if is_on_trial => self.monitor.acknowledge(),
            Command::Acknowledge if self.model().is_some() => {
                self.handler.pending = Some(Pending { is_counted: true, ..pending });
                return;
            }
            Command::Acknowledge | Command::GetThresholds => {}
        }
        self.conclude(time_us, Outcome::Accepted, detail);
    }

    /// Changes to the model that the request brings, and says what that ended.
    fn change_model(&mut self, time_us: u64, command: Command) -> Detail {
        let (before, latched) = (self.monitor.checksum(), self.monitor.latched());
        let Some((model, trial_s)) = command.model(self.handler.body()) else { return Detail::None };
        let _ = self.monitor.decode(model);
        let is_same = self.monitor.checksum() == before;
        if is_same && self.handler.trial_until_us.is_none() {
            return Detail::Unchanged;
        }
        self.handler.trial_until_us =
            trial_s.map(|trial_s| time_us.saturating_add(u64::from(trial_s) * 1_000_000));
        self.save_scheduler.changed_much(time_us);
        if is_same || before == 0 {
            return Detail::None;
        }
        let lowered = latched.map_or(Reason::None, |latched| latched.cause);
        Detail::Replaced { lowered, suspect: latched.and_then(|latched| latched.suspect) }
    }

    fn end_acknowledge(&mut self, time_us: u64, stored: bool) {
        if stored {
            self.monitor.acknowledge();
        }
        let outcome = if stored { Outcome::Accepted } else { Outcome::Storage };
        self.conclude(time_us, outcome, Detail::None);
    }

    /// A payload of the connection towards this node.
    pub(super) fn transfer(&mut self, time_us: u64, payload: &[u8]) {
        // The message must stay whole until it is stored; and who may not send cannot answer.
        if self.handler.pending.is_some() || !self.may_send() {
            return;
        }
        self.handler.offer = None;
        match self.handler.link.receive(time_us, payload) {
            Progress::None => {}
            Progress::Broken(_) => self.count(|c| &mut c.broken),
            Progress::Complete => self.open(time_us),
        }
        self.pump(time_us);
    }

    /// A request in parts is offered: what is held of it, and the answer once there is one.
    pub(super) fn offered(&mut self, payload: &[u8]) {
        let offer =
            Offer::decode(payload).filter(|o| (1..=MAX_REQUEST_BYTES).contains(&usize::from(o.length)));
        let Some(offer) = offer.filter(|_| self.handler.pending.is_none() && self.may_send()) else { return };
        let handler = &mut self.handler;
        if !handler.offer.is_some_and(|before| before.is_of(&offer)) {
            handler.offer = Some(offer);
            handler.answer.clear();
            handler.link.buffer().clear();
        }
        let Offer { wanted, round, crc32, .. } = offer;
        let parts = parts_of(handler.link.buffered().len()) as u16;
        let ack = Ack { parts, answer_bytes: handler.answer.len() as u8, round, crc32 }.encode();
        let numbers = (0..BURST_PARTS as u8).filter_map(|place| wanted.checked_add(place));
        let answer = numbers.filter_map(|number| answer_part(&handler.answer, number, round));
        let frames = core::iter::once((TYPE_ACK, ack)).chain(answer.map(|part| (TYPE_ANSWER_PART, part)));
        for (message_type, payload) in frames {
            // without room, the host asks again
            let _ = self.queue.push_back(Frame::full(message_type, self.config.node, payload));
        }
    }

    /// A part of the request that was offered.
    pub(super) fn part(&mut self, time_us: u64, payload: &[u8]) {
        let handler = &mut self.handler;
        let Some(offer) = handler.offer.filter(|_| handler.pending.is_none()) else { return };
        match offer.take(handler.link.buffer(), payload) {
            Progress::None => {}
            Progress::Broken(_) => self.count(|c| &mut c.broken),
            Progress::Complete => self.open(time_us),
        }
    }

    /// Time-outs of a transfer, and frames that have become due.
    pub(super) fn poll_transfer(&mut self, time_us: u64) {
        if self.handler.link.check_time(time_us).is_err() {
            self.count(|c| &mut c.broken);
        }
        self.pump(time_us);
    }

    fn open(&mut self, time_us: u64) {
        let Self { config, handler, .. } = &*self;
        let opened = open_request(handler.message(), config.key.as_ref(), config.node, handler.last_counter);
        let Request { command, counter, body } = match opened {
            Ok(request) => request,
            Err(outcome) => return self.conclude(time_us, outcome, Detail::None),
        };
        let refused = match (command.model(body), command) {
            (Some((model, _)), _) => match Model::<SHAPES, PROBES, PLANES>::verify::<C>(model) {
                Ok(machine) if command != Command::DeployAnother && self.is_of_another(machine) => {
                    Some((Outcome::Machine, Detail::None))
                }
                Ok(_) => None,
                Err(error) => Some(refusal::<SHAPES, PROBES, PLANES>(model, error)),
            },
            (None, Command::SetThresholds) => {
                Thresholds::decode(body).err().map(|error| (Outcome::Thresholds, Detail::Thresholds(error)))
            }
            (None, _) => None,
        };
        match refused {
            Some((outcome, detail)) => self.conclude(time_us, outcome, detail),
            // It changes nothing, so there is nothing to store.
            None if command == Command::GetThresholds => {
                self.conclude(time_us, Outcome::Accepted, Detail::None);
            }
            None => self.handler.pending = Some(Pending { command, counter, is_counted: false }),
        }
    }

    fn is_of_another(&self, machine: [u8; 4]) -> bool {
        self.model().is_some_and(|model| model.machine != machine)
    }

    fn conclude(&mut self, time_us: u64, outcome: Outcome, detail: Detail) {
        self.count(|c| counter_of(c, outcome));
        let request = self.handler.message();
        let command = request.get(1).copied().unwrap_or_default();
        let asks = outcome == Outcome::Accepted && command == Command::GetThresholds as u8;
        let answer = Answer {
            node: self.config.node,
            command,
            outcome,
            counter: self.handler.last_counter,
            model_checksum: self.monitor.checksum(),
            detail,
            thresholds: asks.then_some(*self.monitor.thresholds()),
        };
        let bytes = answer.encode(request, self.config.key.as_ref());
        if self.handler.offer.is_some() {
            self.handler.answer = bytes;
            return;
        }
        // An answer that is still on its way belongs to a host that fell silent: it goes first, until its time is up.
        let _ = self.handler.link.send(time_us, &bytes);
        self.pump(time_us);
    }

    fn pump(&mut self, time_us: u64) {
        while !self.queue.is_full()
            && let Some(payload) = self.handler.link.poll(time_us)
        {
            let _ = self.queue.push_back(Frame::full(TYPE_TO_HOST, self.config.node, payload));
        }
    }
}

impl CommandHandler {
    /// The request last received, in either way.
    fn message(&self) -> &[u8] {
        if self.offer.is_some() { self.link.buffered() } else { self.link.message() }
    }

    /// The body of the request last received; its head and code were checked when it was opened.
    fn body(&self) -> &[u8] {
        let message = self.message();
        let end = message.len().saturating_sub(CODE_BYTES);
        message.get(HEAD_BYTES..end).unwrap_or_default()
    }
}

fn counter_of(counters: &mut Counters, outcome: Outcome) -> &mut u32 {
    match outcome {
        Outcome::Accepted => &mut counters.accepted,
        Outcome::Forged => &mut counters.forged,
        Outcome::Replayed | Outcome::Counter => &mut counters.replayed,
        Outcome::Malformed
        | Outcome::NoKey
        | Outcome::Model
        | Outcome::Storage
        | Outcome::Thresholds
        | Outcome::Machine => &mut counters.refused,
    }
}

/// Why a model is refused, with both numbers where it is too large.
fn refusal<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &[u8],
    error: ModelError,
) -> (Outcome, Detail) {
    let counts = Counts::read(model);
    let (asked, held) = counts.map_or((0, 0), |counts| match error {
        ModelError::BasisSize => (counts.shapes, SHAPES),
        ModelError::Probes => (counts.probes, PROBES),
        ModelError::Planes => (counts.planes, PLANES),
        _ => (0, 0),
    });
    (Outcome::Model, Detail::Model { error, asked, held: held as u8 })
}
