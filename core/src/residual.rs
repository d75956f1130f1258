//! What the model leaves unexplained in one reading.

use core::error::Error;
use core::fmt;

use crate::reading::{MAX_PROBES, ProbeVector};
use crate::scalar;

/// Why there is no verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResidualError {
    /// A feature is not finite; nothing was changed.
    NotFinite,
}

impl fmt::Display for ResidualError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NotFinite => "a calculated vector of a probe that gave a value is infinite or not a number",
        })
    }
}

impl Error for ResidualError {}

/// Residual of one reading.
///
/// ```
/// use rotor_edge_core::reading::ProbeVector;
/// use rotor_edge_core::residual::Residual;
/// let calculated = [ProbeVector { cos_um: 1.0, sin_um: 1.0 }; 4];
/// let mut measured = calculated;
/// measured[3].sin_um = 3.0;
/// let residual = Residual::new(&calculated, &measured).unwrap();
/// assert_eq!((residual.e_um, residual.f_um, residual.ratio, residual.features), (2.0, 10.0, 0.2, 8));
/// assert_eq!(residual.probe_um[3], 2.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Residual {
    /// `e = Σ|calculated − measured|` over the features of the probes that were measured, µm.
    pub e_um: f32,
    /// `f = Σ|measured|` over the same, µm.
    pub f_um: f32,
    /// `e/f`; zero if both are zero, the largest number if only f is.
    pub ratio: f32,
    /// `Σ|calculated − measured|` over each probe's two features, µm; zero for a lost probe.
    pub probe_um: [f32; MAX_PROBES],
    /// Features that took part: two for each probe that was measured.
    pub features: u8,
}

impl Residual {
    /// Residual of calculated against measured vectors; lost probes are left out.
    ///
    /// Errors: [`ResidualError::NotFinite`] if a calculated part that counts is not finite.
    pub fn new(calculated: &[ProbeVector], measured: &[ProbeVector]) -> Result<Self, ResidualError> {
        let mut residual = Self::default();
        let probes = residual.probe_um.iter_mut().zip(calculated.iter().zip(measured));
        for (probe_um, (calculated, measured)) in probes {
            if measured.is_finite() {
                *probe_um =
                    (calculated.cos_um - measured.cos_um).abs() + (calculated.sin_um - measured.sin_um).abs();
                residual.e_um += *probe_um;
                residual.f_um += measured.cos_um.abs() + measured.sin_um.abs();
                residual.features += 2;
            }
        }
        if !(residual.e_um.is_finite() && residual.f_um.is_finite()) {
            return Err(ResidualError::NotFinite);
        }
        residual.ratio =
            if residual.e_um == 0.0 { 0.0 } else { scalar::lesser(f32::MAX, residual.e_um / residual.f_um) };
        Ok(residual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(part: f32) -> ProbeVector {
        ProbeVector { cos_um: part, sin_um: part }
    }

    #[test]
    fn a_lost_probe_takes_no_part() {
        let mut measured = [vector(1.0); 3];
        measured[1] = ProbeVector::LOST;
        let residual = Residual::new(&[vector(2.0); 3], &measured).unwrap();
        assert_eq!((residual.e_um, residual.f_um, residual.features), (4.0, 4.0, 4));
        assert_eq!(residual.probe_um[..4], [2.0, 0.0, 2.0, 0.0]);
    }

    #[test]
    fn not_a_number_in_what_was_calculated_is_refused() {
        let calculated = [ProbeVector::LOST; 2];
        assert_eq!(Residual::new(&calculated, &[vector(1.0); 2]), Err(ResidualError::NotFinite));
        assert!(
            Residual::new(&calculated, &[ProbeVector::LOST; 2]).is_ok(),
            "what is not measured does not count"
        );
    }

    #[test]
    fn nothing_measured_gives_a_finite_ratio() {
        assert_eq!(Residual::new(&[vector(1.0); 4], &[vector(0.0); 4]).unwrap().ratio, f32::MAX);
        assert_eq!(Residual::new(&[vector(0.0); 4], &[vector(0.0); 4]).unwrap().ratio, 0.0);
    }
}
