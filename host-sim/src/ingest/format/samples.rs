//! The kinds of files with waveforms, a file each.

use std::path::Path;

use anyhow::{Context, Result, bail};

use super::super::samples::{Channel, Samples, Waveform};
use super::{matlab, numpy, samples_text, wav};

/// Reads the bytes of a file of its kind.
type Format = fn(file: &str, bytes: &[u8]) -> Result<Waveform>;

/// What the extension says, and who reads it.
const FORMATS: [(&str, Format); 5] = [
    ("csv", samples_text::read),
    ("wav", wav::read),
    ("npy", numpy::read_array),
    ("npz", numpy::read_archive),
    ("mat", matlab::read),
];

/// Reads a file whose extension says its kind.
///
/// # Errors
/// One sentence with the file, the place in it and what was expected.
pub fn read(path: &Path) -> Result<Waveform> {
    let file = path.display().to_string();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some((_, format)) = FORMATS.iter().find(|(of, _)| *of == extension) else {
        let known = FORMATS.map(|(of, _)| format!(".{of}")).join(", ");
        bail!("{file}: the extension says no kind of waveforms that is read, expected one of {known}");
    };
    let bytes = std::fs::read(path).with_context(|| format!("{file}: cannot be read"))?;
    let waveform = format(&file, &bytes)?;
    let Some(first) = waveform.channels.first().filter(|c| c.samples.len() > 0) else {
        bail!("{file}: there is no sample, expected those of the probes and of the keyphasor");
    };
    for (i, channel) in waveform.channels.iter().enumerate() {
        if waveform.channels[..i].iter().any(|other| other.name == channel.name) {
            bail!("{file}: two channels are called {}, expected a name for each", channel.name);
        }
        let (len, expected) = (channel.samples.len(), first.samples.len());
        if len != expected {
            bail!(
                "{file}: channel {} has {len} samples and {} has {expected}, expected as many of each",
                channel.name,
                first.name
            );
        }
        if let Samples::Values(values) = &channel.samples
            && let Some(at) = values.iter().position(|v| !v.is_finite())
        {
            bail!("{file}: channel {}: sample {} is not a finite number", channel.name, at + 1);
        }
    }
    Ok(waveform)
}

/// Columns, named by their numbers where the file has no names.
pub fn numbered(columns: impl IntoIterator<Item = Samples>) -> Vec<Channel> {
    let channel =
        |(i, samples): (usize, Samples)| Channel { number: i + 1, name: (i + 1).to_string(), samples };
    columns.into_iter().enumerate().map(channel).collect()
}
