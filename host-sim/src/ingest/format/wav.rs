//! WAV: channels of one rate, as RIFF, RIFX, RF64 and BW64 hold them.
//!
//! Sizes in the file are claims: a recorder that streams or was stopped leaves none, 0 or all ones. Data then end where the
//! file does, and the last frame counts if it is whole, as SciPy and FFmpeg read it.

use anyhow::{Context, Result, bail};

use super::super::samples::{Samples, Scale, Waveform};
use super::Content;

/// First words of files, with the order of their bytes and whether sizes may be of 64 bits.
const KINDS: [(&[u8; 4], ByteOrder); 4] = [
    (b"RIFF", ByteOrder::Little),
    (b"RF64", ByteOrder::Little),
    (b"BW64", ByteOrder::Little),
    (b"RIFX", ByteOrder::Big),
];
/// Name and size of a chunk.
const CHUNK_HEAD: usize = 8;
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
    let order = ByteOrder::of(bytes).with_context(|| {
        format!("{file}: cannot be read as WAV, expected a file that begins with RIFF and WAVE")
    })?;
    let (format, data) = chunks(file, bytes, order)?;
    let Format { number, channels, rate_hz, bytes: size } = format;
    if channels == 0 || size == 0 {
        bail!("{file}: its format says {channels} channels of {size} bytes, expected one of each at least");
    }
    let columns = (0..channels).map(|channel| {
        let frames = data.chunks_exact(size * channels);
        let each = frames.map(move |frame| &frame[channel * size..(channel + 1) * size]);
        samples(each, number, size, order)
    });
    let columns: Option<Vec<Samples>> = columns.collect();
    let Some(columns) = columns else {
        bail!(
            "{file}: holds format {number} with {size} bytes a sample, expected PCM of 8 to 32 bits or floats of 32 or 64"
        );
    };
    let scale = if number == FLOATS { Scale::Fraction } else { Scale::Counts };
    let waveform = Waveform::numbered(file, Some(f64::from(rate_hz)), columns);
    Ok(Content::Waveform(Waveform { scale, ..waveform }))
}

/// The samples of a channel; nothing where the format is another.
fn samples<'a>(
    each: impl Iterator<Item = &'a [u8]>,
    format: u16,
    size: usize,
    order: ByteOrder,
) -> Option<Samples> {
    Some(match (format, size) {
        // a byte is unsigned
        (INTEGERS, 1) => Samples::Values(each.map(|s| 256.0 * (f64::from(s[0]) - 128.0)).collect()),
        (INTEGERS, 2) => Samples::Counts(each.map(|s| order.number(s) as u16 as i16).collect()),
        (INTEGERS, 3 | 4) => {
            let up = 32 - 8 * size as u32;
            let count = |s: &[u8]| f64::from(((order.number(s) as u32) << up) as i32) / 65_536.0;
            Samples::Values(each.map(count).collect())
        }
        (FLOATS, 4) => {
            Samples::Values(each.map(|s| f64::from(f32::from_bits(order.number(s) as u32))).collect())
        }
        (FLOATS, 8) => Samples::Values(each.map(|s| f64::from_bits(order.number(s))).collect()),
        _ => return None,
    })
}

/// The format and the bytes of the samples.
fn chunks<'a>(file: &str, bytes: &'a [u8], order: ByteOrder) -> Result<(Format, &'a [u8])> {
    let mut format = None;
    let mut long_size = None;
    let mut at = 12;
    while let (Some(name), Some(size)) = (bytes.get(at..at + 4), order.at(bytes, at + 4, 4)) {
        let body = at + CHUNK_HEAD;
        let rest = &bytes[body..];
        if name == b"data" {
            let Some(format) = format else {
                bail!("{file}: the chunk data stands before the chunk fmt, expected the format first");
            };
            return Ok((format, data(rest, size as u32, long_size, order)));
        }
        let size = usize::try_from(size).unwrap_or(usize::MAX).min(rest.len());
        match name {
            b"fmt " => format = Format::of(&rest[..size], order),
            // size of the file, then that of the data
            b"ds64" => long_size = order.at(rest, 8, 8),
            _ => {}
        }
        // a chunk of odd size is followed by a byte of padding, which some writers forget
        let end = body + size;
        at = if size % 2 == 1 && !is_name(bytes, end + 1) && is_name(bytes, end) {
            end
        } else {
            end + size % 2
        };
    }
    match format {
        Some(_) => bail!("{file}: ends before the chunk data, expected samples"),
        None => bail!("{file}: has no chunk fmt, expected one that says channels and rate"),
    }
}

/// Whether there is the name of a chunk at a place.
fn is_name(bytes: &[u8], at: usize) -> bool {
    bytes.get(at..at + 4).is_some_and(|name| name.iter().all(|byte| (b' '..=b'~').contains(byte)))
}

/// As many bytes as are stated, or all where none are.
fn data(rest: &[u8], size: u32, long_size: Option<u64>, order: ByteOrder) -> &[u8] {
    let stated = match (size, long_size) {
        (UNKNOWN, Some(long)) if long > 0 && long != u64::MAX => usize::try_from(long).unwrap_or(usize::MAX),
        (UNKNOWN, _) => usize::MAX,
        // no data at all, if other chunks fill the file
        (0, _) if fills(rest, order) => 0,
        (0, _) => usize::MAX,
        (size, _) => size as usize,
    };
    &rest[..stated.min(rest.len())]
}

/// Whether bytes are a chunk that ends where they do.
fn fills(rest: &[u8], order: ByteOrder) -> bool {
    is_name(rest, 0)
        && order.at(rest, 4, 4).is_some_and(|size| {
            let end = CHUNK_HEAD as u64 + size;
            end == rest.len() as u64 || end + size % 2 == rest.len() as u64
        })
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
        let of = |samples: &Samples| match samples {
            Samples::Counts(counts) => counts.clone(),
            Samples::Values(values) => values.iter().map(|v| *v as i16).collect(),
        };
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
