//! socketcand: messages between angle brackets. `< send 123 3 1 2 ab >` to the server,
//! `< frame 123 1700000000.000001 0102AB >` from it.

use std::io::Write;

use super::codec::{Decoder, StreamItem};
use super::wire::{WireFrame, bytes_of_hex, number_of_hex, push_hex};

/// Longer than any message of the protocol: `send` of an FD frame has 64 bytes of two digits.
const LONGEST_MESSAGE: usize = 256;
/// Digits of an extended identifier; up to three are a standard one.
const STANDARD_DIGITS: usize = 3;

/// Appends a client's message of a frame; nothing for a remote frame, which the protocol does not have.
pub fn encode_send(frame: &WireFrame, message: &mut Vec<u8>) {
    if frame.is_remote() {
        return;
    }
    message.extend(b"< send ");
    frame.push_id(message);
    message.extend([b' ', b'0' + frame.length() as u8, b' ']);
    for byte in frame.bytes() {
        push_hex(*byte, message);
        message.push(b' ');
    }
    message.push(b'>');
}

/// Appends a server's message of a frame, with its time since 1970; nothing for a remote frame.
pub fn encode_frame(frame: &WireFrame, time_us: u64, message: &mut Vec<u8>) {
    if frame.is_remote() {
        return;
    }
    message.extend(b"< frame ");
    frame.push_id(message);
    let (seconds, micros) = (time_us / 1_000_000, time_us % 1_000_000);
    // writing to memory cannot fail
    let _ = write!(message, " {seconds}.{micros:06} ");
    for byte in frame.bytes() {
        push_hex(*byte, message);
    }
    message.extend(b" >");
}

#[derive(Debug, Default)]
pub struct Messages {
    /// What came after the opening bracket.
    inside: Option<Vec<u8>>,
}

impl Decoder for Messages {
    fn push(&mut self, byte: u8) -> Option<StreamItem> {
        match (byte, &mut self.inside) {
            (b'<', inside) => inside.replace(Vec::new()).map(|_| StreamItem::Garbage),
            (b'>', inside) => Some(inside.take().map_or(StreamItem::Garbage, |text| message(&text))),
            (_, Some(text)) if text.len() == LONGEST_MESSAGE => {
                self.inside = None;
                Some(StreamItem::Garbage)
            }
            (_, Some(text)) => {
                text.push(byte);
                None
            }
            (_, None) => None,
        }
    }
}

fn message(text: &[u8]) -> StreamItem {
    let Ok(text) = std::str::from_utf8(text) else { return StreamItem::Garbage };
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let frame = match words.as_slice() {
        [] => return StreamItem::Garbage,
        ["send", id, length, bytes @ ..] => sent(id, length, bytes),
        ["frame", id, _time, bytes @ ..] => bytes_of_hex(&bytes.concat()).and_then(|bytes| data(id, &bytes)),
        [word, ..] if is_of_frame(word) => None,
        words => return StreamItem::Text(words.join(" ")),
    };
    frame.map_or(StreamItem::Garbage, StreamItem::Frame)
}

/// Whether it is a word for a frame of any kind. Branches of socketcand have `sendrtr`, `sendfd`, `fdsend` and their
/// like for remote and FD frames, and answer to none of them.
fn is_of_frame(word: &str) -> bool {
    word.starts_with("send") || matches!(word, "fdsend" | "frame" | "fdframe" | "rtr")
}

fn sent(id: &str, length: &str, bytes: &[&str]) -> Option<WireFrame> {
    let byte = |text: &&str| number_of_hex(text).and_then(|byte| u8::try_from(byte).ok());
    let bytes: Vec<u8> = bytes.iter().map(byte).collect::<Option<_>>()?;
    (number_of_hex(length)? as usize == bytes.len()).then(|| data(id, &bytes))?
}

fn data(id: &str, bytes: &[u8]) -> Option<WireFrame> {
    WireFrame::data(number_of_hex(id)?, id.len() > STANDARD_DIGITS, bytes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bus::codec::decode_all;
    use crate::bus::wire::testing::any_frame;

    fn text(frame: &WireFrame, encode: impl Fn(&WireFrame, &mut Vec<u8>)) -> Vec<u8> {
        let mut message = Vec::new();
        encode(frame, &mut message);
        message
    }

    #[test]
    fn messages_are_those_of_the_protocol() {
        let frame = WireFrame::data(0x123, false, &[1, 2, 0xab]).unwrap();
        assert_eq!(text(&frame, encode_send), b"< send 123 3 01 02 AB >");
        let timed = |frame: &WireFrame, out: &mut Vec<u8>| encode_frame(frame, 1_700_000_000_000_001, out);
        assert_eq!(text(&frame, timed), b"< frame 123 1700000000.000001 0102AB >");
        // two blanks: python-can wants the third word even where it is empty
        assert_eq!(
            text(&WireFrame::data(1, true, &[]).unwrap(), timed),
            b"< frame 00000001 1700000000.000001  >"
        );
        // python-can writes bytes without a leading zero
        assert_eq!(decode_all::<Messages>(b"< send 123 3 1 2 ab >"), [StreamItem::Frame(frame)]);
        assert_eq!(decode_all::<Messages>(b"<send 123 3 1 2 ab>"), [StreamItem::Frame(frame)]);
    }

    proptest! {
        #[test]
        fn every_data_frame_comes_back_and_no_remote_frame_is_written(frame in any_frame(), time_us in 0..u64::MAX) {
            let back = if frame.is_remote() { vec![] } else { vec![StreamItem::Frame(frame)] };
            prop_assert_eq!(&decode_all::<Messages>(&text(&frame, encode_send)), &back);
            let timed = |frame: &WireFrame, out: &mut Vec<u8>| encode_frame(frame, time_us, out);
            prop_assert_eq!(&decode_all::<Messages>(&text(&frame, timed)), &back);
        }

        #[test]
        fn no_bytes_stop_the_message_after_them(noise in proptest::collection::vec(any::<u8>(), 0..500)) {
            let stream = [noise, b"< open vcan0 >".to_vec()].concat();
            prop_assert_eq!(decode_all::<Messages>(&stream).pop(), Some(StreamItem::Text("open vcan0".into())));
        }
    }

    #[test]
    fn merged_socketcand_messages_are_separated() {
        let stream = b"< hi >< ok >\n< frame 123 1.0 0102 >< frame 124 1.0  >< error 1 1.0 >";
        let [hi, ok, first, second, error] = <[_; 5]>::try_from(decode_all::<Messages>(stream)).unwrap();
        assert_eq!([hi, ok, error], ["hi", "ok", "error 1 1.0"].map(|text| StreamItem::Text(text.into())));
        assert_eq!(first, StreamItem::Frame(WireFrame::data(0x123, false, &[1, 2]).unwrap()));
        assert_eq!(second, StreamItem::Frame(WireFrame::data(0x124, false, &[]).unwrap()));
    }

    #[test]
    fn what_is_no_message_is_garbage() {
        for bad in [
            "<>",
            "< >",
            ">",
            "< send >",
            "< send 123 >",
            "< send 123 2 1 >",
            "< send 123 1 1 2 >",
            "< send 123 9 0 0 0 0 0 0 0 0 0 >",
            "< send 800 0 >",
            "< send 123 1 100 >",
            "< send -1 0 >",
            "< frame 123 1.0 0 >",
            "< frame 20000000 1.0 00 >",
            "< send 123 8  >",
            "< fdsend 123 1 2 1 2 >",
            "< sendrtr 123 >",
            "< sendfd 123 1 2 1 2 >",
            "< rtr 123 1.0 >",
            "< \u{fffd} é< ok >",
        ] {
            assert_eq!(decode_all::<Messages>(bad.as_bytes()).first(), Some(&StreamItem::Garbage), "{bad}");
        }
        // as python-can writes an FD frame of 64 bytes
        let fd = ["< send 12345678 40 ", &["ff"; 64].join(" "), " >< ok >"].concat();
        assert_eq!(
            decode_all::<Messages>(fd.as_bytes()),
            [StreamItem::Garbage, StreamItem::Text("ok".into())]
        );
        let long = [b"< send ".as_slice(), &[b' '; 300], b"< ok >"].concat();
        assert_eq!(decode_all::<Messages>(&long), [StreamItem::Garbage, StreamItem::Text("ok".into())]);
    }
}
