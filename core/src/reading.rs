//! What arrives: one 1x reading of up to eight proximity probes at one speed.

use core::array;

use nalgebra::Complex;

use crate::scalar;

/// Probes of a machine, at most.
pub const MAX_PROBES: usize = 8;

/// One probe's 1x vector, zero-to-peak, in µm: `u(t) = cos_um·cos Wt + sin_um·sin Wt`, t = 0 at the keyphasor mark.
///
/// ```
/// use rotor_edge_core::reading::ProbeVector;
/// // A pure sine peaks a quarter turn after the mark: it lags by 90 degrees.
/// let vector = ProbeVector { cos_um: 0.0, sin_um: 12.5 };
/// assert_eq!(vector.peak_to_peak_um(), 25.0);
/// assert!((vector.lag_deg() - 90.0).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ProbeVector {
    /// Part in phase with the keyphasor mark, µm zero-to-peak.
    pub cos_um: f32,
    /// Part a quarter turn later, µm zero-to-peak.
    pub sin_um: f32,
}

impl ProbeVector {
    /// A probe that gave no value.
    pub const LOST: Self = Self { cos_um: f32::NAN, sin_um: f32::NAN };

    /// The vector of the phasor `Y`, `u = Re(Y e^{iWt})`, µm.
    #[inline]
    pub fn from_phasor(phasor: Complex<f32>) -> Self {
        Self { cos_um: phasor.re, sin_um: -phasor.im }
    }

    /// The phasor `Y = cos − i sin`, µm.
    #[inline]
    pub fn phasor(self) -> Complex<f32> {
        Complex::new(self.cos_um, -self.sin_um)
    }

    /// Both parts are finite numbers.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.cos_um.is_finite() && self.sin_um.is_finite()
    }

    /// Amplitude, µm zero-to-peak.
    pub fn amplitude_um(self) -> f32 {
        scalar::length([self.cos_um, self.sin_um])
    }

    /// Amplitude, µm peak-to-peak (what a vibration monitor displays).
    pub fn peak_to_peak_um(self) -> f32 {
        2.0 * self.amplitude_um()
    }

    /// Phase lag of the peak behind the keyphasor mark, degrees, 0 ≤ lag < 360.
    pub fn lag_deg(self) -> f32 {
        scalar::angle_deg(self.sin_um, self.cos_um)
    }
}

/// The probe vectors at one speed, in the order of the model's probes.
///
/// ```
/// use rotor_edge_core::reading::{ProbeVector, Reading};
/// let vector = ProbeVector { cos_um: 3.0, sin_um: 4.0 };
/// let mut reading = Reading::new(3000.0, &[vector; 3]).unwrap();
/// assert_eq!((reading.probes().len(), reading.valid_mask()), (3, 0b111));
/// reading.lose(0b010);
/// assert_eq!((reading.is_complete(), reading.valid_mask()), (false, 0b101));
/// assert!(Reading::new(3000.0, &[]).is_none() && Reading::new(3000.0, &[vector; 9]).is_none());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    pub speed_rpm: f32,
    probes: [ProbeVector; MAX_PROBES],
    gaps_v: [f32; MAX_PROBES],
    count: u8,
}

impl Reading {
    /// One vector for each probe, [`ProbeVector::LOST`] where there is none; gap voltages are not stated. `None` for no
    /// probe at all and for more than [`MAX_PROBES`].
    pub fn new(speed_rpm: f32, probes: &[ProbeVector]) -> Option<Self> {
        let count = u8::try_from(probes.len()).ok().filter(|count| (1..=MAX_PROBES as u8).contains(count))?;
        let probe = |place: usize| probes.get(place).copied().unwrap_or(ProbeVector::LOST);
        Some(Self { speed_rpm, probes: array::from_fn(probe), gaps_v: [f32::NAN; MAX_PROBES], count })
    }

    /// The same reading with the probes' gap voltages, V; NaN where not stated.
    ///
    /// ```
    /// use rotor_edge_core::reading::{ProbeVector, Reading};
    /// let reading = Reading::new(3000.0, &[ProbeVector::LOST; 2]).unwrap().with_gaps_v(&[-9.8, -10.1]);
    /// assert_eq!(reading.gaps_v(), [-9.8, -10.1]);
    /// ```
    pub fn with_gaps_v(mut self, gaps_v: &[f32]) -> Self {
        let count = self.probes().len();
        for (own, &gap_v) in self.gaps_v.iter_mut().zip(gaps_v).take(count) {
            *own = gap_v;
        }
        self
    }

    /// One vector for each probe.
    pub fn probes(&self) -> &[ProbeVector] {
        self.probes.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// One gap voltage for each probe, V; NaN where not stated.
    pub fn gaps_v(&self) -> &[f32] {
        self.gaps_v.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// Bit i: both parts of probe i are finite.
    pub fn valid_mask(&self) -> u8 {
        let valid = |mask, (place, probe): (usize, &ProbeVector)| mask | u8::from(probe.is_finite()) << place;
        self.probes().iter().enumerate().fold(0, valid)
    }

    /// Marks the probes of a mask (bit i: probe i) as [`ProbeVector::LOST`].
    pub fn lose(&mut self, mask: u8) {
        for (place, probe) in self.probes.iter_mut().enumerate() {
            if mask >> place & 1 == 1 {
                *probe = ProbeVector::LOST;
            }
        }
    }

    /// Moves speed and vectors by a part of the way to those of another reading; the gap voltages become its own.
    pub(crate) fn approach(&mut self, other: &Self, part: f32) {
        let move_to = |own: &mut f32, other: f32| *own += part * (other - *own);
        move_to(&mut self.speed_rpm, other.speed_rpm);
        for (own, other) in self.probes.iter_mut().zip(&other.probes) {
            move_to(&mut own.cos_um, other.cos_um);
            move_to(&mut own.sin_um, other.sin_um);
        }
        self.gaps_v = other.gaps_v;
    }

    /// Speed and all features are finite: no probe is lost.
    pub fn is_complete(&self) -> bool {
        self.speed_rpm.is_finite() && self.probes().iter().all(|probe| probe.is_finite())
    }

    pub fn speed_rad_s(&self) -> f32 {
        rad_s(self.speed_rpm)
    }
}

/// What the sender of a reading knows of its keyphasor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Keyphasor {
    #[default]
    NotStated,
    /// One mark a turn, steady.
    Locked,
    /// No mark: speed and phases mean nothing.
    Missing,
    /// The speed changed too much within the reading, or marks came out of step.
    Unsteady,
}

impl Keyphasor {
    #[cfg(feature = "can")]
    pub(crate) const ALL: [Self; 4] = [Self::NotStated, Self::Locked, Self::Missing, Self::Unsteady];

    /// Phases can be believed.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::NotStated | Self::Locked)
    }
}

/// Speed in rad/s of a speed in rpm.
#[inline]
pub fn rad_s(speed_rpm: f32) -> f32 {
    speed_rpm * (core::f32::consts::TAU / 60.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phasor_reproduces_the_waveform_at_every_instant() {
        let vector = ProbeVector { cos_um: 3.0, sin_um: -7.0 };
        for step in 0..12 {
            let angle = f64::from(step) * 0.5;
            let waveform = 3.0 * angle.cos() - 7.0 * angle.sin();
            let y = vector.phasor();
            let rotated = f64::from(y.re) * angle.cos() - f64::from(y.im) * angle.sin();
            assert!((waveform - rotated).abs() < 1e-6);
        }
        assert_eq!(ProbeVector::from_phasor(vector.phasor()), vector);
    }

    #[test]
    fn lag_is_the_instant_of_the_peak() {
        let vector = ProbeVector { cos_um: -2.0, sin_um: 5.0 };
        let lag = f64::from(vector.lag_deg()).to_radians();
        let at = |angle: f64| -2.0 * angle.cos() + 5.0 * angle.sin();
        assert!(at(lag) > at(lag + 0.01) && at(lag) > at(lag - 0.01));
        assert!((at(lag) - f64::from(vector.amplitude_um())).abs() < 1e-5);
    }

    #[test]
    fn a_reading_keeps_what_it_was_given_and_no_more() {
        let vectors = [1.0, 2.0, 3.0].map(|x| ProbeVector { cos_um: x, sin_um: -x });
        let reading = Reading::new(60.0, &vectors).unwrap().with_gaps_v(&[-9.0, f32::NAN, -8.0, -7.0]);
        assert_eq!(reading.probes(), vectors);
        assert_eq!((reading.gaps_v().len(), reading.gaps_v()[2]), (3, -8.0));
        assert!(reading.gaps_v()[1].is_nan());
        assert!((reading.speed_rad_s() - core::f32::consts::TAU).abs() < 1e-6);
    }

    #[test]
    fn lost_probe_makes_reading_incomplete_and_keeps_others() {
        let mut reading = Reading::new(60.0, &[ProbeVector { cos_um: 0.0, sin_um: 0.0 }; 8]).unwrap();
        assert!(reading.is_complete() && reading.valid_mask() == 0xff);
        reading.lose(0b1000_0001);
        assert_eq!((reading.is_complete(), reading.valid_mask()), (false, 0b0111_1110));
    }
}
