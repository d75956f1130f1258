//! How many revolutions to ask for.

use super::{ExtractionConfig, FEWEST_SAMPLES};

impl<const PROBES: usize> ExtractionConfig<PROBES> {
    /// The fewest revolutions in which white noise of `noise_um` (standard deviation of a sample, µm) leaves `cos_um` and
    /// `sin_um` a standard deviation of `error_um` each. `None` if that would take more than 65,535, or if an argument is
    /// not possible: a speed out of range, a negative noise, an error that is not positive.
    ///
    /// N samples of white noise σ leave each component σ√(2/N) (Cramér and Rao; the fit attains it), so that
    /// `N = 2σ²/error²`, of which a turn has `60·rate/speed`. σ² is that of the noise and of the rounding to a converter's
    /// step at the least sensitive probe, `step²/12`. Noise within a narrow band around the speed is not white: it falls
    /// with the time that a reading lasts, and more slowly.
    ///
    /// ```
    /// use rotor_edge_core::extraction::{Converter, ExtractionConfig};
    /// let config =
    ///     ExtractionConfig::<4> { converter: Converter::unsigned(16, [-24_000.0, 0.0]), ..ExtractionConfig::new() };
    /// // 1 µm rms at 11,000 rpm and 20 kHz, 109 samples a turn; half the error takes four times the turns
    /// assert_eq!(config.revolutions_for_noise(11_000.0, 1.0, 0.10), Some(2));
    /// assert_eq!(config.revolutions_for_noise(11_000.0, 1.0, 0.05), Some(8));
    /// ```
    pub fn revolutions_for_noise(&self, speed_rpm: f32, noise_um: f32, error_um: f32) -> Option<u16> {
        let samples_a_turn = self.samples_a_turn(speed_rpm)?;
        if !(noise_um >= 0.0 && error_um > 0.0) {
            return None;
        }
        let least_mv_um = self.scale_mv_um.iter().fold(f32::INFINITY, |least, scale| least.min(scale.abs()));
        let step_um = self.converter.mv_per_count / least_mv_um;
        let variance_um2 = noise_um * noise_um + step_um * step_um / 12.0;
        let turns = 2.0 * variance_um2 / (error_um * error_um * samples_a_turn);
        (turns <= f32::from(u16::MAX)).then(|| rounded_up(turns).max(1))
    }

    /// The most revolutions in which a speed that changes by `change_rpm_s` (rpm a second, up or down) stays within
    /// [`ExtractionConfig::largest_drift`]. `None` if it does not for one, or if the speed is out of range.
    ///
    /// A turn takes `60/speed` seconds, in which the speed changes by `60·change/speed²` of itself; n turns change it by n
    /// times as much.
    ///
    /// ```
    /// use rotor_edge_core::extraction::ExtractionConfig;
    /// // a run-up of 50 rpm a second, 1 % of drift: at 1,000 rpm three turns, at ten times the speed a hundred times as many
    /// let config = ExtractionConfig::<4>::new();
    /// assert_eq!(config.revolutions_for_drift(1_000.0, 50.0), Some(3));
    /// assert_eq!(config.revolutions_for_drift(10_000.0, 50.0), Some(333));
    /// assert_eq!(config.revolutions_for_drift(500.0, 50.0), None);
    /// ```
    pub fn revolutions_for_drift(&self, speed_rpm: f32, change_rpm_s: f32) -> Option<u16> {
        self.samples_a_turn(speed_rpm)?;
        let turns = self.largest_drift * speed_rpm * speed_rpm / (60.0 * change_rpm_s.abs());
        // the cast cuts the fraction off and stops at the largest
        (turns >= 1.0).then_some(turns as u16)
    }

    /// None for a speed that is not measured.
    fn samples_a_turn(&self, speed_rpm: f32) -> Option<f32> {
        let samples = 60.0 * self.sample_rate_hz / speed_rpm;
        (FEWEST_SAMPLES..=self.longest_turn()).contains(&samples).then_some(samples)
    }
}

fn rounded_up(turns: f32) -> u16 {
    let whole = turns as u16;
    whole.saturating_add(u16::from(f32::from(whole) < turns))
}
