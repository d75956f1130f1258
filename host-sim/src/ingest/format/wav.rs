//! WAV: channels of one rate, integers or fractions of full scale.

use anyhow::{Context, Result};
use hound::{SampleFormat, WavReader};

use super::super::samples::{Samples, Waveform};
use super::Content;

/// Whether a file is a RIFF of waves.
pub fn is(bytes: &[u8]) -> bool {
    bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WAVE")
}

/// Sixteen bits are taken as they are; others become counts of a 16-bit converter with fractions, which keeps one meaning
/// of full scale.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    let wrong = || format!("{file}: cannot be read as WAV");
    let reader = WavReader::new(bytes).with_context(wrong)?;
    let spec = reader.spec();
    let channels = usize::from(spec.channels);
    let columns: Vec<Samples> = match (spec.sample_format, spec.bits_per_sample) {
        (SampleFormat::Int, 16) => {
            let all = reader.into_samples::<i16>().collect::<Result<Vec<_>, _>>().with_context(wrong)?;
            apart(&all, channels).map(Samples::Counts).collect()
        }
        (SampleFormat::Int, bits) => {
            let count = f64::from(1_u32 << (bits - 1)) / 32_768.0;
            let all = reader.into_samples::<i32>().map(|s| s.map(|s| f64::from(s) / count));
            let all = all.collect::<Result<Vec<_>, _>>().with_context(wrong)?;
            apart(&all, channels).map(Samples::Values).collect()
        }
        (SampleFormat::Float, _) => {
            let all = reader.into_samples::<f32>().map(|s| s.map(|s| f64::from(s) * 32_768.0));
            let all = all.collect::<Result<Vec<_>, _>>().with_context(wrong)?;
            apart(&all, channels).map(Samples::Values).collect()
        }
    };
    let rate_hz = Some(f64::from(spec.sample_rate));
    let waveform = Waveform::numbered(file, rate_hz, columns);
    Ok(Content::Waveform(Waveform { is_of_counts: true, ..waveform }))
}

/// The channels of frames that hold a sample of each.
fn apart<T: Copy>(frames: &[T], channels: usize) -> impl Iterator<Item = Vec<T>> {
    (0..channels).map(move |c| frames.iter().skip(c).step_by(channels).copied().collect())
}
