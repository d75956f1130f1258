//! The receiving half of a connection.

use heapless::Vec;

use super::{BLOCK_SIZE, FIRST_BYTES, Payload, Progress, SINGLE_BYTES, TIMEOUT_US, TransferError, padded};

#[derive(Debug, Clone, Copy)]
pub(super) enum Receiving {
    Idle,
    Open { length: usize, index: u8, left_in_block: u8, since_us: u64 },
    Complete,
}

#[derive(Debug, Clone)]
pub(super) struct Incoming<const RX: usize> {
    pub bytes: Vec<u8, RX>,
    pub stage: Receiving,
    pub flow_control: Option<Payload>,
}

impl<const RX: usize> Incoming<RX> {
    pub fn new() -> Self {
        Self { bytes: Vec::new(), stage: Receiving::Idle, flow_control: None }
    }

    pub fn receive(&mut self, time_us: u64, payload: &[u8]) -> Progress {
        match *payload {
            [first, ref data @ ..] if first >> 4 == 0 => self.single(usize::from(first & 0xf), data),
            [first, second, ref data @ ..] if first >> 4 == 1 => {
                self.first(time_us, usize::from(first & 0xf) << 8 | usize::from(second), data)
            }
            [first, ref data @ ..] if first >> 4 == 2 => self.consecutive(time_us, first & 0xf, data),
            // reserved kinds are ignored, as the standard asks
            _ => Progress::None,
        }
    }

    fn single(&mut self, length: usize, data: &[u8]) -> Progress {
        let Some(message) = data.get(..length).filter(|message| !message.is_empty()) else {
            return Progress::None;
        };
        self.bytes.clear();
        if self.bytes.extend_from_slice(message).is_err() {
            return self.broken(TransferError::Length);
        }
        // a message it interrupts is lost, which its sender learns by time-out
        self.stage = Receiving::Complete;
        Progress::Complete
    }

    fn first(&mut self, time_us: u64, length: usize, data: &[u8]) -> Progress {
        let comes_again = |begun: usize| begun == length && self.bytes.as_slice() == data;
        let interrupted = matches!(self.stage, Receiving::Open { length: begun, .. } if !comes_again(begun));
        if length <= SINGLE_BYTES || data.len() != FIRST_BYTES {
            return Progress::None;
        }
        self.bytes.clear();
        if length > RX || self.bytes.extend_from_slice(data).is_err() {
            self.flow_control = Some(padded(&[0x32, 0, 0]));
            return self.broken(TransferError::Length);
        }
        self.flow_control = Some(padded(&[0x30, BLOCK_SIZE, 0]));
        self.stage = Receiving::Open { length, index: 1, left_in_block: BLOCK_SIZE, since_us: time_us };
        if interrupted { Progress::Broken(TransferError::Interrupted) } else { Progress::None }
    }

    fn consecutive(&mut self, time_us: u64, number: u8, data: &[u8]) -> Progress {
        let Receiving::Open { length, index, left_in_block, .. } = self.stage else {
            return Progress::None;
        };
        let came_last = index.wrapping_sub(1) & 0xf;
        if number == came_last && self.bytes.len() > FIRST_BYTES && self.bytes.ends_with(data) {
            return Progress::None;
        }
        let missing = length.saturating_sub(self.bytes.len());
        let part = missing.min(SINGLE_BYTES);
        let Some(data) = data.get(..part) else {
            return self.broken(TransferError::Sequence);
        };
        if number != index || self.bytes.extend_from_slice(data).is_err() {
            return self.broken(TransferError::Sequence);
        }
        if part == missing {
            self.stage = Receiving::Complete;
            return Progress::Complete;
        }
        let left_in_block = match left_in_block.saturating_sub(1) {
            0 => {
                self.flow_control = Some(padded(&[0x30, BLOCK_SIZE, 0]));
                BLOCK_SIZE
            }
            left => left,
        };
        let index = index.wrapping_add(1) & 0xf;
        self.stage = Receiving::Open { length, index, left_in_block, since_us: time_us };
        Progress::None
    }

    pub fn check_time(&mut self, time_us: u64) -> Result<(), TransferError> {
        match self.stage {
            Receiving::Open { since_us, .. } if time_us.saturating_sub(since_us) > TIMEOUT_US => {
                self.stage = Receiving::Idle;
                Err(TransferError::Timeout)
            }
            _ => Ok(()),
        }
    }

    fn broken(&mut self, error: TransferError) -> Progress {
        self.stage = Receiving::Idle;
        Progress::Broken(error)
    }
}
