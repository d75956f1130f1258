//! Recordings: candump logs, one line a frame, `(1700000000.123456) can0 123#0102`.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use rotor_edge_core::can::Frame;

use super::can_bus::CanBus;
use super::wire::{WireFrame, bytes_of_hex, number_of_hex, push_hex};

/// Name of the bus in our own recordings.
pub const CHANNEL: &str = "can0";
/// Set in the identifiers of error frames.
const ERROR_FLAG: u32 = 1 << 29;
const MICROSECOND_DIGITS: usize = 6;
/// How much of a bad line is quoted.
const QUOTED_CHARACTERS: usize = 60;

/// Microseconds since 1970 that never go back, whatever is done to the machine's clock.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    start_us: u64,
}

impl Default for Clock {
    fn default() -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { start: Instant::now(), start_us: since_1970.as_micros() as u64 }
    }
}

impl Clock {
    pub fn now_us(&self) -> u64 {
        self.start_us + self.start.elapsed().as_micros() as u64
    }
}

/// Writes a log. What was written is with the operating system, so that the end of the program loses nothing.
pub struct LogWriter<W> {
    out: W,
    text: Vec<u8>,
}

impl LogWriter<File> {
    /// Begins a log, in place of any older one.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).with_context(|| format!("{}: cannot be written", path.display()))?;
        Ok(Self::new(file))
    }
}

impl<W: Write> LogWriter<W> {
    /// A log that goes to `out`.
    pub fn new(out: W) -> Self {
        Self { out, text: Vec::new() }
    }

    /// Writes frames of one moment, all at once.
    ///
    /// # Errors
    /// If the file takes nothing any more.
    pub fn write<'a>(
        &mut self,
        time_us: u64,
        frames: impl IntoIterator<Item = &'a WireFrame>,
    ) -> io::Result<()> {
        self.text.clear();
        for frame in frames {
            push_line(&mut self.text, time_us, frame);
        }
        self.out.write_all(&self.text)?;
        self.out.flush()
    }
}

fn push_line(text: &mut Vec<u8>, time_us: u64, frame: &WireFrame) {
    let (seconds, micros) = (time_us / 1_000_000, time_us % 1_000_000);
    // writing to memory cannot fail
    let _ = write!(text, "({seconds:010}.{micros:06}) {CHANNEL} ");
    frame.push_id(text);
    text.push(b'#');
    if frame.is_remote() {
        let _ = write!(text, "R{}", frame.length());
    }
    for byte in frame.bytes() {
        push_hex(*byte, text);
    }
    text.push(b'\n');
}

/// One line of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogEntry {
    /// Row of the file, from 1.
    pub row: u64,
    /// Microseconds since 1970, or since whatever the recorder counts from.
    pub time_us: u64,
    /// Name of the bus.
    pub channel: String,
    /// The frame; `None` for CAN FD and error frames.
    pub frame: Option<WireFrame>,
}

/// A line of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogLine {
    /// As a recorder writes it.
    Whole(LogEntry),
    /// Of no recorder: cut when the power went, or damaged. What it says, and what was expected, in one sentence.
    Torn(String),
}

impl LogLine {
    /// What a whole one holds.
    pub fn whole(self) -> Option<LogEntry> {
        match self {
            Self::Whole(logged) => Some(logged),
            Self::Torn(_) => None,
        }
    }
}

/// Reads a log line by line.
pub struct LogReader<R> {
    input: R,
    name: String,
    row: u64,
}

impl LogReader<BufReader<File>> {
    /// Opens a log.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let file = File::open(path).with_context(|| format!("{name}: cannot be read"))?;
        Ok(Self::new(BufReader::new(file), name))
    }
}

impl<R: BufRead> LogReader<R> {
    /// A log from any source; `name` is for messages.
    pub fn new(input: R, name: String) -> Self {
        Self { input, name, row: 0 }
    }

    fn torn(&self, line: &str) -> LogLine {
        let quoted: String = line.trim().chars().take(QUOTED_CHARACTERS).collect();
        LogLine::Torn(format!(
            "{}, row {}: \"{}\" is not a line of a candump log, expected a line such as (1700000000.123456) can0 123#0102; \
             python-can's can_logconvert converts ASC and BLF files",
            self.name,
            self.row,
            quoted.escape_debug()
        ))
    }

    fn next_line(&mut self) -> Result<Option<LogLine>> {
        loop {
            let mut line = Vec::new();
            let number = self.input.read_until(b'\n', &mut line);
            if number.with_context(|| format!("{}: cannot be read", self.name))? == 0 {
                return Ok(None);
            }
            self.row += 1;
            let line = String::from_utf8_lossy(&line);
            if line.trim().is_empty() {
                continue;
            }
            return Ok(Some(parse(self.row, &line).map_or_else(|| self.torn(&line), LogLine::Whole)));
        }
    }
}

impl<R: BufRead> Iterator for LogReader<R> {
    type Item = Result<LogLine>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_line().transpose()
    }
}

fn parse(row: u64, line: &str) -> Option<LogEntry> {
    let mut words = line.split_ascii_whitespace();
    let time = words.next()?.strip_prefix('(')?.strip_suffix(')')?;
    let channel = words.next()?.to_string();
    let (id, rest) = words.next()?.split_once('#')?;
    // newer tools add the direction
    if !matches!(words.next(), None | Some("R" | "T")) || words.next().is_some() {
        return None;
    }
    Some(LogEntry { row, time_us: time_us(time)?, channel, frame: frame(id, rest)? })
}

fn time_us(text: &str) -> Option<u64> {
    let (seconds, fraction) = text.split_once('.')?;
    if fraction.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.') {
        return None;
    }
    let digits = fraction.bytes().chain(std::iter::repeat(b'0')).take(MICROSECOND_DIGITS);
    let micros = digits.fold(0, |sum, digit| 10 * sum + u64::from(digit.wrapping_sub(b'0')));
    seconds.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(micros)
}

/// The frame of `id#rest`; `Some(None)` if it is of a kind that we have no use for.
fn frame(id: &str, rest: &str) -> Option<Option<WireFrame>> {
    let extended = match id.len() {
        3 => false,
        8 => true,
        _ => return None,
    };
    let id = number_of_hex(id)?;
    if let Some(flexible) = rest.strip_prefix('#') {
        return number_of_hex(flexible.get(..1)?).and(bytes_of_hex(flexible.get(1..)?)).map(|_| None);
    }
    if let Some(length) = rest.strip_prefix('R') {
        let length = if length.is_empty() { 0 } else { length.parse().ok()? };
        return WireFrame::remote(id, extended, length).map(Some);
    }
    // a length code above eight
    let data = rest.split_once('_').map_or(rest, |(data, _)| data);
    let bytes = bytes_of_hex(data)?;
    if extended && id & ERROR_FLAG != 0 {
        return Some(None);
    }
    WireFrame::data(id, extended, &bytes).map(Some)
}

/// A bus of which everything sent and heard is recorded.
pub struct RecordingBus<B> {
    bus: B,
    log: LogWriter<File>,
    path: String,
    clock: Clock,
}

impl<B: CanBus> RecordingBus<B> {
    /// Begins the recording.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn new(bus: B, path: &Path) -> Result<Self> {
        let (log, clock) = (LogWriter::create(path)?, Clock::default());
        Ok(Self { bus, log, path: path.display().to_string(), clock })
    }

    fn record(&mut self, frame: &Frame) -> Result<()> {
        let written = self.log.write(self.clock.now_us(), [&WireFrame::from(frame)]);
        written.with_context(|| format!("{}: the recording cannot be continued", self.path))
    }
}

impl<B: CanBus> CanBus for RecordingBus<B> {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        self.bus.send(frame)?;
        self.record(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        let heard = self.bus.receive(timeout)?;
        if let Some(frame) = &heard {
            self.record(frame)?;
        }
        Ok(heard)
    }

    fn description(&self) -> String {
        self.bus.description()
    }

    fn passed_over(&self) -> u64 {
        self.bus.passed_over()
    }

    fn now(&self) -> Duration {
        self.bus.now()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bus::local_bus;
    use crate::bus::wire::testing::any_frame;

    fn read(text: &str) -> Result<Vec<LogEntry>> {
        let lines = LogReader::new(text.as_bytes(), "test.log".into());
        let whole = |line: Result<LogLine>| match line? {
            LogLine::Whole(logged) => Ok(logged),
            LogLine::Torn(why) => Err(anyhow::Error::msg(why)),
        };
        lines.map(whole).collect()
    }

    proptest! {
        #[test]
        fn every_frame_comes_back_with_its_time(frame in any_frame(), time_us in 0..1_u64 << 62) {
            let mut text = Vec::new();
            LogWriter::new(&mut text).write(time_us, [&frame]).unwrap();
            let back = read(std::str::from_utf8(&text).unwrap()).unwrap();
            prop_assert_eq!(back, [LogEntry { row: 1, time_us, channel: CHANNEL.into(), frame: Some(frame) }]);
        }
    }

    #[test]
    fn lines_of_other_recorders_are_read() {
        let text = "(1700000000.123456) vcan0 123#0102\n\n(0.5) can1 1FFFFFFF#\r\n(1.000001) can0 123#R8 T\n\
                    (2.0) can0 123##1AABB\n(3.0) can0 20000004#0000000000000000\n(4.123456789) can0 7FF#01_C R\n";
        let lines = read(text).unwrap();
        let found: Vec<_> = lines.iter().map(|l| (l.row, l.time_us, l.channel.as_str())).collect();
        assert_eq!(found[0], (1, 1_700_000_000_123_456, "vcan0"));
        assert_eq!(found[1], (3, 500_000, "can1"));
        assert_eq!(found[5], (7, 4_123_456, "can0"));
        let frames: Vec<_> = lines.iter().map(|l| l.frame).collect();
        assert_eq!(frames[0], WireFrame::data(0x123, false, &[1, 2]));
        assert_eq!(frames[1], WireFrame::data(0x1fff_ffff, true, &[]));
        assert_eq!(frames[2], WireFrame::remote(0x123, false, 8));
        assert_eq!((frames[3], frames[4]), (None, None), "CAN FD and errors are known and passed over");
        assert_eq!(frames[5], WireFrame::data(0x7ff, false, &[1]));
    }

    #[test]
    fn a_line_that_is_none_is_quoted_with_its_row() {
        for bad in [
            "(1.0) can0 123#012",
            "(1.0) can0 12#01",
            "(1.0) can0 800#01",
            "(1.0) can0 123#010203040506070809",
            "1.0 can0 123#01",
            "(1.0) can0",
            "(1) can0 123#01",
            "(-1.0) can0 123#01",
            "(1.0) can0 123#01 X",
            "(1.0) can0 123#R9",
            "(1.0) can0 123##",
            "date Mon Sep 30 15:06:13.191 2017",
            "LOGG\u{1}",
        ] {
            let message = read(&format!("(1.0) can0 123#01\n{bad}\n")).unwrap_err().to_string();
            let start: String = bad.escape_debug().collect();
            assert!(message.contains("test.log, row 2") && message.contains(&start), "{message}");
            assert!(message.contains("can_logconvert") && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn both_directions_are_recorded_as_they_happen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("both.log");
        let [near, mut far] = <[_; 2]>::try_from(local_bus(2)).ok().unwrap();
        let mut near = RecordingBus::new(near, &path).unwrap();
        let frame = |id: u16| Frame::standard(id, &[id as u8]).unwrap();
        near.send(&frame(1)).unwrap();
        far.send(&frame(2)).unwrap();
        near.receive(Duration::ZERO).unwrap();
        near.receive(Duration::ZERO).unwrap();
        near.send(&frame(3)).unwrap();
        // not yet dropped: a killed program leaves as much
        let lines: Vec<_> =
            LogReader::open(&path).unwrap().map(|line| line.unwrap().whole().unwrap()).collect();
        let ids: Vec<_> = lines.iter().map(|l| l.frame.unwrap().id()).collect();
        assert_eq!(ids, [1, 2, 3]);
        assert!(lines.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us));
    }
}
