//! What is judged of readings before they are averaged: whether they are new, and whether they agree with one another.

use super::{ScreenedReading, Unusable, all_probes};
use crate::detector::{Dispersion, Repeats, Scatter};
use crate::model::Noise;
use crate::reading::{MAX_PROBES, ProbeVector, Reading};
use crate::state::Reason;

/// Memory of raw readings, of one sender and one model. It is not stored: a restart begins with the model's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawHistory {
    /// The last value of each probe.
    last: [ProbeVector; MAX_PROBES],
    last_rpm: f32,
    repeats: Repeats,
    scatter: Scatter,
}

impl Default for RawHistory {
    fn default() -> Self {
        Self {
            last: [ProbeVector::LOST; MAX_PROBES],
            last_rpm: f32::NAN,
            repeats: Repeats::default(),
            scatter: Scatter::default(),
        }
    }
}

impl RawHistory {
    /// Judges a reading and remembers it. Probes that show exactly nothing or repeat too often are lost in it;
    /// [`ScreenedReading::suspicion`] says whether the readings up to this one scatter.
    ///
    /// Without a stated noise, nothing and repeats prove nothing.
    ///
    /// Errors: [`Unusable::Skipped`] if no probe is left, or none has a direction.
    #[inline(never)]
    pub fn judge(
        &mut self,
        noise: Noise,
        mut screened: ScreenedReading,
    ) -> Result<ScreenedReading, Unusable> {
        let all = all_probes(&screened.reading);
        let mut repeats_whole = false;
        if noise.is_stated() {
            screened.lose(probes_at_zero(&screened.reading), Reason::Probes);
            let repetition = self.repeats.update(&self.last, &screened.reading);
            repeats_whole = repetition.is_whole;
            let now = screened.reading;
            screened.lose(repetition.excess_mask & all, Reason::Repeated);
            if screened.missing_mask == all {
                self.remember(&now);
                return Err(Unusable::Skipped { reason: screened.why_missing, missing_mask: all });
            }
        }
        // A reading that only repeats the one before has no scatter of its own.
        let dispersion = if repeats_whole {
            self.scatter.dispersion()
        } else {
            self.scatter.update(noise, &self.last, self.last_rpm, &screened.reading)
        };
        self.remember(&screened.reading);
        match dispersion {
            Dispersion::Usual => Ok(screened),
            Dispersion::Excessive => Ok(ScreenedReading { suspicion: Reason::Scatter, ..screened }),
            Dispersion::NoDirection => Err(Unusable::Skipped { reason: Reason::Scatter, missing_mask: 0 }),
        }
    }

    fn remember(&mut self, reading: &Reading) {
        self.last_rpm = reading.speed_rpm;
        for (last, &now) in self.last.iter_mut().zip(reading.probes()) {
            if now.is_finite() {
                *last = now;
            }
        }
    }
}

fn probes_at_zero(reading: &Reading) -> u8 {
    let is_zero = |probe: &ProbeVector| probe.cos_um == 0.0 && probe.sin_um == 0.0;
    reading
        .probes()
        .iter()
        .enumerate()
        .fold(0, |mask, (place, probe)| mask | u8::from(is_zero(probe)) << place)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise { relative: 0.0, floor_um: 0.1 };

    fn screened(vectors: &[ProbeVector]) -> ScreenedReading {
        let reading = Reading::new(9000.0, vectors).unwrap();
        ScreenedReading { reading, missing_mask: 0, why_missing: Reason::None, suspicion: Reason::None }
    }

    /// Mask and reason of what is lost.
    fn lost(judged: Result<ScreenedReading, Unusable>) -> Result<(u8, Reason), Unusable> {
        judged.map(|judged| (judged.missing_mask, judged.why_missing))
    }

    fn vectors(cos_um: f32) -> [ProbeVector; 4] {
        [1.0, 2.0, 3.0, 4.0].map(|sin_um| ProbeVector { cos_um, sin_um })
    }

    #[test]
    fn memory_of_raw_readings_takes_at_most_800_bytes() {
        assert!(size_of::<RawHistory>() <= 800, "{}", size_of::<RawHistory>());
    }

    #[test]
    fn probe_that_shows_exactly_nothing_is_lost_at_once() {
        let mut one = vectors(1.0);
        one[2] = ProbeVector { cos_um: -0.0, sin_um: 0.0 };
        let judged = RawHistory::default().judge(NOISE, screened(&one)).unwrap();
        assert_eq!((judged.missing_mask, judged.why_missing), (0b0100, Reason::Probes));
        assert_eq!(judged.reading.valid_mask(), 0b1011);
        let all = screened(&[ProbeVector { cos_um: 0.0, sin_um: 0.0 }; 4]);
        let skipped = Unusable::Skipped { reason: Reason::Probes, missing_mask: 0b1111 };
        assert_eq!(RawHistory::default().judge(NOISE, all), Err(skipped));
        let unstated = RawHistory::default().judge(Noise::default(), all);
        assert_eq!(lost(unstated), Ok((0, Reason::None)), "without noise it may be true");
    }

    #[test]
    fn repeats_prove_nothing_without_a_stated_noise() {
        let reading = screened(&vectors(1.0));
        let (mut silent, mut noisy) = (RawHistory::default(), RawHistory::default());
        let repeated = Unusable::Skipped { reason: Reason::Repeated, missing_mask: 0b1111 };
        for number in 0..1000 {
            assert_eq!(lost(silent.judge(Noise::default(), reading)), Ok((0, Reason::None)));
            let expected = if number < 68 { Ok((0, Reason::None)) } else { Err(repeated) };
            assert_eq!(lost(noisy.judge(NOISE, reading)), expected, "{number}");
        }
        let moved = screened(&vectors(1.1));
        assert_eq!(lost(noisy.judge(NOISE, moved)), Ok((0, Reason::None)));
    }

    #[test]
    fn reading_of_frozen_probes_alone_is_skipped() {
        // Probes 1 and 2 are lost; of the others each freezes at its time.
        let mut history = RawHistory::default();
        let mut last = None;
        for step in 0..200_u8 {
            let move_until = |end: u8| f32::from(step.min(end));
            let mut reading = screened(&[
                ProbeVector { cos_um: 1.0, sin_um: 0.01 * move_until(100) },
                ProbeVector::LOST,
                ProbeVector::LOST,
                ProbeVector { cos_um: 2.0, sin_um: 0.01 * move_until(120) },
            ]);
            (reading.missing_mask, reading.why_missing) = (0b0110, Reason::Probes);
            let judged = history.judge(NOISE, reading);
            if step == 115 {
                assert_eq!(judged.map(|judged| judged.missing_mask), Ok(0b0111));
            }
            last = Some(judged);
        }
        let skipped = Unusable::Skipped { reason: Reason::Repeated, missing_mask: 0b1111 };
        assert_eq!(last.map(lost), Some(Err(skipped)));
    }

    #[test]
    fn held_values_scatter_as_their_changes_do() {
        let mut history = RawHistory::default();
        let mut suspicious = 0;
        for step in 0..300_u32 {
            // Each value five times, ten deviations apart.
            let cos_um = 10.0 + [0.0, 1.0, -1.0, 0.5][step as usize / 5 % 4] + 1e-4 * (step / 5) as f32;
            let judged = history.judge(NOISE, screened(&vectors(cos_um))).unwrap();
            suspicious += u32::from(judged.suspicion == Reason::Scatter);
        }
        assert!(suspicious > 200, "{suspicious}");
    }
}
