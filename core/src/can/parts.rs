//! Messages in numbered parts, for buses that lose frames and repeat them: each frame says which it is, so that every one of
//! them may be missing, come twice or come late. The host asks, the node answers, and nobody waits for the other.
//!
//! Commands have two transports: [`isotp`](super::isotp) is the standard that other makers' tools speak, and these parts get a
//! command through where one lost or repeated frame breaks an ISO-TP transfer.
//!
//! | type | from | bytes |
//! |---|---|---|
//! | 50 offer | host | u16 length of the request, u8 part of the answer that is wanted next, u8 round, u32 CRC-32 of the request |
//! | 51 part | host | u16 number from 0, six bytes of the request |
//! | 52 acknowledgement | node | u16 parts of the request that are held, u8 length of the answer (0: none yet), u8 round, u32 CRC-32 |
//! | 53 answer part | node | u8 number from 0, u8 round, six bytes of the answer |
//!
//! A part counts only if it is the next one. Each offer is answered by what is held, and once the whole request was judged by up
//! to [`BURST_PARTS`] parts of the answer from the wanted one on. An acknowledgement (ack) for an earlier offer is ignored:
//! what is repeated must not be answered twice. The CRC-32 says which request is meant; one that is whole and does not have it is
//! forgotten.

use heapless::Vec;

use super::isotp::{Payload, Progress, TransferError};
use crate::checksum;

/// Bytes of a message in one part.
pub const PART_BYTES: usize = 6;
/// Parts between two offers, and after one, at most.
pub const BURST_PARTS: usize = 8;

/// A host has a request, and wants to know what is held of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Offer {
    /// Bytes of the request.
    pub length: u16,
    /// Number of the part of the answer that is wanted next.
    pub wanted: u8,
    /// Comes back with what it asks for.
    pub round: u8,
    /// CRC-32 of the request.
    pub crc32: u32,
}

impl Offer {
    /// The first offer of a request; `None` if it is longer than its length can say.
    pub fn new(request: &[u8]) -> Option<Self> {
        let length = u16::try_from(request.len()).ok()?;
        Some(Self { length, wanted: 0, round: 0, crc32: checksum::of(request) })
    }

    /// The eight bytes of the frame.
    pub fn encode(&self) -> Payload {
        head(self.length, self.wanted, self.round, self.crc32)
    }

    /// Reads a frame's bytes; `None` if they are not eight.
    pub fn decode(payload: &[u8]) -> Option<Self> {
        let (length, wanted, round, crc32) = read_head(payload)?;
        Some(Self { length, wanted, round, crc32 })
    }

    /// The same request is meant.
    pub fn is_of(&self, other: &Self) -> bool {
        (self.length, self.crc32) == (other.length, other.crc32)
    }

    /// Adds a part to `message`, which begins empty. Any but the next one is passed over.
    pub fn take<const N: usize>(&self, message: &mut Vec<u8, N>, payload: &[u8]) -> Progress {
        let &[low, high, ref data @ ..] = payload else { return Progress::None };
        let missing = usize::from(self.length).saturating_sub(message.len());
        let place = usize::from(u16::from_le_bytes([low, high])).saturating_mul(PART_BYTES);
        let Some(data) = data.get(..missing.min(PART_BYTES)) else { return Progress::None };
        if missing == 0 || place != message.len() || message.extend_from_slice(data).is_err() {
            return Progress::None;
        }
        if data.len() < missing {
            return Progress::None;
        }
        if checksum::of(message) == self.crc32 {
            return Progress::Complete;
        }
        message.clear();
        Progress::Broken(TransferError::Checksum)
    }
}

/// Acknowledgement of an offer, with the parts of its request that the node has received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ack {
    pub parts: u16,
    /// Bytes of the answer; zero before there is one.
    pub answer_bytes: u8,
    /// Round of the offer.
    pub round: u8,
    /// That of the offer.
    pub crc32: u32,
}

impl Ack {
    /// The eight bytes of the frame.
    pub fn encode(&self) -> Payload {
        head(self.parts, self.answer_bytes, self.round, self.crc32)
    }

    /// Reads a frame's bytes; `None` if they are not eight.
    pub fn decode(payload: &[u8]) -> Option<Self> {
        let (parts, answer_bytes, round, crc32) = read_head(payload)?;
        Some(Self { parts, answer_bytes, round, crc32 })
    }
}

/// Parts of a message of so many bytes.
pub fn parts_of(bytes: usize) -> usize {
    bytes.div_ceil(PART_BYTES)
}

/// Part `number` of a request; `None` beyond its end.
pub fn request_part(request: &[u8], number: u16) -> Option<Payload> {
    let [low, high] = number.to_le_bytes();
    part(request, usize::from(number), [low, high])
}

/// Part `number` of an answer; `None` beyond its end.
pub fn answer_part(answer: &[u8], number: u8, round: u8) -> Option<Payload> {
    part(answer, usize::from(number), [number, round])
}

fn part(message: &[u8], number: usize, [a, b]: [u8; 2]) -> Option<Payload> {
    let data = message.chunks(PART_BYTES).nth(number)?;
    let mut payload = [a, b, 0, 0, 0, 0, 0, 0];
    for (place, &byte) in payload.iter_mut().skip(2).zip(data) {
        *place = byte;
    }
    Some(payload)
}

fn head(number: u16, third: u8, fourth: u8, crc32: u32) -> Payload {
    let ([a, b], [e, f, g, h]) = (number.to_le_bytes(), crc32.to_le_bytes());
    [a, b, third, fourth, e, f, g, h]
}

fn read_head(payload: &[u8]) -> Option<(u16, u8, u8, u32)> {
    let &[a, b, third, fourth, e, f, g, h] = payload else { return None };
    Some((u16::from_le_bytes([a, b]), third, fourth, u32::from_le_bytes([e, f, g, h])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message() -> std::vec::Vec<u8> {
        (0..=99).collect()
    }

    /// What parts in this order lead to, and what is held then.
    fn taken(order: impl IntoIterator<Item = u16>) -> (Progress, Vec<u8, 128>) {
        let (offer, mut held) = (Offer::new(&message()).unwrap(), Vec::new());
        let mut progress = Progress::None;
        for number in order {
            progress = offer.take(&mut held, &request_part(&message(), number).unwrap());
        }
        (progress, held)
    }

    #[test]
    fn a_message_is_whole_with_its_last_part_and_only_in_order() {
        let parts = parts_of(message().len()) as u16;
        assert_eq!((parts, request_part(&message(), parts)), (17, None));
        let (progress, held) = taken(0..parts);
        assert_eq!((progress, held.as_slice()), (Progress::Complete, &message()[..]));
        for (order, bytes) in
            [(&[0, 2, 3][..], 6), (&[1, 2, 3], 0), (&[0, 0, 1, 0, 1], 12), (&[0, 1, 16], 12)]
        {
            let (progress, held) = taken(order.iter().copied());
            assert_eq!((progress, held.len()), (Progress::None, bytes), "{order:?}");
        }
        assert_eq!(
            taken((0..parts).chain([16, 0])).1.as_slice(),
            message(),
            "what comes after it changes nothing"
        );
    }

    #[test]
    fn a_message_that_is_not_the_one_offered_is_forgotten() {
        let (offer, mut held) = (Offer::new(&message()).unwrap(), Vec::<u8, 128>::new());
        for number in 0..17 {
            let mut part = request_part(&message(), number).unwrap();
            part[2] ^= u8::from(number == 5);
            let broken = Progress::Broken(TransferError::Checksum);
            let expected = if number == 16 { broken } else { Progress::None };
            assert_eq!(offer.take(&mut held, &part), expected);
        }
        assert!(held.is_empty());
    }

    #[test]
    fn short_frames_and_full_buffers_are_passed_over() {
        let offer = Offer::new(&message()).unwrap();
        let mut small = Vec::<u8, 8>::new();
        for number in 0..17 {
            assert_eq!(offer.take(&mut small, &request_part(&message(), number).unwrap()), Progress::None);
        }
        assert_eq!(small.len(), 6);
        let mut empty = Vec::<u8, 128>::new();
        let whole = request_part(&message(), 0).unwrap();
        for length in 0..8 {
            assert_eq!(offer.take(&mut empty, &whole[..length]), Progress::None);
            assert_eq!((Offer::decode(&whole[..length]), Ack::decode(&whole[..length])), (None, None));
        }
        assert!(empty.is_empty());
    }

    #[test]
    fn frames_are_as_documented() {
        let offer = Offer { length: 0x0201, wanted: 3, round: 4, crc32: 0x0807_0605 };
        assert_eq!(offer.encode(), [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(Offer::decode(&offer.encode()), Some(offer));
        let ack = Ack { parts: 0x0201, answer_bytes: 3, round: 4, crc32: 0x0807_0605 };
        assert_eq!((ack.encode(), Ack::decode(&offer.encode())), (offer.encode(), Some(ack)));
        assert_eq!(request_part(&message(), 16), Some([16, 0, 96, 97, 98, 99, 0, 0]));
        assert_eq!(answer_part(&message(), 16, 9), Some([16, 9, 96, 97, 98, 99, 0, 0]));
    }
}
