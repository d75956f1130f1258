//! A participant that joins by one of the text protocols.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rotor_edge_core::can::Frame;

use super::can_bus::CanBus;
use super::codec::{Decoder, StreamItem};
use super::slcan::{self, Lines};
use super::socketcand::{self, Messages};
use super::spec::BIT_RATES;
use super::stream::ByteStream;
use super::wire::WireFrame;

/// A socketcand server answers at once; a machine that is busy may need longer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// `rotor-edge bus` answers within a millisecond. An adapter may know no versions and is not waited for.
const VERSION_TIMEOUT: Duration = Duration::from_millis(200);

/// Bytes on a stream, made frames.
pub struct TextClient<S, D> {
    stream: S,
    decoder: D,
    encode: fn(&WireFrame, &mut Vec<u8>),
    frames: VecDeque<Frame>,
    texts: VecDeque<String>,
    passed_over: u64,
    outgoing: Vec<u8>,
    description: String,
}

impl<S: ByteStream> TextClient<S, Lines> {
    /// Opens the channel of an SLCAN adapter.
    ///
    /// # Errors
    /// If the adapter is gone, or is something else.
    pub fn slcan(stream: S, bit_rate: u32, description: String) -> Result<Self> {
        let mut client = Self::new(stream, slcan::encode, description);
        let rate = BIT_RATES.iter().position(|rate| *rate == bit_rate).context("bit rate")?;
        // an empty line first, for half a line that the adapter may hold
        client.say(format!("\rC\rS{rate}\rO\rV\r").as_bytes())?;
        // the answer to V comes after the channel was opened: from then on no frame is missed
        let version = client.answer(VERSION_TIMEOUT, |text| text.starts_with('V'))?;
        if version.is_none() && client.decoder.begun().starts_with(b"<") {
            bail!(
                "{} greets as a socketcand server, expected SLCAN; join it with socketcand:",
                client.description
            );
        }
        Ok(client)
    }
}

impl<S: ByteStream> TextClient<S, Messages> {
    /// Opens an interface of a socketcand server.
    ///
    /// # Errors
    /// If the server refuses, is gone, or is something else.
    pub fn socketcand(stream: S, interface: &str, description: String) -> Result<Self> {
        let mut client = Self::new(stream, socketcand::encode_send, description);
        client.expect("hi", "the server's greeting")?;
        client.say(format!("< open {interface} >").as_bytes())?;
        client.expect("ok", &format!("that {interface} was opened"))?;
        client.say(b"< rawmode >")?;
        client.expect("ok", "raw mode")?;
        Ok(client)
    }

    fn expect(&mut self, word: &str, what: &str) -> Result<()> {
        match self.answer(ANSWER_TIMEOUT, |_| true)? {
            Some(text) if text == word => Ok(()),
            Some(text) => bail!("{}: the server says \"{text}\", expected {what}", self.description),
            None => bail!(
                "{} does not answer as a socketcand server, expected {what}; if it speaks SLCAN join it with slcan:",
                self.description
            ),
        }
    }
}

impl<S: ByteStream, D: Decoder> TextClient<S, D> {
    fn new(stream: S, encode: fn(&WireFrame, &mut Vec<u8>), description: String) -> Self {
        Self {
            stream,
            decoder: D::default(),
            encode,
            frames: VecDeque::new(),
            texts: VecDeque::new(),
            passed_over: 0,
            outgoing: Vec::new(),
            description,
        }
    }

    fn say(&mut self, bytes: &[u8]) -> Result<()> {
        self.stream.write_all(bytes).with_context(|| format!("{}: cannot be written to", self.description))
    }

    /// Waits for the next answer of this kind.
    fn answer(&mut self, timeout: Duration, wanted: impl Fn(&str) -> bool) -> Result<Option<String>> {
        let end = Instant::now() + timeout;
        loop {
            while let Some(text) = self.texts.pop_front() {
                if wanted(&text) {
                    return Ok(Some(text));
                }
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.hear(left)?;
        }
    }

    /// Takes in what is there or comes in time.
    fn hear(&mut self, timeout: Duration) -> Result<()> {
        let mut buffer = [0; 4096];
        let read = self.stream.read(&mut buffer, timeout);
        let number = match read.with_context(|| format!("{}: cannot be read from", self.description))? {
            None => return Ok(()),
            Some(0) => bail!("{} was closed by the other side", self.description),
            Some(number) => number,
        };
        for byte in &buffer[..number] {
            match self.decoder.push(*byte) {
                None => {}
                Some(StreamItem::Frame(frame)) => match frame.ours() {
                    Some(frame) => self.frames.push_back(frame),
                    None => self.passed_over += 1,
                },
                Some(StreamItem::Text(text)) => self.texts.push_back(text),
                Some(StreamItem::Garbage) => self.passed_over += 1,
            }
        }
        Ok(())
    }
}

impl<S: ByteStream, D: Decoder> CanBus for TextClient<S, D> {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        let mut outgoing = std::mem::take(&mut self.outgoing);
        outgoing.clear();
        (self.encode)(&WireFrame::from(frame), &mut outgoing);
        let said = self.say(&outgoing);
        self.outgoing = outgoing;
        said
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        let end = Instant::now() + timeout;
        let mut left = timeout;
        loop {
            if let Some(frame) = self.frames.pop_front() {
                return Ok(Some(frame));
            }
            self.hear(left)?;
            // answers to frames are of no use, and error frames of socketcand are not ours
            self.texts.clear();
            left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(self.frames.pop_front());
            }
        }
    }

    fn description(&self) -> String {
        self.description.clone()
    }

    fn passed_over(&self) -> u64 {
        self.passed_over
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// Gives what it holds in pieces of a given length, and keeps what is written.
    #[derive(Default)]
    struct Pieces {
        stream: Vec<u8>,
        length: usize,
        written: Vec<u8>,
    }

    impl ByteStream for Pieces {
        fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.written.extend(bytes);
            Ok(())
        }

        fn read(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<Option<usize>> {
            let number = self.length.min(self.stream.len()).min(buffer.len());
            buffer[..number].copy_from_slice(&self.stream[..number]);
            self.stream.drain(..number);
            Ok(Some(number))
        }
    }

    fn frames(bus: &mut impl CanBus) -> Vec<Frame> {
        let mut frames = Vec::new();
        while let Ok(Some(frame)) = bus.receive(Duration::from_secs(1)) {
            frames.push(frame);
        }
        frames
    }

    #[test]
    fn slcan_is_understood_however_the_stream_was_split_or_merged() {
        let stream = b"\r\r\rV1013\rt12320102\rz\rT000001230\rr1238\rt12\x07t7FF0BEEF\r\r";
        let expected = [Frame::standard(0x123, &[1, 2]), Frame::standard(0x7ff, &[])].map(Option::unwrap);
        for length in 1..=stream.len() {
            let pieces = Pieces { stream: stream.to_vec(), length, ..Pieces::default() };
            let mut client = TextClient::slcan(pieces, 250_000, "test".into()).unwrap();
            assert_eq!(client.stream.written, b"\rC\rS5\rO\rV\r");
            assert_eq!(
                (frames(&mut client), client.passed_over()),
                (expected.to_vec(), 3),
                "pieces of {length}"
            );
        }
    }

    #[test]
    fn socketcand_is_read_for_any_split_or_merge_of_the_stream() {
        let stream = b"< hi >< ok >< ok >< frame 123 1.5 0102 >< error 1 2.0 >< frame 00000123 1.6 01 >< frame 7ff 1.7  >";
        let expected = [Frame::standard(0x123, &[1, 2]), Frame::standard(0x7ff, &[])].map(Option::unwrap);
        for length in 1..=stream.len() {
            let pieces = Pieces { stream: stream.to_vec(), length, ..Pieces::default() };
            let mut client = TextClient::socketcand(pieces, "vcan0", "test".into()).unwrap();
            assert_eq!(client.stream.written, b"< open vcan0 >< rawmode >");
            assert_eq!(
                (frames(&mut client), client.passed_over()),
                (expected.to_vec(), 1),
                "pieces of {length}"
            );
            client.send(&expected[0]).unwrap();
            assert!(client.stream.written.ends_with(b"< rawmode >< send 123 2 01 02 >"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn slcan_over_a_serial_line_goes_both_ways() {
        use std::io::{Read, Write};

        use serialport::{SerialPort, TTYPort};

        let (mut adapter, device) = TTYPort::pair().unwrap();
        adapter.set_timeout(Duration::from_secs(20)).unwrap();
        let name = device.name().unwrap();
        drop(device);
        let serial = crate::bus::stream::Serial::open(&name, 115_200).unwrap();
        adapter.write_all(b"\r\r\rV1013\rt7FF10A\r").unwrap();
        let mut client = TextClient::slcan(serial, 500_000, "test".into()).unwrap();
        assert_eq!(client.receive(Duration::from_secs(20)).unwrap(), Frame::standard(0x7ff, &[10]));
        assert_eq!(client.receive(Duration::ZERO).unwrap(), None);
        client.send(&Frame::standard(0x123, &[1]).unwrap()).unwrap();
        let mut heard = [0; 18];
        adapter.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"\rC\rS6\rO\rV\rt123101\r");
        drop(adapter);
        assert!(
            client.receive(Duration::from_secs(20)).is_err(),
            "an adapter that was pulled out is no timeout"
        );
    }

    #[test]
    fn a_server_that_refuses_or_leaves_is_quoted() {
        for (stream, says) in [
            (
                &b"< hi >< error could not open bus >"[..],
                "\"error could not open bus\", expected that vcan0 was opened",
            ),
            (b"< hi >", "closed by the other side"),
            (b"HTTP/1.1 400 Bad Request\r\n\r\n", "closed by the other side"),
        ] {
            let pieces = Pieces { stream: stream.to_vec(), length: 64, ..Pieces::default() };
            let refused = TextClient::socketcand(pieces, "vcan0", "test".into());
            let message = refused.err().unwrap().to_string();
            assert!(message.contains(says), "{message}");
        }
    }
}
