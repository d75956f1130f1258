//! A recording for the page that reads one: two X/Y pairs of probes and a keyphasor, as a WAV file.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

const RATE_HZ: u32 = 20_000;
const CHANNELS: u16 = 5;
const SECONDS: u32 = 3;
/// ±24 V are ±32767 counts.
const COUNTS_PER_V: f64 = 32_767.0 / 24.0;

/// A run-up from 1,200 to 1,500 rpm at 100 rpm/s; probes at −9 V with 0.5 V of 1x, and a mark of −10 V once a turn.
pub fn write(path: &Path) {
    let mut samples = Vec::new();
    for n in 0..RATE_HZ * SECONDS {
        let time_s = f64::from(n) / f64::from(RATE_HZ);
        let turns = 20.0 * time_s + 100.0 / 60.0 * time_s * time_s / 2.0;
        for probe in 0..4 {
            samples.push(-9.0 + 0.5 * (TAU * turns - f64::from(probe) * TAU / 4.0).cos());
        }
        samples.push(if turns.fract() < 0.1 { -10.0 } else { -1.0 });
    }
    let data: Vec<u8> =
        samples.iter().flat_map(|volts| ((volts * COUNTS_PER_V).round() as i16).to_le_bytes()).collect();
    let bytes = u32::try_from(data.len()).unwrap();
    let mut wav = Vec::new();
    wav.extend(b"RIFF");
    wav.extend((36 + bytes).to_le_bytes());
    wav.extend(b"WAVEfmt ");
    wav.extend(16u32.to_le_bytes());
    wav.extend(1u16.to_le_bytes());
    wav.extend(CHANNELS.to_le_bytes());
    wav.extend(RATE_HZ.to_le_bytes());
    wav.extend((RATE_HZ * 2 * u32::from(CHANNELS)).to_le_bytes());
    wav.extend((2 * CHANNELS).to_le_bytes());
    wav.extend(16u16.to_le_bytes());
    wav.extend(b"data");
    wav.extend(bytes.to_le_bytes());
    wav.extend(data);
    fs::write(path, wav).unwrap();
}
