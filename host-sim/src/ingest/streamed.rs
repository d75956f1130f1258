//! Samples that stay in their file and are read block by block, so that a long recording needs no memory of its length.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Bytes of a block, roughly.
const BLOCK_BYTES: usize = 1 << 18;
/// Blocks that are kept: groups of probes read the same ones, one a little after another.
const KEPT: usize = 4;

/// A file, or its bytes.
#[derive(Debug)]
pub enum Source {
    File(Mutex<File>),
    Bytes(Vec<u8>),
}

impl Source {
    pub fn len(&self) -> io::Result<u64> {
        match self {
            Self::File(file) => Ok(locked(file).metadata()?.len()),
            Self::Bytes(bytes) => Ok(bytes.len() as u64),
        }
    }

    /// Bytes from a place on; fewer at the end of the file.
    pub fn read(&self, from: u64, length: usize) -> io::Result<Vec<u8>> {
        match self {
            Self::File(file) => {
                let mut file = locked(file);
                file.seek(SeekFrom::Start(from))?;
                let mut bytes = Vec::with_capacity(length.min(BLOCK_BYTES));
                Read::by_ref(&mut *file).take(length as u64).read_to_end(&mut bytes)?;
                Ok(bytes)
            }
            Self::Bytes(bytes) => {
                let from = usize::try_from(from).unwrap_or(usize::MAX).min(bytes.len());
                Ok(bytes[from..from.saturating_add(length).min(bytes.len())].to_vec())
            }
        }
    }
}

fn locked<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How a number stands in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoding {
    pub kind: SampleKind,
    pub is_big_endian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleKind {
    /// 128 is none; counts of a 16-bit converter are made of it.
    Unsigned8,
    Integer16,
    /// Of 24 bits, as counts of a 16-bit converter with fractions.
    Integer24,
    Integer32,
    Float32,
    Float64,
}

impl SampleKind {
    pub fn bytes(self) -> usize {
        match self {
            Self::Unsigned8 => 1,
            Self::Integer16 => 2,
            Self::Integer24 => 3,
            Self::Integer32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }
}

impl Encoding {
    fn number(self, bytes: &[u8]) -> f64 {
        // what most recordings are
        if let (SampleKind::Integer16, false, [low, high, ..]) = (self.kind, self.is_big_endian, bytes) {
            return f64::from(i16::from_le_bytes([*low, *high]));
        }
        let mut all = [0; 8];
        let size = self.kind.bytes();
        all[..size].copy_from_slice(&bytes[..size]);
        if self.is_big_endian {
            all[..size].reverse();
        }
        let low = u32::from_le_bytes([all[0], all[1], all[2], all[3]]);
        match self.kind {
            SampleKind::Unsigned8 => 256.0 * (f64::from(all[0]) - 128.0),
            SampleKind::Integer16 => f64::from(i16::from_le_bytes([all[0], all[1]])),
            SampleKind::Integer24 => f64::from((low << 8) as i32) / 65_536.0,
            SampleKind::Integer32 => f64::from(low as i32) / 65_536.0,
            SampleKind::Float32 => f64::from(f32::from_bits(low)),
            SampleKind::Float64 => f64::from_le_bytes(all),
        }
    }
}

/// Samples of several channels, those of one moment beside one another.
#[derive(Debug)]
pub struct Frames {
    source: Source,
    begins: u64,
    frames: usize,
    channels: usize,
    encoding: Encoding,
    survey: OnceLock<Survey>,
    kept: Mutex<Vec<(usize, Arc<Vec<u8>>)>>,
    failed: OnceLock<io::Error>,
}

/// What a pass through all samples shows of each channel.
#[derive(Debug)]
struct Survey {
    extremes: Vec<[f64; 2]>,
    not_finite: Vec<Option<usize>>,
}

impl Frames {
    /// Those of a source from a place on.
    pub fn new(source: Source, begins: u64, frames: usize, channels: usize, encoding: Encoding) -> Self {
        let (survey, kept, failed) = Default::default();
        Self { source, begins, frames, channels, encoding, survey, kept, failed }
    }

    fn frame_bytes(&self) -> usize {
        self.channels * self.encoding.kind.bytes()
    }

    fn frames_a_block(&self) -> usize {
        (BLOCK_BYTES / self.frame_bytes()).max(1)
    }

    /// The bytes of a block; those that cannot be read are zeros, and [`Self::failed`] says so.
    fn block(&self, number: usize) -> Arc<Vec<u8>> {
        let mut kept = locked(&self.kept);
        if let Some((_, bytes)) = kept.iter().find(|(of, _)| *of == number) {
            return Arc::clone(bytes);
        }
        let length = self.frames_a_block() * self.frame_bytes();
        let from = self.begins + number as u64 * length as u64;
        let mut bytes = self.source.read(from, length).unwrap_or_else(|error| {
            self.failed.get_or_init(|| error);
            Vec::new()
        });
        let last = self.frames - (number * self.frames_a_block()).min(self.frames);
        let expected = length.min(last * self.frame_bytes());
        if bytes.len() < expected {
            self.failed.get_or_init(|| io::ErrorKind::UnexpectedEof.into());
        }
        bytes.resize(length, 0);
        let bytes = Arc::new(bytes);
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push((number, Arc::clone(&bytes)));
        bytes
    }

    fn survey(&self) -> &Survey {
        self.survey.get_or_init(|| {
            let mut extremes = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.channels];
            let mut not_finite = vec![None; self.channels];
            let size = self.encoding.kind.bytes();
            for first in (0..self.frames).step_by(self.frames_a_block()) {
                let block = self.block(first / self.frames_a_block());
                let frames = block.chunks_exact(self.frame_bytes()).take(self.frames - first);
                for (at, frame) in frames.enumerate() {
                    for (channel, bytes) in frame.chunks_exact(size).enumerate() {
                        let value = self.encoding.number(bytes);
                        let [low, high] = &mut extremes[channel];
                        *low = low.min(value);
                        *high = high.max(value);
                        if !value.is_finite() {
                            not_finite[channel].get_or_insert(first + at);
                        }
                    }
                }
            }
            Survey { extremes, not_finite }
        })
    }

    /// Why a block could not be read.
    pub fn failed(&self) -> Option<&io::Error> {
        self.failed.get()
    }
}

/// One channel of them.
#[derive(Debug, Clone)]
pub struct Streamed {
    frames: Arc<Frames>,
    channel: usize,
}

impl Streamed {
    /// Every channel of frames.
    pub fn all(frames: Frames) -> Vec<Self> {
        let frames = Arc::new(frames);
        (0..frames.channels).map(|channel| Self { frames: Arc::clone(&frames), channel }).collect()
    }

    pub fn len(&self) -> usize {
        self.frames.frames
    }

    pub fn is_counts(&self) -> bool {
        self.frames.encoding.kind == SampleKind::Integer16
    }

    pub fn extremes(&self) -> [f64; 2] {
        self.frames.survey().extremes[self.channel]
    }

    /// The first sample that is no number.
    pub fn not_finite(&self) -> Option<usize> {
        let is_float = matches!(self.frames.encoding.kind, SampleKind::Float32 | SampleKind::Float64);
        if is_float { self.frames.survey().not_finite[self.channel] } else { None }
    }

    pub fn failed(&self) -> Option<&io::Error> {
        self.frames.failed()
    }

    /// The number at a place, for a few of them.
    pub fn at(&self, place: usize) -> f64 {
        self.cursor().at(place)
    }

    pub fn cursor(&self) -> Cursor<'_> {
        Cursor { of: self, block: None }
    }
}

/// Reads a channel from place to place, with the block of the last one at hand.
#[derive(Debug)]
pub struct Cursor<'a> {
    of: &'a Streamed,
    block: Option<(usize, Arc<Vec<u8>>)>,
}

impl Cursor<'_> {
    pub fn at(&mut self, place: usize) -> f64 {
        let frames = &self.of.frames;
        let a_block = frames.frames_a_block();
        let number = place / a_block;
        if self.block.as_ref().is_none_or(|(of, _)| *of != number) {
            self.block = Some((number, frames.block(number)));
        }
        let Some((_, bytes)) = &self.block else { return 0.0 };
        let from = (place % a_block) * frames.frame_bytes() + self.of.channel * frames.encoding.kind.bytes();
        frames.encoding.number(&bytes[from..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_file_equal_those_of_memory_over_blocks() {
        let number = |n: usize| f64::from((n as f32 * 0.01).sin());
        let bytes: Vec<u8> = [0xAA; 5]
            .into_iter()
            .chain((0..300_000).flat_map(|n| (number(n) as f32).to_be_bytes()))
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames");
        std::fs::write(&path, &bytes).unwrap();
        let encoding = Encoding { kind: SampleKind::Float32, is_big_endian: true };
        for source in [Source::Bytes(bytes), Source::File(Mutex::new(File::open(&path).unwrap()))] {
            let channels = Streamed::all(Frames::new(source, 5, 100_000, 3, encoding));
            let mut cursor = channels[1].cursor();
            assert!((0..100_000).all(|n| cursor.at(n) == number(3 * n + 1)));
            let all = (0..100_000).map(|n| number(3 * n + 2));
            assert_eq!(channels[2].extremes()[1], all.fold(f64::MIN, f64::max));
            assert_eq!((channels[0].not_finite(), channels[0].failed().is_none()), (None, true));
        }
    }

    #[test]
    fn file_that_became_shorter_is_told() {
        let encoding = Encoding { kind: SampleKind::Integer16, is_big_endian: false };
        let channels = Streamed::all(Frames::new(Source::Bytes(vec![1; 10]), 0, 100, 1, encoding));
        assert_eq!(channels[0].at(2), 257.0);
        assert!(channels[0].failed().is_some());
    }
}
