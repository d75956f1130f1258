//! A request on its way to a monitor in numbered parts, and its answer on the way back. Nothing here sends: frames and times
//! come in, frames to send come out.

use std::collections::VecDeque;

use rotor_edge_core::can::parts::{Ack, BURST_PARTS, Offer, PART_BYTES, parts_of, request_part};
use rotor_edge_core::can::{Frame, TYPE_ACK, TYPE_ANSWER_PART, TYPE_OFFER, TYPE_PART, frame_id};

/// Wait for what an offer asks for, doubled with each that was in vain up to the longest, µs.
const PATIENCE_US: u64 = 100_000;
const LONGEST_US: u64 = 800_000;
/// Wait before an answer that is not there yet is asked for again, µs.
const NOT_YET_US: u64 = 20_000;
/// Longest time a monitor may take to check and store a request, µs.
const ANSWER_US: u64 = 5_000_000;
/// Offers in vain to a monitor that was never heard, after which it does not know this way or is not there.
const UNHEARD_OFFERS: u32 = 5;
/// Offers in vain to one that was heard, about eleven seconds.
const SILENT_OFFERS: u32 = 16;
/// Offers that any request is worth, and four more for each of its parts: a monitor that forgets again and again is given up.
const LEAST_OFFERS: usize = 512;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    UnderWay,
    /// The monitor was never heard.
    Unheard,
    /// It was heard, and fell silent, or forgot the request again and again.
    Lost,
}

/// One request and its answer.
#[derive(Debug)]
pub struct PartsClient<'a> {
    request: &'a [u8],
    node: u8,
    offer: Offer,
    due_us: u64,
    queue: VecDeque<Frame>,
    offers: usize,
    silent: u32,
    is_heard: bool,
    held: usize,
    whole_since_us: Option<u64>,
    was_sent: bool,
    was_forgotten: bool,
    answer_bytes: usize,
    answer: Vec<u8>,
}

impl<'a> PartsClient<'a> {
    /// A request to `node`; `None` if it is longer than any message in parts.
    pub fn new(time_us: u64, node: u8, request: &'a [u8]) -> Option<Self> {
        Some(Self {
            request,
            node,
            offer: Offer::new(request)?,
            due_us: time_us,
            queue: VecDeque::new(),
            offers: 0,
            silent: 0,
            is_heard: false,
            held: 0,
            whole_since_us: None,
            was_sent: false,
            was_forgotten: false,
            answer_bytes: 0,
            answer: Vec::new(),
        })
    }

    /// Bytes that the monitor is known to hold.
    pub fn held_bytes(&self) -> usize {
        (self.held * PART_BYTES).min(self.request.len())
    }

    /// The whole request was sent, and later the monitor did not hold it: it may have carried it out and started anew.
    pub fn was_forgotten(&self) -> bool {
        self.was_forgotten
    }

    pub fn standing(&self, time_us: u64) -> Standing {
        let parts = parts_of(self.request.len());
        let is_overdue = self.whole_since_us.is_some_and(|since_us| time_us > since_us + ANSWER_US);
        let silent = if time_us >= self.due_us { self.silent } else { 0 };
        match (self.is_heard, silent) {
            (false, UNHEARD_OFFERS..) => Standing::Unheard,
            (true, SILENT_OFFERS..) => Standing::Lost,
            _ if is_overdue || self.offers > LEAST_OFFERS + 4 * parts => Standing::Lost,
            _ => Standing::UnderWay,
        }
    }

    /// The next frame to send, if one is due.
    pub fn poll(&mut self, time_us: u64) -> Option<Frame> {
        if self.queue.is_empty() && time_us >= self.due_us {
            self.ask(time_us);
        }
        self.queue.pop_front()
    }

    /// Takes a frame; the answer, once it is whole.
    pub fn receive(&mut self, time_us: u64, frame: &Frame) -> Option<&[u8]> {
        if frame.raw_id() == frame_id(TYPE_ACK, self.node) {
            if let Some(ack) = Ack::decode(frame.bytes()) {
                self.take_ack(time_us, ack);
            }
        } else if frame.raw_id() == frame_id(TYPE_ANSWER_PART, self.node) {
            self.take_answer(frame.bytes());
        }
        (self.answer_bytes > 0 && self.answer.len() == self.answer_bytes).then_some(self.answer.as_slice())
    }

    /// The answer was not one: it is asked for from its beginning.
    pub fn distrust(&mut self, time_us: u64) {
        (self.answer_bytes, self.due_us) = (0, time_us);
        self.answer.clear();
    }

    fn ask(&mut self, time_us: u64) {
        self.offer.round = self.offer.round.wrapping_add(1);
        self.offer.wanted = (self.answer.len() / PART_BYTES) as u8;
        self.queue.push_back(Frame::full(TYPE_OFFER, self.node, self.offer.encode()));
        self.due_us = time_us + (PATIENCE_US << self.silent.min(8)).min(LONGEST_US);
        self.offers += 1;
        self.silent += 1;
    }

    fn take_ack(&mut self, time_us: u64, ack: Ack) {
        // an acknowledgement for an earlier offer is ignored
        if (ack.round, ack.crc32) != (self.offer.round, self.offer.crc32) || self.silent == 0 {
            return;
        }
        (self.is_heard, self.silent) = (true, 0);
        let parts = parts_of(self.request.len());
        self.held = usize::from(ack.parts).min(parts);
        if self.held < parts {
            self.was_forgotten |= self.was_sent;
            self.was_sent |= self.held + BURST_PARTS >= parts;
            self.whole_since_us = None;
            self.distrust(time_us);
            let next = (self.held..parts).take(BURST_PARTS);
            let burst = next.filter_map(|number| request_part(self.request, number as u16));
            self.queue.extend(burst.map(|part| Frame::full(TYPE_PART, self.node, part)));
            return;
        }
        self.whole_since_us.get_or_insert(time_us);
        self.answer_bytes = usize::from(ack.answer_bytes);
        let wait_us = if self.answer_bytes == 0 { NOT_YET_US } else { PATIENCE_US };
        self.due_us = time_us + wait_us;
    }

    fn take_answer(&mut self, payload: &[u8]) {
        let [number, round, data @ ..] = payload else { return };
        let missing = self.answer_bytes.saturating_sub(self.answer.len());
        let is_next = usize::from(*number) * PART_BYTES == self.answer.len() && *round == self.offer.round;
        if is_next && let Some(data) = data.get(..missing.min(PART_BYTES)) {
            self.answer.extend_from_slice(data);
            if self.answer.len().is_multiple_of(PART_BYTES * BURST_PARTS) {
                self.due_us = 0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hold(client: &mut PartsClient, time_us: u64, parts: u16) {
        while client.poll(time_us).is_some() {}
        let Offer { round, crc32, .. } = client.offer;
        let ack = Ack { parts, answer_bytes: 0, round, crc32 };
        client.receive(time_us, &Frame::full(TYPE_ACK, 1, ack.encode()));
    }

    #[test]
    fn fully_sent_request_may_be_executed_and_is_not_held() {
        let request = [7; 100];
        for (told, expected) in [
            (&[0, 8, 16][..], false),
            (&[0, 8, 17], false),
            (&[0, 0, 0], false),
            // its power went before it said that it held the last part, or after
            (&[0, 8, 16, 0], true),
            (&[0, 8, 16, 17, 0], true),
        ] {
            let mut client = PartsClient::new(0, 1, &request).unwrap();
            for (second, parts) in (0..).zip(told) {
                hold(&mut client, second * 1_000_000, *parts);
            }
            assert_eq!(client.was_forgotten(), expected, "{told:?}");
        }
    }
}
