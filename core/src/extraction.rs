//! From raw probe samples to the 1x reading: synchronous with the keyphasor, over whole revolutions.
//!
//! Samples of one to eight probes and marks come in one by one, an [`Extraction`] comes out after every
//! [`ExtractionConfig::revolutions`] turns, and where there is no reading, one that says why ([`Outcome`]).
//! Between two marks the phase follows the speed and its change, extrapolated from the turns before and put right when the
//! next mark arrives; no sample is kept, and no trigonometric function is called per sample. The window's mean and 1x
//! vector are the least-squares fit of `gap + u_c cos θ + u_s sin θ`, so that a pure sine is found exactly whatever the
//! number of samples in a turn, and the first and last samples are weighted for the part of their interval that lies in the
//! window, which keeps harmonics out. Gap voltages need no keyphasor.
//!
//! Not done here: anti-aliasing before the converter, and the delay of its filters. A delay of T seconds turns every vector
//! by W·T and must be taken off.

mod advice;
mod config;
mod keyphasor;
mod phase;
mod sums;
#[cfg(test)]
mod tests;
mod window;

use core::array;

use nalgebra::Complex;

use crate::reading::{Keyphasor, MAX_PROBES, ProbeVector, Reading};
pub use config::{Converter, ExtractionConfig, ExtractionError, MOST_BITS};
pub use keyphasor::KeyphasorDetector;
use sums::{HarmonicFit, Sums};
use window::Window;

/// Fewer samples in a turn than this do not separate 1x from its harmonics.
pub const FEWEST_SAMPLES: f32 = 8.0;
/// A turn may be this much longer or shorter than the turns before let expect; more is a lost or a false mark.
pub const LARGEST_SURPRISE: f32 = 0.05;

/// Whether a window has vectors, or why not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Outcome {
    /// Speed and vectors are known.
    Measured,
    /// No mark came for [`ExtractionConfig::longest_turn_s`]: no keyphasor, or the shaft stands still.
    NoMark,
    /// A mark came much earlier or later than the turns before let expect: one is lost or false.
    OutOfStep,
    /// The speed changed by more than [`ExtractionConfig::largest_drift`].
    Drift,
    /// Turns have fewer than [`FEWEST_SAMPLES`] samples: faster than [`ExtractionConfig::fastest_rpm`].
    TooFewSamples,
}

impl Outcome {
    /// What a reading says of its phase reference.
    ///
    /// ```
    /// use rotor_edge_core::extraction::Outcome;
    /// use rotor_edge_core::reading::Keyphasor;
    /// assert_eq!(Outcome::NoMark.keyphasor(), Keyphasor::Missing);
    /// assert_eq!(Outcome::TooFewSamples.keyphasor(), Keyphasor::Unsteady);
    /// ```
    pub fn keyphasor(self) -> Keyphasor {
        match self {
            Self::Measured => Keyphasor::Locked,
            Self::NoMark => Keyphasor::Missing,
            Self::OutOfStep | Self::Drift | Self::TooFewSamples => Keyphasor::Unsteady,
        }
    }
}

/// One window's result. Bit i of a mask is probe i.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Extraction<const PROBES: usize> {
    /// Speed, 1x vectors and gap voltages. Vectors of clipped and open probes are lost; unless the outcome is
    /// [`Outcome::Measured`], all are and the speed is NaN.
    pub reading: Reading,
    /// What is known of the phase reference: [`Outcome::keyphasor`].
    pub keyphasor: Keyphasor,
    /// Whether there are vectors, or why not.
    pub outcome: Outcome,
    /// Mean voltage of each probe, mV: with vectors that of the fit, without them of all samples since the result before or
    /// since the window's beginning.
    pub gap_mv: [f32; PROBES],
    /// Change of speed from the window's first turn to its last, relative; NaN if it is not known.
    pub drift: f32,
    /// Probes with a sample at a rail.
    pub clipped: u8,
    /// Probes whose gap is out of range: not connected, or too near or too far.
    pub open: u8,
}

#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "there is one of them, and no heap to box it on")]
enum Stage {
    /// No mark yet.
    Waiting,
    /// One mark, and so many turns of too few samples one after another.
    Measuring {
        short_turns: u16,
    },
    Running(Window),
}

/// Follows the probes and their keyphasor, 1 to 8 probes: another number does not compile.
///
/// ```
/// use rotor_edge_core::extraction::{ExtractionConfig, Extractor};
/// // 3000 rpm, 400 samples a turn, each mark on a sample; 10 µm zero-to-peak, nearest to the probes at the mark
/// let config = ExtractionConfig::<3> { scale_mv_um: [8.0; 3], ..ExtractionConfig::new() };
/// let mut extractor = Extractor::new(config)?;
/// let mut found = None;
/// for n in 0..20 * 400 {
///     let angle = core::f32::consts::TAU * (n % 400) as f32 / 400.0;
///     let mv = -10_000.0 + 8.0 * 10.0 * angle.cos();
///     let count = (4096.0 * (1.0 + mv / 24_000.0)).round() as u16;
///     let mark = (n % 400 == 0).then_some(0.0);
///     found = found.or(extractor.push([count; 3].map(i32::from), mark));
/// }
/// let found = found.unwrap();
/// assert!((found.reading.speed_rpm - 3000.0).abs() < 0.01);
/// assert!((found.reading.probes()[0].cos_um - 10.0).abs() < 0.05);
/// assert!((found.gap_mv[0] + 10_000.0).abs() < 1.0);
/// # Ok::<(), rotor_edge_core::extraction::ExtractionError>(())
/// ```
///
/// ```compile_fail
/// # use rotor_edge_core::extraction::{ExtractionConfig, Extractor};
/// let none = Extractor::<0>::new(ExtractionConfig::new());
/// ```
///
/// ```compile_fail
/// # use rotor_edge_core::extraction::{ExtractionConfig, Extractor};
/// let nine = Extractor::<9>::new(ExtractionConfig::new());
/// ```
#[derive(Debug, Clone)]
pub struct Extractor<const PROBES: usize> {
    config: ExtractionConfig<PROBES>,
    stage: Stage,
    /// Samples since the last mark, or since there was hope for one, and of the longest turn.
    samples: u32,
    longest_turn: u32,
    /// Time from the last mark to its first sample, samples.
    age: f32,
    sums: Sums<PROBES>,
}

impl<const PROBES: usize> Extractor<PROBES> {
    /// Waits for a first mark.
    ///
    /// # Errors
    /// What [`ExtractionConfig::check`] finds.
    ///
    /// ```
    /// use rotor_edge_core::extraction::{ExtractionConfig, ExtractionError, Extractor};
    /// let config = ExtractionConfig::<8> { revolutions: 0, ..ExtractionConfig::new() };
    /// assert_eq!(Extractor::new(config).err(), Some(ExtractionError::Revolutions));
    /// ```
    #[inline(never)]
    pub fn new(config: ExtractionConfig<PROBES>) -> Result<Self, ExtractionError> {
        const { assert!(1 <= PROBES && PROBES <= MAX_PROBES, "an extractor has 1 to 8 probes") };
        config.check()?;
        let longest_turn = config.longest_turn() as u32;
        Ok(Self {
            config,
            stage: Stage::Waiting,
            samples: 0,
            longest_turn,
            age: 0.0,
            sums: Sums::beginning(&[0; PROBES], 0.0),
        })
    }

    /// What it was made with.
    ///
    /// ```
    /// use rotor_edge_core::extraction::{ExtractionConfig, Extractor};
    /// let extractor = Extractor::new(ExtractionConfig::<6>::new())?;
    /// assert_eq!(extractor.config().scale_mv_um.len(), 6);
    /// # Ok::<(), rotor_edge_core::extraction::ExtractionError>(())
    /// ```
    pub fn config(&self) -> &ExtractionConfig<PROBES> {
        &self.config
    }

    /// Forgets the window under way and waits for a first mark, as after [`Extractor::new`]: for samples that do not follow
    /// those before.
    ///
    /// ```
    /// use rotor_edge_core::extraction::{ExtractionConfig, Extractor};
    /// let mut extractor = Extractor::new(ExtractionConfig::<1> { revolutions: 1, ..ExtractionConfig::new() })?;
    /// // three marks, 100 samples apart, are a turn to measure the speed by and one for a reading
    /// let turn = |extractor: &mut Extractor<1>| {
    ///     (0..100).filter_map(|n| extractor.push([2048], (n == 0).then_some(0.0))).count()
    /// };
    /// assert_eq!([turn(&mut extractor), turn(&mut extractor), turn(&mut extractor)], [0, 0, 1]);
    /// // samples were lost
    /// extractor.restart();
    /// assert_eq!([turn(&mut extractor), turn(&mut extractor), turn(&mut extractor)], [0, 0, 1]);
    /// # Ok::<(), rotor_edge_core::extraction::ExtractionError>(())
    /// ```
    pub fn restart(&mut self) {
        (self.stage, self.samples, self.age) = (Stage::Waiting, 0, 0.0);
        self.sums.begin(&[0; PROBES], 0.0);
    }

    /// Takes one sample of each probe, in the [`Converter`]'s numbers: `u16` and `i16` alike fit `i32`, and a processor
    /// extends them as it loads them. `mark`: the keyphasor passed since the sample before; how long before this sample, in
    /// samples, 0 ≤ mark ≤ 1. Another number is no mark.
    ///
    /// Gives a result after [`ExtractionConfig::revolutions`] turns, and one without vectors where a window is broken off,
    /// each time that the longest turn passes without a mark, and after as many turns again with too few samples.
    ///
    /// ```
    /// use rotor_edge_core::extraction::{ExtractionConfig, Extractor, Outcome};
    /// // no keyphasor: gap voltages all the same, here of one probe at −12 V
    /// let mut extractor = Extractor::new(ExtractionConfig::<1>::new())?;
    /// let found = (0..20_000).find_map(|_| extractor.push([2048], None)).unwrap();
    /// assert_eq!((found.outcome, found.gap_mv, found.open), (Outcome::NoMark, [-12_000.0], 0));
    /// # Ok::<(), rotor_edge_core::extraction::ExtractionError>(())
    /// ```
    pub fn push(&mut self, counts: [i32; PROBES], mark: Option<f32>) -> Option<Extraction<PROBES>> {
        if let Some(age) = mark.filter(|age| (0.0..=1.0).contains(age)) {
            return self.push_marked(&counts, age);
        }
        let vector = match &mut self.stage {
            Stage::Running(window) => window.phase.advance(),
            Stage::Waiting | Stage::Measuring { .. } => Complex::new(0.0, 0.0),
        };
        self.sums.add(&counts, vector, self.config.converter.rails);
        self.samples = self.samples.saturating_add(1);
        if self.samples > self.longest_turn {
            return self.time_out(&counts);
        }
        None
    }

    #[cold]
    fn time_out(&mut self, counts: &[i32; PROBES]) -> Option<Extraction<PROBES>> {
        let result = self.lost(Outcome::NoMark, f32::NAN);
        (self.stage, self.samples, self.age) = (Stage::Waiting, 0, 0.0);
        self.sums.begin(counts, 0.0);
        result
    }

    /// A sample and the mark `age` before it.
    #[inline(never)]
    fn push_marked(&mut self, counts: &[i32; PROBES], age: f32) -> Option<Extraction<PROBES>> {
        let period = self.samples as f32 + 1.0 + self.age - age;
        (self.samples, self.age) = (0, age);
        let result = match &self.stage {
            Stage::Waiting => {
                self.stage = Stage::Measuring { short_turns: 0 };
                None
            }
            Stage::Measuring { .. } if period >= FEWEST_SAMPLES => {
                self.stage = Stage::Running(Window::new(period, age));
                self.sums.begin(counts, age);
                None
            }
            &Stage::Measuring { short_turns } => self.short_turn(counts, short_turns.saturating_add(1)),
            Stage::Running(_) => self.end_turn(counts, period),
        };
        let vector = match &self.stage {
            Stage::Running(window) => window.phase.vector(),
            Stage::Waiting | Stage::Measuring { .. } => Complex::new(0.0, 0.0),
        };
        self.sums.add(counts, vector, self.config.converter.rails);
        result
    }

    /// A turn of too few samples, the last of so many.
    fn short_turn(&mut self, counts: &[i32; PROBES], short_turns: u16) -> Option<Extraction<PROBES>> {
        if short_turns < self.config.revolutions {
            self.stage = Stage::Measuring { short_turns };
            return None;
        }
        self.break_off(counts, Outcome::TooFewSamples, f32::NAN)
    }

    /// A turn of the window ends with the last mark; the window's result if it was the last.
    fn end_turn(&mut self, counts: &[i32; PROBES], period: f32) -> Option<Extraction<PROBES>> {
        let Stage::Running(window) = &mut self.stage else {
            return None;
        };
        let lag = match window.end_turn(period, self.age) {
            Ok(lag) => lag,
            Err(outcome) => return self.break_off(counts, outcome, f32::NAN),
        };
        let is_last = window.turns() >= self.config.revolutions;
        if is_last {
            self.sums.end(1.0 - self.age);
        }
        self.sums.end_turn(lag);
        if !is_last {
            return None;
        }
        let (drift, speed) = (window.drift(), window.speed());
        window.begin_next();
        if !(-self.config.largest_drift..=self.config.largest_drift).contains(&drift) {
            return self.break_off(counts, Outcome::Drift, drift);
        }
        let speed_rpm = 60.0 * self.config.sample_rate_hz * speed;
        let result = self.result(Outcome::Measured, speed_rpm, drift, &self.sums.fits());
        self.sums.begin(counts, self.age);
        result
    }

    /// A result without vectors; turns are measured anew from the last mark on.
    fn break_off(
        &mut self,
        counts: &[i32; PROBES],
        outcome: Outcome,
        drift: f32,
    ) -> Option<Extraction<PROBES>> {
        let result = self.lost(outcome, drift);
        self.stage = Stage::Measuring { short_turns: 0 };
        self.sums.begin(counts, self.age);
        result
    }

    fn lost(&self, outcome: Outcome, drift: f32) -> Option<Extraction<PROBES>> {
        self.result(outcome, f32::NAN, drift, &self.sums.means())
    }

    fn result(
        &self,
        outcome: Outcome,
        speed_rpm: f32,
        drift: f32,
        fits: &[HarmonicFit; PROBES],
    ) -> Option<Extraction<PROBES>> {
        let ExtractionConfig { converter, scale_mv_um, gap_range_mv: [lowest, highest], .. } = &self.config;
        let gap_mv = fits.map(|fit| converter.mv(fit.mean));
        let mut open = 0;
        for (probe, gap_mv) in gap_mv.iter().enumerate() {
            open |= u8::from(!(lowest..=highest).contains(&gap_mv)) << probe;
        }
        let clipped = self.sums.clipped();
        let lost = match outcome {
            Outcome::Measured => open | clipped,
            _ => u8::MAX,
        };
        let probes: [ProbeVector; PROBES] =
            array::from_fn(|probe| match (fits.get(probe), scale_mv_um.get(probe)) {
                (Some(fit), Some(scale)) if lost >> probe & 1 == 0 => {
                    ProbeVector::from_phasor(fit.phasor * (converter.mv_per_count / scale))
                }
                _ => ProbeVector::LOST,
            });
        let reading = Reading::new(speed_rpm, &probes)?.with_gaps_v(&gap_mv.map(|mv| 1e-3 * mv));
        let keyphasor = outcome.keyphasor();
        Some(Extraction { reading, keyphasor, outcome, gap_mv, drift, clipped, open })
    }
}
