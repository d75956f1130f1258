//! WAV: channels of one rate, as RIFF, RIFX, RF64 and BW64 hold them.
//!
//! Sizes in the file are claims: a recorder that streams or was stopped leaves none, 0 or all ones. Data then end where the
//! file does, and the last frame counts if it is whole, as SciPy and FFmpeg read it.

use std::fs::File;
use std::ops::Range;
use std::sync::Mutex;

use anyhow::{Context, Result, bail};

use super::super::samples::{Samples, Scale, Waveform};
use super::super::streamed::{Encoding, Frames, SampleKind, Source, Streamed};
use super::Content;

/// First words of files, with the order of their bytes and whether sizes may be of 64 bits.
const KINDS: [(&[u8; 4], ByteOrder); 4] = [
    (b"RIFF", ByteOrder::Little),
    (b"RF64", ByteOrder::Little),
    (b"BW64", ByteOrder::Little),
    (b"RIFX", ByteOrder::Big),
];
/// SampleKind, size and kind of the form.
const FORM_HEAD: usize = 12;
/// Name and size of a chunk.
const CHUNK_HEAD: u64 = 8;
/// Bytes of a format that are looked at.
const LONGEST_FORMAT: usize = 64;
/// Numbers of formats.
const INTEGERS: u16 = 1;
const FLOATS: u16 = 3;
const EXTENSIBLE: u16 = 0xFFFE;
/// Where in an extensible format its number is.
const EXTENSIBLE_FORMAT: usize = 24;
/// A size that a chunk of another kind holds, or none.
const UNKNOWN: u32 = u32::MAX;

#[derive(Debug, Clone, Copy, PartialEq)]
enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    fn of(bytes: &[u8]) -> Option<Self> {
        let kind = KINDS.iter().find(|(name, _)| bytes.starts_with(*name))?;
        (bytes.get(8..12) == Some(b"WAVE")).then_some(kind.1)
    }

    /// A number of as many bytes, 8 at most.
    fn number(self, bytes: &[u8]) -> u64 {
        let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, add),
            Self::Big => bytes.iter().fold(0, add),
        }
    }

    fn at(self, bytes: &[u8], from: usize, length: usize) -> Option<u64> {
        Some(self.number(bytes.get(from..from + length)?))
    }
}

/// Whether a file is a RIFF of waves, or one of its kin.
pub fn is(bytes: &[u8]) -> bool {
    ByteOrder::of(bytes).is_some()
}

/// What the format chunk says.
#[derive(Debug, Clone, Copy)]
struct Format {
    number: u16,
    channels: usize,
    rate_hz: u32,
    /// Of a sample with its padding.
    bytes: usize,
}

impl Format {
    fn of(chunk: &[u8], order: ByteOrder) -> Option<Self> {
        let number = order.at(chunk, 0, 2)? as u16;
        let channels = order.at(chunk, 2, 2)? as usize;
        let frame = order.at(chunk, 12, 2)? as usize;
        let bits = order.at(chunk, 14, 2)? as usize;
        let number = match number {
            EXTENSIBLE => order.at(chunk, EXTENSIBLE_FORMAT, 2)? as u16,
            number => number,
        };
        // samples fill the higher bits of their bytes
        let bytes =
            if channels > 0 && frame.is_multiple_of(channels) { frame / channels } else { bits.div_ceil(8) };
        Some(Self { number, channels, rate_hz: order.at(chunk, 4, 4)? as u32, bytes })
    }
}

/// Sixteen bits are taken as they are; other integers become counts of a 16-bit converter with fractions, which keeps one
/// meaning of full scale.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    of_source(file, Source::Bytes(bytes.to_vec()))
}

/// The same of an open file, whose samples stay there.
pub fn open(file: &str, opened: File) -> Result<Content> {
    of_source(file, Source::File(Mutex::new(opened)))
}

fn of_source(file: &str, source: Source) -> Result<Content> {
    let unread = || format!("{file}: cannot be read");
    let kind = source.read(0, FORM_HEAD).with_context(unread)?;
    let order = ByteOrder::of(&kind).with_context(|| {
        format!("{file}: cannot be read as WAV, expected a file that begins with RIFF and WAVE")
    })?;
    let length = source.len().with_context(unread)?;
    let (format, data) = Chunks { source: &source, length, order }.data(file)?;
    let Format { number, channels, rate_hz, bytes: size } = format;
    if channels == 0 || size == 0 {
        bail!("{file}: its format says {channels} channels of {size} bytes, expected one of each at least");
    }
    let kind = match (number, size) {
        (INTEGERS, 1) => SampleKind::Unsigned8,
        (INTEGERS, 2) => SampleKind::Integer16,
        (INTEGERS, 3) => SampleKind::Integer24,
        (INTEGERS, 4) => SampleKind::Integer32,
        (FLOATS, 4) => SampleKind::Float32,
        (FLOATS, 8) => SampleKind::Float64,
        _ => bail!(
            "{file}: holds format {number} with {size} bytes a sample, expected PCM of 8 to 32 bits or floats of 32 or 64"
        ),
    };
    let encoding = Encoding { kind, is_big_endian: order == ByteOrder::Big };
    // the last frame counts if it is whole
    let frames = (data.end - data.start) / (size * channels) as u64;
    let frames = usize::try_from(frames).with_context(unread)?;
    let columns = Streamed::all(Frames::new(source, data.start, frames, channels, encoding));
    let scale = if number == FLOATS { Scale::Fraction } else { Scale::Counts };
    let columns = columns.into_iter().map(Samples::Streamed);
    let waveform = Waveform::numbered(file, Some(f64::from(rate_hz)), columns);
    Ok(Content::Waveform(Waveform { scale, ..waveform }))
}

/// The chunks of a file.
struct Chunks<'a> {
    source: &'a Source,
    length: u64,
    order: ByteOrder,
}

impl Chunks<'_> {
    /// The format, and where the bytes of the samples are.
    fn data(&self, file: &str) -> Result<(Format, Range<u64>)> {
        let mut format = None;
        let mut long_size = None;
        let mut at = FORM_HEAD as u64;
        while let Some((name, size)) = self.head(at) {
            let body = at + CHUNK_HEAD;
            if &name == b"data" {
                let Some(format) = format else {
                    bail!("{file}: the chunk data stands before the chunk fmt, expected the format first");
                };
                let end = body.saturating_add(self.data_size(body, size, long_size));
                return Ok((format, body..end.min(self.length)));
            }
            let size = u64::from(size).min(self.length - body);
            let known = |most: usize| self.read(body, most.min(size as usize));
            match &name {
                b"fmt " => format = Format::of(&known(LONGEST_FORMAT), self.order),
                // size of the file, then that of the data
                b"ds64" => long_size = self.order.at(&known(16), 8, 8),
                _ => {}
            }
            // a chunk of odd size is followed by a byte of padding, which some writers forget
            let end = body + size;
            let is_unpadded = size % 2 == 1 && !self.is_name(end + 1) && self.is_name(end);
            at = if is_unpadded { end } else { end + size % 2 };
        }
        match format {
            Some(_) => bail!("{file}: ends before the chunk data, expected samples"),
            None => bail!("{file}: has no chunk fmt, expected one that says channels and rate"),
        }
    }

    /// Bytes of the file; fewer at its end.
    fn read(&self, at: u64, length: usize) -> Vec<u8> {
        self.source.read(at, length).unwrap_or_default()
    }

    /// Name and size of a chunk.
    fn head(&self, at: u64) -> Option<([u8; 4], u32)> {
        let bytes = self.read(at, CHUNK_HEAD as usize);
        Some((bytes.get(..4)?.try_into().ok()?, self.order.at(&bytes, 4, 4)? as u32))
    }

    /// Whether there is the name of a chunk at a place.
    fn is_name(&self, at: u64) -> bool {
        let name = self.read(at, 4);
        name.len() == 4 && name.iter().all(|byte| (b' '..=b'~').contains(byte))
    }

    /// Bytes of the samples as stated, or the most where nothing is.
    fn data_size(&self, body: u64, size: u32, long_size: Option<u64>) -> u64 {
        match (size, long_size) {
            (UNKNOWN, Some(long)) if long > 0 => long,
            (UNKNOWN, _) => u64::MAX,
            // no data at all, if other chunks fill the file
            (0, _) if self.fills(body) => 0,
            (0, _) => u64::MAX,
            (size, _) => size.into(),
        }
    }

    /// Whether bytes are a chunk that ends where the file does.
    fn fills(&self, at: u64) -> bool {
        self.is_name(at)
            && self.head(at).is_some_and(|(_, size)| {
                let end = at + CHUNK_HEAD + u64::from(size);
                end == self.length || end + u64::from(size % 2) == self.length
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn format(number: u16, bytes: u16) -> Vec<u8> {
        let (channels, rate) = (2_u16, 1000_u32);
        let mut chunk = Vec::new();
        for part in [number, channels] {
            chunk.extend(part.to_le_bytes());
        }
        chunk.extend(rate.to_le_bytes());
        chunk.extend((rate * u32::from(channels * bytes)).to_le_bytes());
        chunk.extend((channels * bytes).to_le_bytes());
        chunk.extend((8 * bytes).to_le_bytes());
        chunk
    }

    fn file(kind: &[u8; 4], chunks: &[(&[u8; 4], u32, &[u8])]) -> Vec<u8> {
        let mut bytes = [&kind[..], &[0xFF; 4], b"WAVE"].concat();
        for (name, size, body) in chunks {
            bytes.extend([&name[..], &size.to_le_bytes(), body].concat());
        }
        bytes
    }

    fn counts(bytes: &[u8]) -> Vec<Vec<i16>> {
        let Content::Waveform(waveform) = read("a.wav", bytes).unwrap() else { panic!("a waveform") };
        let of = |samples: &Samples| samples.iter().map(|value| value as i16).collect();
        waveform.channels.iter().map(|channel| of(&channel.samples)).collect()
    }

    #[test]
    fn sizes_that_are_none_cut_or_long_give_all_whole_frames() {
        let data: Vec<u8> = [1_i16, -1, 2, -2, 3, -3].iter().flat_map(|count| count.to_le_bytes()).collect();
        let fmt = format(1, 2);
        let long = [&[0; 8][..], &12_u64.to_le_bytes(), &[0; 12]].concat();
        let list = (b"LIST", 5, &b"INFOx\0"[..]);
        let unpadded = (b"LIST", 5, &b"INFOx"[..]);
        let fmt = (b"fmt ", 16, &fmt[..]);
        let whole = vec![vec![1, 2, 3], vec![-1, -2, -3]];
        for (kind, chunks) in [
            (b"RIFF", vec![fmt, (b"data", 12, &data[..])]),
            (b"RIFF", vec![list, fmt, (b"data", 0, &data)]),
            (b"RIFF", vec![unpadded, fmt, (b"data", u32::MAX, &data)]),
            (b"RIFF", vec![fmt, list, (b"data", 1000, &data)]),
            (b"RF64", vec![(b"ds64", 28, &long), fmt, (b"data", u32::MAX, &data)]),
        ] {
            assert_eq!(counts(&file(kind, &chunks)), whole);
        }
        let cut = file(b"RIFF", &[fmt, (b"data", 12, &data[..11])]);
        assert_eq!(counts(&cut), [[1, 2], [-1, -2]]);
        assert_eq!(counts(&file(b"RIFF", &[fmt, (b"data", 0, b""), list])), [[0_i16; 0]; 2]);
    }

    #[test]
    fn samples_of_every_width_have_one_full_scale() {
        let half = |bytes: u16| match bytes {
            1 => vec![192, 64],
            bytes => [0x40, 0xC0]
                .iter()
                .flat_map(|top| [vec![0; usize::from(bytes) - 1], vec![*top]].concat())
                .collect(),
        };
        for bytes in [1, 2, 3, 4] {
            let (fmt, data) = (format(1, bytes), half(bytes));
            let wav = file(b"RIFF", &[(b"fmt ", 16, &fmt), (b"data", data.len() as u32, &data)]);
            assert_eq!(counts(&wav), [[16_384], [-16_384]], "{bytes}");
        }
        let data = [-9.5_f64, 5.0].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
        let wav = file(b"RIFF", &[(b"fmt ", 16, &format(3, 8)), (b"data", 16, &data)]);
        let Content::Waveform(waveform) = read("a.wav", &wav).unwrap() else { panic!("a waveform") };
        assert_eq!((waveform.scale, waveform.channels[0].samples.at(0)), (Scale::Fraction, -9.5));
    }

    #[test]
    fn compressed_and_headless_files_are_refused_in_a_sentence() {
        let (fmt, adpcm) = (format(1, 2), format(2, 1));
        for (chunks, says) in [
            (
                vec![(b"fmt ", 16, &adpcm[..]), (b"data", 4, &b"abcd"[..])],
                "holds format 2 with 1 bytes a sample",
            ),
            (vec![(b"data", 4, b"abcd")], "stands before the chunk fmt"),
            (vec![(b"fmt ", 16, &fmt[..])], "ends before the chunk data"),
            (vec![], "has no chunk fmt"),
        ] {
            let error = read("a.wav", &file(b"RIFF", &chunks)).err().unwrap().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
