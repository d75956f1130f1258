//! SLCAN: what serial CAN adapters speak. One line a frame, ended by a carriage return:
//! `t12330102AB` is identifier 0x123 with the three bytes 01 02 AB; `T` has eight digits of identifier, `r` and
//! `R` are remote frames. Adapters may append four digits of time. An adapter answers commands with a
//! carriage return or a bell, some answer frames with `z`; none of that has to be waited for.

use super::codec::{Decoder, StreamItem};
use super::wire::{WireFrame, bytes_of_hex, number_of_hex, push_hex};

/// No line of the protocol is longer: `T`, identifier, length, eight bytes, time.
const LONGEST_LINE: usize = 1 + 8 + 1 + 16 + 4;
const TIME_DIGITS: usize = 4;
/// What an adapter says to a command that it refuses.
pub const BELL: u8 = 7;

/// Appends the line of a frame.
pub fn encode(frame: &WireFrame, line: &mut Vec<u8>) {
    let kind = match (frame.is_remote(), frame.is_extended()) {
        (false, false) => b't',
        (false, true) => b'T',
        (true, false) => b'r',
        (true, true) => b'R',
    };
    line.push(kind);
    frame.push_id(line);
    line.push(b'0' + frame.length() as u8);
    for byte in frame.bytes() {
        push_hex(*byte, line);
    }
    line.push(b'\r');
}

#[derive(Debug, Default)]
pub struct Lines {
    line: Vec<u8>,
    too_long: bool,
}

impl Lines {
    /// What came of a line that is not whole yet.
    pub fn begun(&self) -> &[u8] {
        &self.line
    }
}

impl Decoder for Lines {
    fn push(&mut self, byte: u8) -> Option<StreamItem> {
        match byte {
            b'\r' | b'\n' => self.end(),
            BELL => {
                self.line.clear();
                self.too_long = false;
                Some(StreamItem::Garbage)
            }
            _ if self.line.len() == LONGEST_LINE => {
                self.too_long = true;
                None
            }
            _ => {
                self.line.push(byte);
                None
            }
        }
    }
}

impl Lines {
    fn end(&mut self) -> Option<StreamItem> {
        let line = std::mem::take(&mut self.line);
        if std::mem::take(&mut self.too_long) {
            return Some(StreamItem::Garbage);
        }
        let heard = match (line.first()?, std::str::from_utf8(&line)) {
            (b't' | b'T' | b'r' | b'R', Ok(text)) => {
                frame(text).map_or(StreamItem::Garbage, StreamItem::Frame)
            }
            (first, Ok(text)) if first.is_ascii_alphabetic() => StreamItem::Text(text.to_string()),
            _ => StreamItem::Garbage,
        };
        Some(heard)
    }
}

fn frame(line: &str) -> Option<WireFrame> {
    let (kind, rest) = line.split_at_checked(1)?;
    let extended = kind == "T" || kind == "R";
    let (id, rest) = rest.split_at_checked(if extended { 8 } else { 3 })?;
    let (length, rest) = rest.split_at_checked(1)?;
    let (id, length) = (number_of_hex(id)?, length.parse::<usize>().ok()?);
    let remote = kind.eq_ignore_ascii_case("r");
    let (data, time) = rest.split_at_checked(if remote { 0 } else { 2 * length })?;
    if !time.is_empty() && (time.len() != TIME_DIGITS || number_of_hex(time).is_none()) {
        return None;
    }
    match remote {
        true => WireFrame::remote(id, extended, length),
        false => WireFrame::data(id, extended, &bytes_of_hex(data)?),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bus::codec::decode_all;
    use crate::bus::wire::testing::any_frame;

    fn line(frame: &WireFrame) -> Vec<u8> {
        let mut line = Vec::new();
        encode(frame, &mut line);
        line
    }

    #[test]
    fn lines_are_those_of_python_can() {
        let frame = WireFrame::data(0x123, false, &[1, 2, 0xab]).unwrap();
        assert_eq!(line(&frame), b"t12330102AB\r");
        assert_eq!(line(&WireFrame::data(0x123, true, &[]).unwrap()), b"T000001230\r");
        assert_eq!(line(&WireFrame::remote(0x7ff, false, 8).unwrap()), b"r7FF8\r");
    }

    proptest! {
        #[test]
        fn every_frame_comes_back_with_and_without_a_time(frame in any_frame(), time in any::<u16>()) {
            let plain = line(&frame);
            let mut timed = plain[..plain.len() - 1].to_vec();
            timed.extend(format!("{time:04x}\r").bytes());
            prop_assert_eq!(decode_all::<Lines>(&plain), [StreamItem::Frame(frame)]);
            prop_assert_eq!(decode_all::<Lines>(&timed), [StreamItem::Frame(frame)]);
        }

        #[test]
        fn no_bytes_stop_the_frame_after_them(noise in proptest::collection::vec(any::<u8>(), 0..200), frame in any_frame()) {
            let stream = [noise, vec![b'\r'], line(&frame)].concat();
            prop_assert_eq!(decode_all::<Lines>(&stream).pop(), Some(StreamItem::Frame(frame)));
        }
    }

    #[test]
    fn what_is_no_frame_is_garbage_and_what_is_a_command_is_text() {
        for bad in [
            "t",
            "t12",
            "t123",
            "t1239",
            "t12310",
            "t123101FF",
            "t8000",
            "T200000000",
            "t+230",
            "t123101+",
            "tééé",
            "r1234 x",
            "\u{1}",
        ] {
            assert_eq!(decode_all::<Lines>(format!("{bad}\r").as_bytes()), [StreamItem::Garbage], "{bad}");
        }
        let text = |text: &str| StreamItem::Text(text.into());
        assert_eq!(
            decode_all::<Lines>(b"\r\rC\rS6\r\n\rz\r\x07"),
            [text("C"), text("S6"), text("z"), StreamItem::Garbage]
        );
        let long = [b"t1238".as_slice(), &[b'0'; 1000], b"\rO\r"].concat();
        assert_eq!(decode_all::<Lines>(&long), [StreamItem::Garbage, text("O")]);
    }
}
