//! From the converter's scans of four probes and a keyphasor to numbered 1x readings.
//!
//! One converter takes its inputs one after the other; the keyphasor is the third of five, so that each probe is at most two
//! conversions from it, and what that turns the vectors by is taken off. Samples that were lost end the reading under way:
//! a new one begins behind the gap, and a number is left out, so that the node and everybody else on the bus can count it.
//!
//! Marks are found in the keyphasor's samples, until a timer captures one: its captures count then, until they cease.

mod level;
mod marks;
mod pace;
#[cfg(test)]
mod tests;

use rotor_edge_core::can::{Keyphasor, NumberedReading};
use rotor_edge_core::extraction::{
    Extraction, ExtractionConfig, ExtractionError, Extractor, KeyphasorDetector,
};
use rotor_edge_core::reading::{ProbeVector, Reading};

pub use crate::monitor::PROBES;
pub use level::LevelShift;
pub use marks::CaptureConfig;
use marks::Marks;
use pace::Pace;

/// Bearing 1 X, Y, keyphasor, bearing 2 X, Y.
pub const INPUTS: usize = PROBES + 1;
/// Conversions from the keyphasor's to each probe's.
const CONVERSIONS_LATER: [f32; PROBES] = [-2.0, -1.0, 1.0, 2.0];

/// How the inputs are sampled and connected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplingConfig {
    /// From one scan to the next, µs.
    pub scan_us: u32,
    /// One conversion of a scan, µs.
    pub conversion_us: f32,
    /// The same at all inputs.
    pub level: LevelShift,
    /// Sensitivity of each probe, mV per µm that the shaft comes nearer: 7.87 of an eddy-current probe (200 mV/mil).
    pub scale_mv_um: [f32; PROBES],
    /// Lowest and highest gap voltage of a probe that is connected and in its range, mV.
    pub gap_range_mv: [f32; 2],
    /// The keyphasor's mark is a rise through this voltage, mV …
    pub mark_mv: f32,
    /// … after a fall below this much less, mV.
    pub hysteresis_mv: f32,
    /// The timer that captures marks.
    pub captures: CaptureConfig,
}

impl SamplingConfig {
    /// What readings are made with; firmware has its compiler check it.
    pub const fn extraction(&self) -> ExtractionConfig<PROBES> {
        ExtractionConfig {
            sample_rate_hz: 1e6 / self.scan_us as f32,
            converter: self.level.converter(),
            scale_mv_um: self.scale_mv_um,
            gap_range_mv: self.gap_range_mv,
            ..ExtractionConfig::new()
        }
    }
}

/// Samples were lost, and a new reading has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SamplesLost;

/// Makes readings of samples. It says nothing until it knows the speed for the first time, so that a board without probes
/// serves readings from the bus.
#[derive(Debug, Clone)]
pub struct Sampling {
    config: SamplingConfig,
    extractor: Extractor<PROBES>,
    detector: KeyphasorDetector,
    marks: Marks,
    is_captured: bool,
    pace: Pace,
    sequence: u16,
    has_turned: bool,
}

impl Sampling {
    /// Waits for a first mark.
    ///
    /// # Errors
    /// What the check of [`SamplingConfig::extraction`] finds.
    pub fn new(config: SamplingConfig) -> Result<Self, ExtractionError> {
        let [threshold, armed] =
            [config.mark_mv, config.mark_mv - config.hysteresis_mv].map(|mv| config.level.count(mv));
        Ok(Self {
            config,
            extractor: Extractor::new(config.extraction())?,
            detector: KeyphasorDetector::new(threshold, threshold - armed),
            marks: Marks::new(config.captures),
            is_captured: false,
            pace: Pace::new(),
            sequence: 0,
            has_turned: false,
        })
    }

    /// Takes what the timer captured, in order, before the scans that follow it.
    pub fn captured(&mut self, ticks: u32) {
        self.marks.captured(ticks);
    }

    /// Takes scans that follow those before, read at this time, and gives each reading that they complete. Late ones
    /// are not taken: they may be others than they should.
    pub fn take(
        &mut self,
        scans: &[[u16; INPUTS]],
        time_us: u64,
        mut made: impl FnMut(NumberedReading),
    ) -> Result<(), SamplesLost> {
        if !self.pace.keeps(scans.len(), self.config.scan_us, time_us) {
            return Err(self.lost());
        }
        for scan in scans {
            let [x1, y1, mark, x2, y2] = scan.map(i32::from);
            let mark = self.mark(mark);
            if let Some(found) = self.extractor.push([x1, y1, x2, y2], mark) {
                self.has_turned |= found.keyphasor == Keyphasor::Locked;
                self.is_captured &= found.keyphasor != Keyphasor::Missing;
                if self.has_turned {
                    made(self.number(found));
                }
            }
        }
        Ok(())
    }

    /// Whether a mark passed since the scan before, and how long before this one, in scans.
    fn mark(&mut self, count: i32) -> Option<f32> {
        let (sampled, captured) = (self.detector.push(count), self.marks.next());
        if captured.is_some() && !self.is_captured {
            self.is_captured = true;
            // No window has marks of both.
            self.extractor.restart();
        }
        if self.is_captured { captured } else { sampled }
    }

    /// Samples after the last ones taken are lost: begins anew, and leaves a number out. Scans and timer begin together again.
    #[inline(never)]
    pub fn lost(&mut self) -> SamplesLost {
        self.sequence = self.sequence.wrapping_add(u16::from(self.has_turned));
        self.extractor.restart();
        self.detector.restart();
        self.marks = Marks::new(self.config.captures);
        self.is_captured = false;
        self.pace = Pace::new();
        SamplesLost
    }

    fn number(&mut self, Extraction { keyphasor, reading, .. }: Extraction<PROBES>) -> NumberedReading {
        let conversion_rad = core::f32::consts::TAU / 60e6 * reading.speed_rpm * self.config.conversion_us;
        let mut probes = [ProbeVector::LOST; PROBES];
        let sampled = reading.probes().iter().zip(CONVERSIONS_LATER);
        for (probe, (vector, conversions)) in probes.iter_mut().zip(sampled) {
            *probe = turned(*vector, conversions * conversion_rad);
        }
        let reading = Reading::new(reading.speed_rpm, &probes)
            .map_or(reading, |turned| turned.with_gaps_v(reading.gaps_v()));
        self.sequence = self.sequence.wrapping_add(1);
        NumberedReading { sequence: self.sequence, keyphasor, reading }
    }
}

/// The vector at the keyphasor's instant, of one that was sampled a small angle later. The series are short of a float's
/// last bit by the eight samples a turn that the extraction needs, 0.2 rad.
fn turned(ProbeVector { cos_um, sin_um }: ProbeVector, angle: f32) -> ProbeVector {
    let square = angle * angle;
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0);
    let sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0));
    ProbeVector { cos_um: cos_um * cos - sin_um * sin, sin_um: sin_um * cos + cos_um * sin }
}
