//! From raw probe samples to the 1x reading: synchronous with the keyphasor, over whole revolutions.
//!
//! Samples and marks come in one by one, a [`Extraction`] comes out after every [`ExtractionConfig::revolutions`] turns.
//! Between two marks the phase follows the speed and its change, extrapolated from the turns before and put right when the
//! next mark arrives; no sample is kept, and no trigonometric function is called per sample. The window's mean and 1x
//! vector are the least-squares fit of `gap + u_c cos θ + u_s sin θ`, so that a pure sine is found exactly whatever the
//! number of samples in a turn, and the first and last samples are weighted for the part of their interval that lies in the
//! window, which keeps harmonics out.
//!
//! Not done here: anti-aliasing before the converter, and the delay of its filters. A delay of T seconds turns every vector
//! by W·T and must be taken off.

mod keyphasor;
mod phase;
mod sums;
#[cfg(test)]
mod tests;

use core::array;
use core::f32::consts::TAU;

use nalgebra::Complex;

use crate::reading::{Keyphasor, ProbeVector, Reading};
pub use keyphasor::KeyphasorDetector;
use phase::Phase;
use sums::Sums;

/// Channels beside the keyphasor.
pub const PROBES: usize = 4;
/// Fewer samples in a turn than this do not separate 1x from its harmonics.
pub const FEWEST_SAMPLES: f32 = 8.0;
/// A turn may be this much longer or shorter than the turns before let expect; more is a lost or a false mark.
pub const LARGEST_SURPRISE: f32 = 0.05;

/// How probes are connected and what is asked of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtractionConfig {
    /// Samples a second of each channel.
    pub sample_rate_hz: f32,
    /// Converter's step, mV at the probe.
    pub mv_per_count: f32,
    /// Sensitivity of each probe, mV per µm that the shaft comes nearer: 7.87 of an eddy-current probe (200 mV/mil), whose
    /// negative voltage rises then.
    pub scale_mv_um: [f32; PROBES],
    /// Gap voltages of a probe in order, mV: lowest and highest.
    pub gap_range_mv: [f32; 2],
    /// Lowest and highest count of the converter: a sample there is clipped.
    pub rails: [i16; 2],
    pub revolutions: u16,
    /// Largest change of speed within a reading, relative.
    pub largest_drift: f32,
    /// Without a mark for so long, the keyphasor is missing, s.
    pub longest_turn_s: f32,
}

impl ExtractionConfig {
    /// Usual settings: 20 kHz, 12 bits over 24 V below zero, probes of 7.87 mV/µm gapped between −2 and −18 V, 16 turns,
    /// 1 % drift, 100 rpm at least.
    pub fn new() -> Self {
        Self {
            sample_rate_hz: 20_000.0,
            mv_per_count: 24_000.0 / 4096.0,
            scale_mv_um: [7.87; PROBES],
            gap_range_mv: [-18_000.0, -2_000.0],
            rails: [-4096, 0],
            revolutions: 16,
            largest_drift: 0.01,
            longest_turn_s: 0.6,
        }
    }
}

impl Default for ExtractionConfig {
    fn default() -> Self {
        Self::new()
    }
}

/// One window's result. Bit i of a mask is probe i.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Extraction {
    /// Speed and 1x vectors; clipped and open probes are lost, and so is everything without a usable keyphasor.
    pub reading: Reading,
    /// What is known of the phase reference.
    pub keyphasor: Keyphasor,
    /// Mean voltage of each probe, mV.
    pub gap_mv: [f32; PROBES],
    /// Change of speed from the window's first turn to its last, relative.
    pub drift: f32,
    /// Probes with a sample at a rail.
    pub clipped: u8,
    /// Probes whose gap is out of range: not connected, or too near or too far.
    pub open: u8,
}

/// The present turn and the window it belongs to.
#[derive(Debug, Clone, Copy)]
struct Running {
    phase: Phase,
    /// Length of the turn before, samples.
    period: f32,
    /// Samples since the last mark.
    samples: u32,
    /// Time from the last mark to its first sample, samples.
    age: f32,
    turn: Sums,
    window: Sums,
    turns: u16,
    /// Length of the window's first turn and of all its turns, samples.
    first_period: f32,
    length: f32,
}

#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "there is one of them, and no heap to box it on")]
enum Stage {
    /// No mark yet, for so many samples.
    Waiting(u32),
    /// One mark: so many samples since, `age` after it.
    Measuring {
        samples: u32,
        age: f32,
    },
    Running(Running),
}

/// Follows the probes and their keyphasor.
///
/// ```
/// use rotor_edge_core::extraction::{Extractor, ExtractionConfig};
/// // 3000 rpm, 400 samples a turn, each mark on a sample; 10 µm zero-to-peak, nearest to the probes at the mark
/// let config = ExtractionConfig { scale_mv_um: [8.0; 4], ..ExtractionConfig::new() };
/// let mut extractor = Extractor::new();
/// let mut found = None;
/// for n in 0..20 * 400 {
///     let angle = core::f32::consts::TAU * (n % 400) as f32 / 400.0;
///     let mv = -10_000.0 + 8.0 * 10.0 * angle.cos();
///     let mark = (n % 400 == 0).then_some(0.0);
///     found = found.or(extractor.push(&config, [(mv / config.mv_per_count).round() as i16; 4], mark));
/// }
/// let found = found.unwrap();
/// assert!((found.reading.speed_rpm - 3000.0).abs() < 0.01);
/// assert!((found.reading.probes()[0].cos_um - 10.0).abs() < 0.05);
/// assert!((found.gap_mv[0] + 10_000.0).abs() < 1.0);
/// ```
#[derive(Debug, Clone)]
pub struct Extractor {
    stage: Stage,
    /// Counts near the gap, taken off before summing.
    reference: [f32; PROBES],
    clipped: u8,
}

impl Default for Extractor {
    fn default() -> Self {
        Self::new()
    }
}

impl Extractor {
    /// Waits for a first mark.
    pub fn new() -> Self {
        Self { stage: Stage::Waiting(0), reference: [0.0; PROBES], clipped: 0 }
    }

    /// Takes one sample of each probe, in counts. `mark`: the keyphasor passed since the sample before; how long before this
    /// sample, in samples, 0 ≤ mark < 1.
    pub fn push(
        &mut self,
        config: &ExtractionConfig,
        counts: [i16; PROBES],
        mark: Option<f32>,
    ) -> Option<Extraction> {
        let mark = mark.filter(|age| (0.0..=1.0).contains(age));
        let mut result = None;
        match (&mut self.stage, mark) {
            (Stage::Waiting(_), Some(age)) => self.stage = Stage::Measuring { samples: 0, age },
            (&mut Stage::Measuring { samples, age: before }, Some(age)) => {
                let period = samples as f32 + 1.0 + before - age;
                self.stage = match period >= FEWEST_SAMPLES {
                    true => Stage::Running(self.begin(counts, Phase::steady(period, age), period, age)),
                    false => Stage::Measuring { samples: 0, age },
                };
            }
            (Stage::Running(running), Some(age)) => {
                let mut running = *running;
                result = self.turn_ended(config, &mut running, counts, age);
                let is_steady = result.is_none_or(|r| r.keyphasor == Keyphasor::Locked);
                self.stage = match is_steady {
                    true => Stage::Running(running),
                    false => Stage::Measuring { samples: 0, age },
                };
            }
            (stage, None) => {
                let elapsed = match stage {
                    Stage::Waiting(samples) | Stage::Measuring { samples, .. } => samples,
                    Stage::Running(running) => {
                        running.phase.advance();
                        &mut running.samples
                    }
                };
                *elapsed = elapsed.saturating_add(1);
                if *elapsed as f32 > config.longest_turn_s * config.sample_rate_hz {
                    self.stage = Stage::Waiting(0);
                    return self.unusable(Keyphasor::Missing);
                }
            }
        }
        for (probe, count) in counts.into_iter().enumerate() {
            let [low, high] = config.rails;
            self.clipped |= u8::from(count <= low || count >= high) << probe;
        }
        if let Stage::Running(running) = &mut self.stage {
            running.turn.add(relative(counts, &self.reference), running.phase.vector());
        }
        result
    }

    /// A window that begins with this sample, `age` after the mark.
    fn begin(&mut self, counts: [i16; PROBES], phase: Phase, period: f32, age: f32) -> Running {
        self.clipped = 0;
        self.reference = counts.map(f32::from);
        Running {
            phase,
            period,
            samples: 0,
            age,
            turn: Sums::beginning(age),
            window: Sums::default(),
            turns: 0,
            first_period: 0.0,
            length: 0.0,
        }
    }

    /// The mark that ends a turn, `age` before the present sample; the window's result if it was the last.
    fn turn_ended(
        &mut self,
        config: &ExtractionConfig,
        running: &mut Running,
        counts: [i16; PROBES],
        age: f32,
    ) -> Option<Extraction> {
        let period = running.samples as f32 + 1.0 + running.age - age;
        let surprise = running.phase.missing_angle(period);
        let expected = -TAU * LARGEST_SURPRISE..=TAU * LARGEST_SURPRISE;
        if period < FEWEST_SAMPLES || !expected.contains(&surprise) {
            return self.unusable(Keyphasor::Unsteady);
        }
        running.turns = running.turns.saturating_add(1);
        running.length += period;
        if running.turns == 1 {
            running.first_period = period;
        }
        let is_last = running.turns >= config.revolutions;
        if is_last {
            running.turn.end(1.0 - age);
        }
        running.window.add_turned(&running.turn, 0.5 * surprise);
        let phase = Phase::following(running.period, period, age);
        if is_last {
            let result = self.conclude(config, running, period);
            *running = self.begin(counts, phase, period, age);
            return result;
        }
        running.turn = running.turn.next();
        (running.phase, running.period, running.samples, running.age) = (phase, period, 0, age);
        None
    }

    fn conclude(&self, config: &ExtractionConfig, running: &Running, last_period: f32) -> Option<Extraction> {
        let drift = (running.first_period - last_period) * f32::from(running.turns) / running.length;
        if !(-config.largest_drift..=config.largest_drift).contains(&drift) {
            return self.unusable(Keyphasor::Unsteady).map(|found| Extraction { drift, ..found });
        }
        let fits = running.window.fits();
        let gap_mv: [f32; PROBES] =
            array::from_fn(|probe| match (fits.get(probe), self.reference.get(probe)) {
                (Some(fit), Some(reference)) => (fit.mean + reference) * config.mv_per_count,
                _ => f32::NAN,
            });
        let [lowest, highest] = config.gap_range_mv;
        let mut open = 0;
        for (probe, gap_mv) in gap_mv.iter().enumerate() {
            open |= u8::from(!(lowest..=highest).contains(gap_mv)) << probe;
        }
        let lost = open | self.clipped;
        let probes: [ProbeVector; PROBES] =
            array::from_fn(|probe| match (fits.get(probe), config.scale_mv_um.get(probe)) {
                (Some(fit), Some(scale)) if lost >> probe & 1 == 0 => {
                    ProbeVector::from_phasor(fit.phasor * (config.mv_per_count / scale))
                }
                _ => ProbeVector::LOST,
            });
        let speed_rpm = 60.0 * config.sample_rate_hz * f32::from(running.turns) / running.length;
        Some(Extraction {
            reading: Reading::new(speed_rpm, &probes)?.with_gaps_v(&gap_mv.map(|mv| 1e-3 * mv)),
            keyphasor: Keyphasor::Locked,
            gap_mv,
            drift,
            clipped: self.clipped,
            open,
        })
    }

    fn unusable(&self, keyphasor: Keyphasor) -> Option<Extraction> {
        Some(Extraction {
            reading: Reading::new(f32::NAN, &[ProbeVector::LOST; PROBES])?,
            keyphasor,
            gap_mv: [f32::NAN; PROBES],
            drift: f32::NAN,
            clipped: self.clipped,
            open: 0,
        })
    }
}

fn relative(counts: [i16; PROBES], reference: &[f32; PROBES]) -> [f32; PROBES] {
    let mut values = counts.map(f32::from);
    for (value, reference) in values.iter_mut().zip(reference) {
        *value -= reference;
    }
    values
}

/// Mean and 1x phasor of a channel, counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct HarmonicFit {
    mean: f32,
    phasor: Complex<f32>,
}
