//! The sending half of a connection.

use heapless::Vec;

use super::{FIRST_BYTES, MAX_LENGTH, MAX_WAITS, Payload, SINGLE_BYTES, TIMEOUT_US, TransferError, padded};

#[derive(Debug, Clone, Copy)]
pub(super) enum Sending {
    Idle,
    /// The whole message, or its first frame, is to be sent.
    Begin,
    Waiting {
        since_us: u64,
        waits: u8,
    },
    /// `left_in_block` is `None` where the receiver set no limit.
    Block {
        left_in_block: Option<u8>,
        separation_us: u64,
        next_us: u64,
    },
}

#[derive(Debug, Clone)]
pub(super) struct Outgoing<const TX: usize> {
    bytes: Vec<u8, TX>,
    sent: usize,
    index: u8,
    pub stage: Sending,
}

impl<const TX: usize> Outgoing<TX> {
    pub fn new() -> Self {
        Self { bytes: Vec::new(), sent: 0, index: 0, stage: Sending::Idle }
    }

    pub fn begin(&mut self, time_us: u64, message: &[u8]) -> Result<(), TransferError> {
        self.check_time(time_us)?;
        if !matches!(self.stage, Sending::Idle) {
            return Err(TransferError::Busy);
        }
        if message.is_empty() || message.len() > MAX_LENGTH {
            return Err(TransferError::Length);
        }
        self.bytes.clear();
        self.bytes.extend_from_slice(message).map_err(|_| TransferError::Length)?;
        (self.sent, self.index, self.stage) = (0, 0, Sending::Begin);
        Ok(())
    }

    pub fn next(&mut self, time_us: u64) -> Option<Payload> {
        match self.stage {
            Sending::Begin if self.bytes.len() <= SINGLE_BYTES => {
                self.stage = Sending::Idle;
                Some(headed(self.bytes.len() as u8, &self.bytes))
            }
            Sending::Begin => {
                self.stage = Sending::Waiting { since_us: time_us, waits: 0 };
                let [low, high, ..] = self.bytes.len().to_le_bytes();
                let [a, b, c, d, e, f] = *self.bytes.first_chunk::<FIRST_BYTES>()?;
                self.sent = FIRST_BYTES;
                Some([0x10 | high, low, a, b, c, d, e, f])
            }
            Sending::Block { left_in_block, separation_us, next_us } if time_us >= next_us => {
                let rest = self.bytes.get(self.sent..)?;
                let part = rest.get(..rest.len().min(SINGLE_BYTES))?;
                self.index = self.index.wrapping_add(1) & 0xf;
                let payload = headed(0x20 | self.index, part);
                self.sent = self.sent.saturating_add(part.len());
                let left_in_block = left_in_block.map(|left| left.saturating_sub(1));
                self.stage = if self.sent >= self.bytes.len() {
                    Sending::Idle
                } else if left_in_block == Some(0) {
                    Sending::Waiting { since_us: time_us, waits: 0 }
                } else {
                    let next_us = time_us.saturating_add(separation_us);
                    Sending::Block { left_in_block, separation_us, next_us }
                };
                Some(payload)
            }
            _ => None,
        }
    }

    pub fn flow_control(&mut self, time_us: u64, status: u8, rest: &[u8]) -> Result<(), TransferError> {
        let Sending::Waiting { waits, .. } = self.stage else {
            return Ok(());
        };
        let (block, separation) = match *rest {
            [block, separation, ..] => (block, separation),
            _ => (0, 0),
        };
        self.stage = match status {
            0 => Sending::Block {
                left_in_block: (block > 0).then_some(block),
                separation_us: separation_us(separation),
                next_us: time_us,
            },
            1 if waits < MAX_WAITS => Sending::Waiting { since_us: time_us, waits: waits.saturating_add(1) },
            _ => Sending::Idle,
        };
        match (status, self.stage) {
            (2, _) => Err(TransferError::Length),
            (_, Sending::Idle) => Err(TransferError::FlowControl),
            _ => Ok(()),
        }
    }

    pub fn check_time(&mut self, time_us: u64) -> Result<(), TransferError> {
        match self.stage {
            Sending::Waiting { since_us, .. } if time_us.saturating_sub(since_us) > TIMEOUT_US => {
                self.stage = Sending::Idle;
                Err(TransferError::Timeout)
            }
            _ => Ok(()),
        }
    }
}

/// The shortest time between consecutive frames that a receiver asked for; reserved values mean the longest.
pub(super) fn separation_us(code: u8) -> u64 {
    match code {
        0..=0x7f => u64::from(code) * 1000,
        0xf1..=0xf9 => u64::from(code & 0xf) * 100,
        _ => 127_000,
    }
}

fn headed(head: u8, data: &[u8]) -> Payload {
    let mut payload = padded(&[head]);
    for (place, &byte) in payload.iter_mut().skip(1).zip(data) {
        *place = byte;
    }
    payload
}
