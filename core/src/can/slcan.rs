//! SLCAN: frames as lines of text over a serial line (Lawicel's protocol, as python-can and USB adapters speak it).
//!
//! Sans-IO: bytes in one by one, commands out; frames in, lines out. `t12330102AB\r` is identifier 0x123 with the
//! bytes 01 02 AB. An adapter answers each command with [`ACCEPTED`] or [`REFUSED`].

use heapless::Vec;

use super::frame::Frame;

/// Longest line of a frame: `t`, three digits, length, sixteen digits, the end.
pub const LINE_BYTES: usize = 22;
/// Longest command that is kept: an extended frame with a time stamp. What is longer is not SLCAN.
const COMMAND_BYTES: usize = 31;
const END: u8 = b'\r';
const BELL: u8 = 0x07;
/// Digits of a time stamp, which some adapters append.
const STAMP_DIGITS: usize = 4;

/// An adapter's answer to a command that it obeyed.
pub const ACCEPTED: &str = "\r";
/// An adapter's answer to a command that it did not understand or cannot obey: the bell.
pub const REFUSED: &str = "\x07";

/// An adapter's answer to a question or setting by its letter: hardware 1.0, software 1.3, serial number `EDGE`, no
/// error; what is only a setting is accepted.
pub const fn answer(letter: u8) -> &'static str {
    match letter {
        b'V' => "V1013\r",
        b'N' => "NEDGE\r",
        b'F' => "F00\r",
        _ => ACCEPTED,
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SlcanLine {
    /// `t`: a standard data frame.
    Frame(Frame),
    /// `T`, `r`, `R`: an extended or a remote frame, which this protocol has no use for.
    OtherFrame,
    /// `O`, `L`: frames may flow.
    Open,
    /// `C`: no more frames.
    Close,
    /// `S0` to `S8`, `sXXYY`: the bit rate, which a wire without bits ignores.
    BitRate,
    /// `V`, `v`, `N`, `F`, `Z`, …: known questions and settings beside the matter, by their letter.
    Setting(u8),
    /// Nothing between two ends, or an adapter's answer: not a command.
    Empty,
    /// Neither a frame nor a command, or damaged.
    Unknown,
}

/// Collects bytes into lines.
///
/// ```
/// use rotor_edge_core::can::slcan::{Decoder, SlcanLine, encode};
/// let mut decoder = Decoder::new();
/// let lines: Vec<SlcanLine> = b"O\rt12330102AB\r".iter().filter_map(|&byte| decoder.push(byte)).collect();
/// let [SlcanLine::Open, SlcanLine::Frame(frame)] = lines[..] else { panic!() };
/// assert_eq!((frame.raw_id(), frame.bytes()), (0x123, &[1, 2, 0xab][..]));
/// assert_eq!(encode(&frame).as_slice(), b"t12330102AB\r");
/// ```
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    line: Vec<u8, COMMAND_BYTES>,
    too_long: bool,
}

impl Decoder {
    /// At the beginning of a line.
    pub const fn new() -> Self {
        Self { line: Vec::new(), too_long: false }
    }

    /// Takes one byte; the line, when this byte ends it. An adapter's bell ends a line as well.
    pub fn push(&mut self, byte: u8) -> Option<SlcanLine> {
        match byte {
            END | BELL => {
                let line = if self.too_long { SlcanLine::Unknown } else { SlcanLine::of(&self.line) };
                self.line.clear();
                self.too_long = false;
                Some(line)
            }
            // Between carriage return and line feed some terminals do not choose.
            b'\n' => None,
            _ => {
                self.too_long |= self.line.push(byte).is_err();
                None
            }
        }
    }
}

impl SlcanLine {
    fn of(line: &[u8]) -> Self {
        let Some((&letter, rest)) = line.split_first() else {
            return Self::Empty;
        };
        match letter {
            b't' => frame(rest).map_or(Self::Unknown, Self::Frame),
            b'T' | b'r' | b'R' => Self::OtherFrame,
            b'O' | b'L' if rest.is_empty() => Self::Open,
            b'C' if rest.is_empty() => Self::Close,
            b'S' | b's' => Self::BitRate,
            b'V' | b'v' | b'N' | b'F' | b'Z' | b'M' | b'm' | b'W' | b'X' | b'Q' => Self::Setting(letter),
            b'z' if rest.is_empty() => Self::Empty,
            _ => Self::Unknown,
        }
    }
}

/// What follows the `t` of a data frame.
fn frame(text: &[u8]) -> Option<Frame> {
    let (&[first, second, third, length], digits) = text.split_first_chunk()?;
    let id = digit(first)? << 8 | digit(second)? << 4 | digit(third)?;
    let length = usize::from(digit(length)?);
    let mut payload = [0; 8];
    let (bytes, stamp) = digits.split_at_checked(2 * length)?;
    let (pairs, _) = bytes.as_chunks();
    for (byte, &[high, low]) in payload.get_mut(..length)?.iter_mut().zip(pairs) {
        *byte = (digit(high)? << 4 | digit(low)?) as u8;
    }
    if !stamp.is_empty() && (stamp.len() != STAMP_DIGITS || stamp.iter().any(|&c| digit(c).is_none())) {
        return None;
    }
    Frame::standard(id, payload.get(..length)?)
}

fn digit(character: u8) -> Option<u16> {
    match character {
        b'0'..=b'9' => Some(u16::from(character - b'0')),
        b'A'..=b'F' => Some(u16::from(character - b'A') + 10),
        b'a'..=b'f' => Some(u16::from(character - b'a') + 10),
        _ => None,
    }
}

/// A frame as one line, its end included.
pub fn encode(frame: &Frame) -> Vec<u8, LINE_BYTES> {
    let id = frame.raw_id();
    let bytes = frame.bytes();
    let mut line = Vec::new();
    // Nothing here can be full: the capacity is that of eight bytes.
    let mut put = |character| {
        let _ = line.push(character);
    };
    put(b't');
    for place in [id >> 8, id >> 4, id, bytes.len() as u16] {
        put(character(place));
    }
    for &byte in bytes {
        put(character(u16::from(byte) >> 4));
        put(character(u16::from(byte)));
    }
    put(END);
    line
}

/// The hexadecimal digit of the lowest four bits.
fn character(value: u16) -> u8 {
    match (value & 0xf) as u8 {
        digit @ 0..=9 => b'0' + digit,
        letter => b'A' - 10 + letter,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn lines(text: &[u8]) -> std::vec::Vec<SlcanLine> {
        let mut decoder = Decoder::new();
        text.iter().filter_map(|&byte| decoder.push(byte)).collect()
    }

    fn frame(id: u16, bytes: &[u8]) -> SlcanLine {
        SlcanLine::Frame(Frame::standard(id, bytes).unwrap())
    }

    #[test]
    fn what_python_can_sends_when_it_opens_a_bus_is_understood() {
        assert_eq!(lines(b"C\rS6\rO\r"), [SlcanLine::Close, SlcanLine::BitRate, SlcanLine::Open]);
        assert_eq!(
            lines(b"\r\rV\rN\rZ0\r"),
            [
                SlcanLine::Empty,
                SlcanLine::Empty,
                SlcanLine::Setting(b'V'),
                SlcanLine::Setting(b'N'),
                SlcanLine::Setting(b'Z')
            ]
        );
    }

    #[test]
    fn handwritten_slcan_lines_are_read_in_either_case() {
        let want = frame(0x7af, &[0, 0x1b, 0xff]);
        assert_eq!(lines(b"t7AF3001BFF\rt7af3001bff\rt7AF3001BFF12c4\r"), [want, want, want]);
        assert_eq!(lines(b"t0000\r"), [frame(0, &[])]);
    }

    #[test]
    fn every_length_and_identifier_comes_back_from_its_line() {
        let mut random = Random::new(1);
        for id in 0..=0x7ff {
            let mut payload = [0; 8];
            payload.fill_with(|| (random.signed() * 127.0) as i8 as u8);
            let bytes = &payload[..usize::from(id) % 9];
            let line = encode(&Frame::standard(id, bytes).unwrap());
            assert_eq!(line.len(), 6 + 2 * bytes.len());
            assert_eq!(lines(&line), [frame(id, bytes)]);
        }
    }

    #[test]
    fn damaged_lines_are_unknown_and_do_not_harm_the_next() {
        for damaged in [
            &b"t8000"[..],
            b"t1239",
            b"t12330102A",
            b"t12330102ABC",
            b"t12330102ABCDEFG",
            b"t12330102Ax",
            b"t12",
            b"O1",
            b"hello",
            b"t1238000000000000000000000000000000000000000000000000",
        ] {
            let mut text = std::vec::Vec::from(damaged);
            text.extend(b"\rt1230\r");
            assert_eq!(lines(&text), [SlcanLine::Unknown, frame(0x123, &[])], "{damaged:?}");
        }
    }

    #[test]
    fn extended_and_remote_frames_are_told_from_damage() {
        assert_eq!(lines(b"T000001232AABB\rr1230\rR000001230\r"), [SlcanLine::OtherFrame; 3]);
    }

    #[test]
    fn a_bell_ends_what_stands_before_it() {
        assert_eq!(lines(b"\x07t1230\r"), [SlcanLine::Empty, frame(0x123, &[])]);
    }
}
