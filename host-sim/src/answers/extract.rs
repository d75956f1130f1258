//! Answer of `extract`.

use std::path::PathBuf;

use serde::Serialize;

use crate::ingest::unit::Unit;
use crate::ingest::waveform::settings::Settings;
use crate::ingest::waveform::sweep::RateCompensation;
use crate::ingest::waveform::vectors::{DriftedWindows, Loss};
use crate::ingest::waveform::{ExtractedFile, Probe};

/// 1x readings from raw samples, by the controller's own extraction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractionAnswer {
    pub measured: PathBuf,
    pub two_x: Option<PathBuf>,
    pub readings: usize,
    /// Speed of each reading in the order of its file, rpm.
    pub speeds: Vec<f64>,
    pub lost: usize,
    pub files: Vec<ExtractedFileAnswer>,
}

/// What one file of samples held.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractedFileAnswer {
    pub file: String,
    pub run: Option<String>,
    pub rate_hz: f64,
    pub duration_s: f64,
    pub keyphasor: ExtractedKeyphasor,
    pub channels: Vec<ExtractedChannel>,
    /// A count of the core's converter in the channels' unit.
    pub count: f64,
    pub readings: usize,
    pub losses: Vec<LossAnswer>,
    pub drifted: Option<DriftedAnswer>,
    pub compensated: Option<CompensatedAnswer>,
    /// Why the speed may be another, in sentences.
    pub doubts: Vec<String>,
    #[serde(skip)]
    pub unit: Unit,
    #[serde(skip)]
    pub revolutions: u16,
    /// The slowest and the fastest reading.
    #[serde(skip)]
    pub range_rpm: [f64; 2],
}

/// The channel of the phase reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractedKeyphasor {
    pub channel: String,
    /// Where the channel was passed, in its unit.
    pub threshold: f64,
    pub missed_pulses: usize,
    /// Teeth of a wheel that are missing in every turn; t = 0 is then at the pulse after the gap.
    pub missing_teeth: usize,
    /// Marks that were left out: they came between two turns, or within the hold-off.
    pub extra_marks: usize,
    /// Marks that did not come and were put in between those beside them.
    pub filled_marks: usize,
    /// Marks in all, those put in included.
    #[serde(skip)]
    pub marks: usize,
    /// Whether a curve was laid through marks that are known to one sample only.
    pub smoothed: bool,
    #[serde(skip)]
    pub is_after_gap: bool,
    /// Samples of a turn, where these follow the shaft's angle and there is no keyphasor.
    pub samples_per_turn: Option<usize>,
    /// From when on nobody knows which pulse of a tacho is which.
    pub reference_lost_s: Option<f64>,
}

/// A probe and the channel that it was read from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractedChannel {
    pub probe: String,
    pub channel: String,
    /// Whether its sensitivity is negative.
    #[serde(skip)]
    pub is_inverted: bool,
}

/// Windows that are lost for one reason; of one probe, or of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LossAnswer {
    pub why: &'static str,
    pub probe: Option<String>,
    pub windows: usize,
    pub first_s: f64,
    #[serde(skip)]
    pub words: String,
}

/// Windows that are lost because the speed changed too much within them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftedAnswer {
    pub windows: usize,
    pub in_all: usize,
    /// The largest change within a window, relative.
    pub largest: f64,
    /// How many there are, and which option keeps them.
    #[serde(skip)]
    pub advice: String,
}

/// What the change of speed did to the response, taken off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompensatedAnswer {
    pub bins: usize,
    /// Bins that are as they were measured.
    pub left: usize,
    pub largest_um: f64,
    pub at_rpm: f64,
}

impl ExtractionAnswer {
    /// Of files whose readings are written to `measured`, and their vectors at twice the running speed to `two_x`.
    pub fn of(
        extracted: &[ExtractedFile],
        settings: &Settings,
        measured: PathBuf,
        two_x: Option<PathBuf>,
    ) -> Self {
        let speeds: Vec<f64> =
            extracted.iter().flat_map(|file| &file.readings).map(|reading| reading.speed_rpm).collect();
        Self {
            measured,
            two_x,
            readings: speeds.len(),
            speeds,
            lost: extracted.iter().flat_map(|file| &file.losses).map(|loss| loss.windows).sum(),
            files: extracted.iter().map(|file| ExtractedFileAnswer::of(file, settings)).collect(),
        }
    }
}

impl ExtractedFileAnswer {
    fn of(of: &ExtractedFile, settings: &Settings) -> Self {
        let (channel, threshold) = &of.keyphasor;
        let speeds = || of.readings.iter().map(|reading| reading.speed_rpm);
        Self {
            file: of.file.clone(),
            run: of.run.clone(),
            rate_hz: of.rate_hz,
            duration_s: of.duration_s,
            keyphasor: ExtractedKeyphasor {
                channel: channel.clone(),
                threshold: *threshold,
                samples_per_turn: of.marks.samples_a_turn,
                missed_pulses: of.marks.missed_pulses,
                missing_teeth: of.marks.missing_teeth,
                extra_marks: of.marks.extra,
                filled_marks: of.marks.filled,
                marks: of.marks.in_all,
                smoothed: of.marks.is_smoothed,
                is_after_gap: of.marks.is_after_gap,
                reference_lost_s: of.marks.reference_lost_s,
            },
            channels: of.probes.iter().map(ExtractedChannel::from).collect(),
            count: of.count,
            readings: of.readings.len(),
            losses: of.losses.iter().map(LossAnswer::from).collect(),
            drifted: of.drifted.map(|drifted| DriftedAnswer::of(&drifted, settings)),
            doubts: of.doubts.clone(),
            compensated: of.compensated.map(CompensatedAnswer::from),
            unit: of.unit,
            revolutions: of.revolutions,
            range_rpm: [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)],
        }
    }
}

impl From<&Probe> for ExtractedChannel {
    fn from(probe: &Probe) -> Self {
        Self { probe: probe.name.clone(), channel: probe.channel.clone(), is_inverted: probe.mv_um < 0.0 }
    }
}

impl From<&Loss> for LossAnswer {
    fn from(loss: &Loss) -> Self {
        Self {
            why: loss.why,
            probe: loss.probe.clone(),
            windows: loss.windows,
            first_s: loss.first_s,
            words: loss.to_string(),
        }
    }
}

impl DriftedAnswer {
    fn of(drifted: &DriftedWindows, settings: &Settings) -> Self {
        Self {
            windows: drifted.windows,
            in_all: drifted.in_all,
            largest: drifted.largest,
            advice: drifted.advice(settings.revolutions, settings.largest_drift),
        }
    }
}

impl From<RateCompensation> for CompensatedAnswer {
    fn from(done: RateCompensation) -> Self {
        let RateCompensation { bins, left, largest_um, at_rpm } = done;
        Self { bins, left, largest_um, at_rpm }
    }
}
