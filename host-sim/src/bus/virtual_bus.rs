//! A CAN bus in simulated time: arbitration by identifier, frame times, and injectable loss and delay.
//!
//! Time is simulated, so a day of traffic takes as long as it takes to compute and every run with the
//! same seed is the same run.

use std::collections::VecDeque;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge_core::can::Frame;

/// What the bus does to frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BusConfig {
    /// Bits a second.
    pub bit_rate: u32,
    /// Chance that one receiver misses one frame, 0 to 1.
    pub loss: f64,
    /// Longest extra time that a frame may take to a receiver, µs; longer than a frame, it reorders.
    pub longest_delay_us: u64,
    /// Chance that one receiver gets one frame twice, 0 to 1.
    pub repetition: f64,
    /// Chance that one receiver gets one frame with a flipped bit that the bus's own checksum missed, 0 to 1.
    pub flip: f64,
    /// Seed of all of these.
    pub seed: u64,
}

impl Default for BusConfig {
    /// A faultless bus at 500 kbit/s.
    fn default() -> Self {
        Self { bit_rate: 500_000, loss: 0.0, longest_delay_us: 0, repetition: 0.0, flip: 0.0, seed: 1 }
    }
}

/// Number of a participant.
pub type Port = usize;

/// Frames that went over the bus.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Frames put on the bus.
    pub sent: u64,
    /// Copies that reached a receiver.
    pub received: u64,
    /// Copies that a receiver missed.
    pub lost: u64,
    /// Copies that arrived later than the frame took.
    pub late: u64,
    /// Copies that came twice.
    pub repeated: u64,
    /// Copies with a flipped bit.
    pub damaged: u64,
    /// Time the bus was busy, µs.
    pub busy_us: u64,
}

#[derive(Default)]
struct Participant {
    outgoing: VecDeque<Frame>,
    /// Arrival time and frame, ascending.
    incoming: VecDeque<(u64, Frame)>,
    is_off: bool,
    has_left: bool,
}

/// Several participants on one wire.
pub struct VirtualBus {
    config: BusConfig,
    participants: Vec<Participant>,
    traffic: Traffic,
    chance: Xoshiro256PlusPlus,
    now_us: u64,
}

/// Bits of a standard data frame on the wire, the worst of stuff bits and the gap to the next included.
pub fn frame_bits(frame: &Frame) -> u32 {
    let data = 8 * frame.bytes().len() as u32;
    47 + data + (34 + data - 1) / 4
}

impl VirtualBus {
    /// A bus with this many participants.
    pub fn new(config: BusConfig, participants: usize) -> Self {
        Self {
            config,
            participants: (0..participants).map(|_| Participant::default()).collect(),
            traffic: Traffic::default(),
            chance: Xoshiro256PlusPlus::seed_from_u64(config.seed),
            now_us: 0,
        }
    }

    pub fn join(&mut self) -> Port {
        self.participants.push(Participant::default());
        self.participants.len() - 1
    }

    /// Simulated time, µs.
    pub fn now_us(&self) -> u64 {
        self.now_us
    }

    /// What went over the bus so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Queues a frame of one participant; its frames leave in the order in which they were queued.
    pub fn send(&mut self, port: Port, frame: Frame) {
        self.participants[port].outgoing.push_back(frame);
    }

    /// Takes a participant off the bus (a controller in the state bus-off): it neither sends nor hears, and what it was about
    /// to send is gone.
    pub fn switch_off(&mut self, port: Port) {
        let participant = &mut self.participants[port];
        participant.outgoing.clear();
        participant.is_off = true;
    }

    /// A participant hears nothing any more; what it has queued is still sent.
    pub fn leave(&mut self, port: Port) {
        let participant = &mut self.participants[port];
        participant.incoming.clear();
        participant.has_left = true;
    }

    pub fn switch_on(&mut self, port: Port) {
        self.participants[port].is_off = false;
    }

    /// Lets the frame with the lowest identifier among the participants' next frames go over the
    /// wire; `None` if nobody has anything to send.
    pub fn transmit_one(&mut self) -> Option<Frame> {
        let heads = self.participants.iter().enumerate().filter(|(_, p)| !p.is_off);
        let winner = heads
            .filter_map(|(port, p)| p.outgoing.front().map(|f| (f.raw_id(), port)))
            .min()
            .map(|(_, port)| port);
        let port = winner?;
        let frame = self.participants[port].outgoing.pop_front()?;
        let duration_us = u64::from(frame_bits(&frame)) * 1_000_000 / u64::from(self.config.bit_rate);
        self.now_us += duration_us;
        self.traffic.busy_us += duration_us;
        self.traffic.sent += 1;
        for receiver in 0..self.participants.len() {
            if receiver != port && !self.participants[receiver].has_left {
                self.deliver(receiver, frame);
            }
        }
        Some(frame)
    }

    fn deliver(&mut self, receiver: Port, frame: Frame) {
        if self.participants[receiver].is_off || self.happens(self.config.loss) {
            self.traffic.lost += 1;
            return;
        }
        let copies = if self.happens(self.config.repetition) { 2 } else { 1 };
        self.traffic.repeated += copies - 1;
        for _ in 0..copies {
            let frame = if self.happens(self.config.flip) { self.flipped(frame) } else { frame };
            let delay_us = match self.config.longest_delay_us {
                0 => 0,
                longest => self.chance.next_u64() % (longest + 1),
            };
            self.traffic.late += u64::from(delay_us > 0);
            let arrival_us = self.now_us + delay_us;
            let incoming = &mut self.participants[receiver].incoming;
            let place = incoming.partition_point(|(at, _)| *at <= arrival_us);
            incoming.insert(place, (arrival_us, frame));
            self.traffic.received += 1;
        }
    }

    /// The frame with one bit of its payload flipped.
    fn flipped(&mut self, frame: Frame) -> Frame {
        let mut bytes = frame.bytes().to_vec();
        if bytes.is_empty() {
            return frame;
        }
        let bit = self.chance.next_u64() as usize % (8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
        self.traffic.damaged += 1;
        Frame::standard(frame.raw_id(), &bytes).unwrap_or(frame)
    }

    fn happens(&mut self, probability: f64) -> bool {
        probability > 0.0 && (self.chance.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 <= probability
    }

    /// The next frame that has arrived at a participant, with its time of arrival.
    pub fn receive(&mut self, port: Port) -> Option<(u64, Frame)> {
        let incoming = &mut self.participants[port].incoming;
        if incoming.front()?.0 > self.now_us {
            return None;
        }
        incoming.pop_front()
    }

    /// Whether a frame has arrived at a participant and was not received yet.
    pub fn has_arrived(&self, port: Port) -> bool {
        self.participants[port].incoming.front().is_some_and(|(arrival_us, _)| *arrival_us <= self.now_us)
    }

    /// When the next copy that is under way arrives anywhere.
    pub fn next_arrival_us(&self) -> Option<u64> {
        let arrivals = self.participants.iter().filter_map(|p| p.incoming.front().map(|(at, _)| *at));
        arrivals.filter(|arrival_us| *arrival_us > self.now_us).min()
    }

    /// Moves the clock of an idle bus on.
    pub fn wait_until(&mut self, time_us: u64) {
        self.now_us = self.now_us.max(time_us);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16) -> Frame {
        Frame::standard(id, &[id as u8; 8]).unwrap()
    }

    fn received(bus: &mut VirtualBus, port: Port) -> Vec<u16> {
        std::iter::from_fn(|| bus.receive(port).map(|(_, f)| f.raw_id())).collect()
    }

    #[test]
    fn the_lowest_identifier_wins_the_bus_and_nobody_hears_itself() {
        let mut bus = VirtualBus::new(BusConfig::default(), 3);
        bus.send(0, frame(0x300));
        bus.send(1, frame(0x100));
        bus.send(1, frame(0x200));
        while bus.transmit_one().is_some() {}
        assert_eq!(received(&mut bus, 2), [0x100, 0x200, 0x300]);
        assert_eq!(received(&mut bus, 0), [0x100, 0x200]);
        assert_eq!(received(&mut bus, 1), [0x300]);
    }

    #[test]
    fn a_full_frame_takes_the_135_bits_of_the_standard_at_worst() {
        // ISO 11898-1: 111 bits with the gap, 24 stuff bits at worst
        assert_eq!(frame_bits(&frame(1)), 135);
        let mut bus = VirtualBus::new(BusConfig::default(), 2);
        bus.send(0, frame(1));
        bus.transmit_one();
        assert_eq!(bus.now_us(), 270);
    }

    #[test]
    fn loss_and_delay_are_injected_as_asked_and_repeat_with_seed() {
        let config = BusConfig { loss: 0.1, longest_delay_us: 2_000, seed: 7, ..BusConfig::default() };
        let run = || {
            let mut bus = VirtualBus::new(config, 2);
            for k in 0..2000 {
                bus.send(0, frame(k));
            }
            while bus.transmit_one().is_some() {}
            bus.wait_until(u64::MAX);
            (received(&mut bus, 1), bus.traffic().lost)
        };
        let (arrived, lost) = run();
        // 2000 × 0.1 = 200, standard deviation 13
        assert!((140..260).contains(&lost), "{lost}");
        assert_eq!(arrived.len() as u64 + lost, 2000);
        assert!(arrived.windows(2).any(|w| w[0] > w[1]), "delays longer than a frame reorder");
        assert_eq!(run().0, arrived);
    }
}
