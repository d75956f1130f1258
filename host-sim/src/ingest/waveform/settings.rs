//! What the owner of the waveforms states of them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Error, Result, anyhow, bail};
use clap::Args;
use rotor_edge_core::extraction::{ExtractionConfig, ExtractionError};
use rotor_edge_desktop::measurement::LOWEST_GAP_V;

use crate::ingest::unit::Unit;

/// How the channels were recorded, and what is asked of them.
#[derive(Debug, Clone, Args)]
pub struct Settings {
    /// The channel of a probe, by name or number; without it, the channels that are named as the rotor's probes, or all
    #[arg(long, value_name = "PROBE=CHANNEL")]
    pub channel: Vec<ChannelRule>,
    /// Sampling rate, Hz, if the file does not state it
    #[arg(long)]
    pub rate_hz: Option<f64>,
    /// Channel with the times, by name or number; in s unless its name states another unit [default: recognised by its name]
    #[arg(long, value_name = "CHANNEL")]
    pub time: Option<String>,
    /// Unit of the probes' channels; accelerations and velocities are integrated at 1x [default: as the file states, else V]
    #[arg(long, value_parser = Unit::of_channels())]
    pub unit: Option<Unit>,
    /// Sensitivity of the probes, or of one, mV per µm that the shaft comes nearer: 7.87 (200 mV/mil) of an eddy-current
    /// probe, whose negative voltage rises then, as `sensitivity_v_mm` in the rotor's file; the angles of its probes are the
    /// directions to them
    #[arg(long, value_name = "[PROBE=]MV_UM", allow_hyphen_values = true)]
    pub mv_um: Vec<Sensitivity>,
    /// Value of 32768 counts, or of 1.0 in a WAV of floats within ±1, in the unit; for WAV and integer arrays
    #[arg(long, value_name = "X")]
    pub full_scale: Option<f64>,
    /// The probes are AC coupled: there is no gap voltage
    #[arg(long)]
    pub ac: bool,
    /// Gap voltages of a probe in order; outside it is open
    #[arg(long, value_names = ["LOWEST_V", "HIGHEST_V"], num_args = 2, default_values_t = [-18.0, -2.0], allow_hyphen_values = true)]
    pub gap_v: Vec<f64>,
    #[command(flatten)]
    pub keyphasor: KeyphasorSettings,
    /// Turns in a window
    #[arg(long, default_value_t = ExtractionConfig::<1>::new().revolutions, value_parser = clap::value_parser!(u16).range(1..))]
    pub revolutions: u16,
    /// Largest change of speed within a window, relative
    #[arg(long, default_value_t = ExtractionConfig::<1>::new().largest_drift)]
    pub largest_drift: f32,
    /// Speed below which the keyphasor counts as missing, rpm
    #[arg(long, value_name = "RPM", default_value_t = 100.0)]
    pub slowest_rpm: f64,
    /// Average consecutive windows within so many rpm to one reading; without it, each window is a reading
    #[arg(long, value_name = "RPM")]
    pub bin_rpm: Option<f64>,
    /// Correct the vectors for the change of speed, to first order, to a constant speed in the middle of each bin
    #[arg(long, requires = "bin_rpm")]
    pub compensate_rate: bool,
    /// Name of the run, one for each file [default: of several files, their names]
    #[arg(long)]
    pub run: Vec<String>,
}

/// Where in the keyphasor's channel the mark is.
#[derive(Debug, Clone, Args)]
pub struct KeyphasorSettings {
    /// The channel of the keyphasor, by name or number [default: keyphasor, kph or tacho]
    #[arg(long, value_name = "CHANNEL")]
    pub keyphasor: Option<String>,
    /// Threshold of the keyphasor's mark, in volts or the unit of the channel [default: half-way between its lowest
    /// and highest, without outliers]
    #[arg(long, allow_hyphen_values = true)]
    pub threshold: Option<f64>,
    /// Distance from the threshold that re-arms the keyphasor [default: a fifth of its range]
    #[arg(long)]
    pub hysteresis: Option<f64>,
    /// The mark is the falling edge, as of a proximity probe over a notch [default: the rising edge]
    #[arg(long)]
    pub falling: bool,
    /// Samples in a turn, where these follow the shaft's angle from the mark on and there is no keyphasor
    #[arg(long, value_name = "N", conflicts_with_all = ["keyphasor", "pulses"], value_parser = clap::value_parser!(u32).range(8..))]
    pub samples_per_turn: Option<u32>,
    /// Pulses in a turn, of a tacho or a wheel, teeth that are missing counted or not; t = 0 is then at the first pulse of the
    /// file, or at the pulse after the gap [default: 1, and half-order vibration is refused]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub pulses: Option<u32>,
    /// After a mark, ignore others for this part of the time between two marks, 0 to 1, against double triggers: 0.3
    #[arg(long, value_name = "PART")]
    pub hold_off: Option<f64>,
}

/// `PROBE=CHANNEL`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelRule {
    pub probe: String,
    pub channel: String,
}

impl FromStr for ChannelRule {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.split_once('=').map(|(probe, channel)| (probe.trim(), channel.trim())) {
            Some((probe, channel)) if !probe.is_empty() && !channel.is_empty() => {
                Ok(Self { probe: probe.into(), channel: channel.into() })
            }
            _ => bail!("\"{text}\": expected PROBE=CHANNEL, such as 15X=ch1 or 15X=2"),
        }
    }
}

/// `[PROBE=]MV_UM`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    pub probe: Option<String>,
    pub mv_um: f32,
}

impl FromStr for Sensitivity {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (probe, number) = text.rsplit_once('=').map_or((None, text), |(p, n)| (Some(p.trim()), n));
        match number.trim().parse::<f32>() {
            Ok(mv_um) if mv_um.is_normal() => Ok(Self { probe: probe.map(str::to_string), mv_um }),
            _ => {
                bail!("\"{text}\": expected a sensitivity in mV/µm other than zero, such as 7.87 or 15X=7.87")
            }
        }
    }
}

impl Settings {
    /// # Errors
    /// If a number makes no sense, or two statements contradict each other.
    pub fn check(&self) -> Result<()> {
        for (option, value) in [
            ("--rate-hz", self.rate_hz),
            ("--full-scale", self.full_scale),
            ("--hysteresis", self.keyphasor.hysteresis),
            ("--slowest-rpm", Some(self.slowest_rpm)),
            ("--largest-drift", Some(f64::from(self.largest_drift))),
            ("--bin-rpm", self.bin_rpm),
        ] {
            if value.is_some_and(|value| !(value > 0.0 && value.is_finite())) {
                bail!("{option}: expected a positive number");
            }
        }
        if self.keyphasor.hold_off.is_some_and(|part| !(part > 0.0 && part < 1.0)) {
            bail!("--hold-off: expected a part of the time between two marks, above 0 and below 1");
        }
        let is_again = |i: usize| self.channel[..i].iter().any(|other| other.probe == self.channel[i].probe);
        if let Some(i) = (0..self.channel.len()).find(|i| is_again(*i)) {
            bail!("--channel {}: is stated twice, expected one channel", self.channel[i].probe);
        }
        let [lowest, highest] = self.gap_range_v();
        if self.has_gap() && !(LOWEST_GAP_V <= lowest && lowest < highest && highest <= 0.0) {
            bail!(
                "--gap-v {lowest} {highest}: expected two ascending voltages from {LOWEST_GAP_V} to 0, or --ac"
            );
        }
        Ok(())
    }

    /// Why the core extracts nothing with these settings and so many samples a second.
    pub fn refusal(&self, file: &str, rate_hz: f64, error: ExtractionError) -> Error {
        let rate = match self.rate_hz {
            Some(stated) => format!("{file}: --rate-hz {stated}"),
            None => format!("{file}: has {rate_hz:.6} samples a second"),
        };
        let (slowest_rpm, samples) = (self.slowest_rpm, 60.0 * rate_hz / self.slowest_rpm);
        match error {
            ExtractionError::SampleRate => {
                anyhow!("{rate}: expected at most 1e9 samples a second, --rate-hz with those of the recorder")
            }
            ExtractionError::LongestTurn => anyhow!(
                "{rate}: a turn at --slowest-rpm {slowest_rpm} would have {samples:.1} samples, expected 8 to 16,777,216: \
                 --rate-hz with the samples a second of the recorder, another --slowest-rpm, or fewer --revolutions"
            ),
            error => anyhow!("{file}: cannot be extracted with these settings ({error})"),
        }
    }

    /// Of the unit that is stated, or that a file states.
    ///
    /// # Errors
    /// If there is a sensitivity and no voltage, or a voltage and no sensitivity.
    pub fn check_sensitivity(&self, file: &str) -> Result<()> {
        const EXPECTED: &str = "expected --mv-um with the sensitivity of the probes";
        match (self.unit, self.mv_um.is_empty()) {
            (None, true) => {
                bail!("{file}: states no unit, so the channels count as voltages, {EXPECTED}, or --unit")
            }
            (Some(unit), true) if unit.is_voltage() => bail!("{file}: the channels are voltages, {EXPECTED}"),
            (Some(unit), false) if !unit.is_voltage() => bail!(
                "{file}: --mv-um: the channels are no voltages but in {}, expected no sensitivity",
                unit.symbol()
            ),
            _ => Ok(()),
        }
    }

    /// Unit of the probes' channels.
    pub fn unit(&self) -> Unit {
        self.unit.unwrap_or(Unit::Volt)
    }

    /// The name of each file's run.
    ///
    /// # Errors
    /// If there are not as many names as files, or two are alike.
    pub fn runs(&self, files: &[PathBuf]) -> Result<Vec<Option<String>>> {
        let stem = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let names: Vec<String> = match (files, self.run.is_empty()) {
            ([_], true) => return Ok(vec![None]),
            (_, true) => files.iter().map(stem).collect(),
            (_, false) => self.run.clone(),
        };
        if names.len() != files.len() {
            bail!("--run: names {} runs, expected one for each of the {} files", names.len(), files.len());
        }
        if let Some(i) = (0..names.len()).find(|i| names[..*i].contains(&names[*i])) {
            bail!("two runs are called {}, expected --run with a name for each file", names[i]);
        }
        Ok(names.into_iter().map(Some).collect())
    }

    /// Whether the mean of a channel is a gap voltage.
    pub fn has_gap(&self) -> bool {
        self.unit().is_voltage() && !self.ac
    }

    fn gap_range_v(&self) -> [f64; 2] {
        [self.gap_v[0], self.gap_v[1]]
    }

    /// Gap voltages in order, mV.
    pub fn gap_range_mv(&self) -> [f32; 2] {
        if self.has_gap() {
            self.gap_range_v().map(|v| (1000.0 * v) as f32)
        } else {
            [f32::NEG_INFINITY, f32::INFINITY]
        }
    }
}
