//! How probes are sampled and connected, and what is asked of them.

use core::error::Error;
use core::fmt;

use super::FEWEST_SAMPLES;

/// Bits of a converter, at most: f32 holds their numbers, and the differences of two, exactly.
pub const MOST_BITS: u8 = 24;
/// Samples of a turn, at most: f32 counts so far without a gap.
const LONGEST_TURN: f32 = 16_777_216.0;
/// Samples a second, at most: a speed from them is finite, and no converter of shaft vibration is as fast.
const HIGHEST_RATE_HZ: f32 = 1e9;

/// What the numbers of a converter stand for.
///
/// ```
/// use rotor_edge_core::extraction::Converter;
/// // 16 bits, unsigned, for 0 V down to -24 V at the probe; 16 bits, signed, for ±10 V
/// let unsigned = Converter::unsigned(16, [-24_000.0, 0.0]);
/// assert_eq!((unsigned.rails, unsigned.mv(0.0)), ([0, 65_535], -24_000.0));
/// let signed = Converter::signed(16, [-10_000.0, 10_000.0]);
/// assert_eq!((signed.rails, signed.mv(16_384.0)), ([-32_768, 32_767], 5_000.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    /// Lowest and highest number that it gives: a sample at either is clipped.
    pub rails: [i32; 2],
    /// The number of 0 V at the probe, between two numbers or outside of the rails where it is so.
    pub zero_count: f32,
    /// One step, mV at the probe; negative behind an amplifier that inverts.
    pub mv_per_count: f32,
}

impl Converter {
    /// Straight binary, 0 to 2^bits − 1. `range_mv`: the voltages at the probe of 0 and of 2^bits, one step beyond the
    /// highest number. More than [`MOST_BITS`] give a converter that [`ExtractionConfig::check`] refuses.
    pub const fn unsigned(bits: u8, range_mv: [f32; 2]) -> Self {
        Self::spanning(0, steps(bits), range_mv)
    }

    /// Two's complement, −2^(bits − 1) to 2^(bits − 1) − 1. `range_mv`: the voltages at the probe of the lowest number and of
    /// one step beyond the highest. More than [`MOST_BITS`] give a converter that [`ExtractionConfig::check`] refuses.
    pub const fn signed(bits: u8, range_mv: [f32; 2]) -> Self {
        Self::spanning(-(steps(bits) / 2), steps(bits), range_mv)
    }

    const fn spanning(lowest: i32, steps: i32, [low_mv, high_mv]: [f32; 2]) -> Self {
        let mv_per_count = (high_mv - low_mv) / steps as f32;
        Self {
            rails: [lowest, lowest + steps - 1],
            zero_count: lowest as f32 - low_mv / mv_per_count,
            mv_per_count,
        }
    }

    /// The voltage at the probe of a number, mV.
    pub const fn mv(&self, count: f32) -> f32 {
        (count - self.zero_count) * self.mv_per_count
    }

    /// Room between the rails, numbers that f32 holds, a step that is one.
    const fn is_possible(&self) -> bool {
        let [lowest, highest] = self.rails;
        let largest = 1 << MOST_BITS;
        -largest <= lowest
            && highest <= largest
            && highest - lowest >= 2
            && self.zero_count.is_finite()
            && is_scale(self.mv_per_count)
    }
}

const fn steps(bits: u8) -> i32 {
    if bits > MOST_BITS { 0 } else { 1 << bits }
}

/// A factor that can be divided by.
const fn is_scale(factor: f32) -> bool {
    factor.is_normal()
}

/// How probes are sampled and connected, and what is asked of them.
///
/// [`ExtractionConfig::check`] is `const`: firmware can let the compiler refuse what would be refused at its start.
///
/// ```
/// use rotor_edge_core::extraction::{Converter, ExtractionConfig, ExtractionError};
/// const CONFIG: ExtractionConfig<2> = ExtractionConfig {
///     sample_rate_hz: 25_600.0,
///     converter: Converter::signed(16, [-20_000.0, 20_000.0]),
///     ..ExtractionConfig::new()
/// };
/// const _: () = assert!(CONFIG.check().is_ok());
/// let stopped = ExtractionConfig { sample_rate_hz: 0.0, ..CONFIG };
/// assert_eq!(stopped.check(), Err(ExtractionError::SampleRate));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtractionConfig<const PROBES: usize> {
    /// Samples a second of each channel, Hz.
    pub sample_rate_hz: f32,
    /// The same for all probes.
    pub converter: Converter,
    /// Sensitivity of each probe, mV per µm that the shaft comes nearer: 7.87 of an eddy-current probe (200 mV/mil), whose
    /// negative voltage rises then.
    pub scale_mv_um: [f32; PROBES],
    /// Gap voltages of a probe in order, mV: lowest and highest; infinite where there is no limit.
    pub gap_range_mv: [f32; 2],
    /// Whole turns of a reading.
    pub revolutions: u16,
    /// Largest change of speed within a reading, relative.
    pub largest_drift: f32,
    /// Without a mark for so long, the keyphasor is missing, s.
    pub longest_turn_s: f32,
}

impl<const PROBES: usize> ExtractionConfig<PROBES> {
    /// Usual settings: 20 kHz, 12 bits unsigned from −24 V to 0 V, probes of 7.87 mV/µm gapped between −2 and −18 V, 16
    /// turns, 1 % drift, 100 rpm at least.
    pub const fn new() -> Self {
        Self {
            sample_rate_hz: 20_000.0,
            converter: Converter::unsigned(12, [-24_000.0, 0.0]),
            scale_mv_um: [7.87; PROBES],
            gap_range_mv: [-18_000.0, -2_000.0],
            revolutions: 16,
            largest_drift: 0.01,
            longest_turn_s: 0.6,
        }
    }

    /// Whether readings can be made so.
    ///
    /// # Errors
    /// The first setting that is not possible, in the order of [`ExtractionError`]'s variants.
    pub const fn check(&self) -> Result<(), ExtractionError> {
        // NaN passes no comparison
        if !(self.sample_rate_hz > 0.0 && self.sample_rate_hz <= HIGHEST_RATE_HZ) {
            return Err(ExtractionError::SampleRate);
        }
        if !self.converter.is_possible() {
            return Err(ExtractionError::Converter);
        }
        let mut scales: &[f32] = &self.scale_mv_um;
        while let [scale, others @ ..] = scales {
            if !is_scale(*scale) {
                return Err(ExtractionError::Scale);
            }
            scales = others;
        }
        let [lowest, highest] = self.gap_range_mv;
        if lowest.is_nan() || highest.is_nan() || lowest >= highest {
            return Err(ExtractionError::GapRange);
        }
        if self.revolutions == 0 {
            return Err(ExtractionError::Revolutions);
        }
        if self.largest_drift.is_nan() || self.largest_drift <= 0.0 {
            return Err(ExtractionError::Drift);
        }
        let longest = self.longest_turn();
        // the samples of a window are counted in 32 bits
        let is_counted = longest as u64 * self.revolutions as u64 <= u32::MAX as u64;
        if !(longest >= FEWEST_SAMPLES && longest <= LONGEST_TURN && is_counted) {
            return Err(ExtractionError::LongestTurn);
        }
        Ok(())
    }

    /// The highest speed that is measured, rpm: [`FEWEST_SAMPLES`] in a turn.
    ///
    /// ```
    /// use rotor_edge_core::extraction::ExtractionConfig;
    /// let config = ExtractionConfig::<4> { sample_rate_hz: 4_000.0, ..ExtractionConfig::new() };
    /// assert_eq!(config.fastest_rpm(), 30_000.0);
    /// assert!((config.slowest_rpm() - 100.0).abs() < 0.001);
    /// ```
    pub const fn fastest_rpm(&self) -> f32 {
        60.0 * self.sample_rate_hz / FEWEST_SAMPLES
    }

    /// The lowest speed that is measured, rpm: below, the keyphasor is missing.
    pub const fn slowest_rpm(&self) -> f32 {
        60.0 / self.longest_turn_s
    }

    /// Samples of the longest turn.
    pub(super) const fn longest_turn(&self) -> f32 {
        self.longest_turn_s * self.sample_rate_hz
    }
}

impl<const PROBES: usize> Default for ExtractionConfig<PROBES> {
    fn default() -> Self {
        Self::new()
    }
}

/// Which setting cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ExtractionError {
    /// [`ExtractionConfig::sample_rate_hz`].
    SampleRate,
    /// [`ExtractionConfig::converter`].
    Converter,
    /// [`ExtractionConfig::scale_mv_um`].
    Scale,
    /// [`ExtractionConfig::gap_range_mv`].
    GapRange,
    /// [`ExtractionConfig::revolutions`].
    Revolutions,
    /// [`ExtractionConfig::largest_drift`].
    Drift,
    /// [`ExtractionConfig::longest_turn_s`].
    LongestTurn,
}

impl fmt::Display for ExtractionError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::SampleRate => "sample_rate_hz must be above 0 and at most 1e9 Hz",
            Self::Converter => {
                "converter must have rails in order, of at most 24 bits and with numbers between them, and a finite \
                 zero_count and mv_per_count other than zero"
            }
            Self::Scale => "scale_mv_um must be finite and other than zero",
            Self::GapRange => "gap_range_mv must be two voltages in ascending order",
            Self::Revolutions => "revolutions must be 1 at least",
            Self::Drift => "largest_drift must be above 0",
            Self::LongestTurn => {
                "longest_turn_s must be 8 to 16,777,216 samples, and all turns of a reading 4,294,967,295 at most"
            }
        })
    }
}

impl Error for ExtractionError {}
