//! Units of channels, and the way from each to the displacement.

use rotor_edge_desktop::units::rad_s;

use clap::ValueEnum;
use nalgebra::Complex;

/// Acceleration of free fall, m/s² (ISO 80000-3).
const G_M_S2: f64 = 9.806_65;

/// What a number of a channel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Volts of a proximity probe
    #[value(name = "V")]
    Volt,
    /// Millivolts of a proximity probe
    #[value(name = "mV")]
    Millivolt,
    /// Displacement, µm
    #[value(name = "um")]
    Micrometre,
    /// Velocity, mm/s
    #[value(name = "mm/s")]
    MillimetrePerSecond,
    /// Acceleration, m/s²
    #[value(name = "m/s2")]
    MetrePerSecondSquared,
    /// Acceleration in multiples of 9.80665 m/s²
    #[value(name = "g")]
    G,
}

impl Unit {
    pub fn is_voltage(self) -> bool {
        matches!(self, Self::Volt | Self::Millivolt)
    }

    /// mV that the core is told for one of it; what is no voltage is called 1 mV each, with 1 mV/µm.
    pub fn mv(self) -> f64 {
        if self == Self::Volt { 1000.0 } else { 1.0 }
    }

    /// What a phasor in this unit is multiplied by at a speed to become the displacement in µm; nothing where it is that
    /// already. `u = Re(Y e^{iΩt})` has the velocity `iΩY` and the acceleration `−Ω²Y`.
    pub fn integral(self, speed_rpm: f64) -> Option<Complex<f64>> {
        let omega = rad_s(speed_rpm);
        let real = |factor| Some(Complex::new(factor, 0.0));
        match self {
            Self::Volt | Self::Millivolt | Self::Micrometre => None,
            Self::MillimetrePerSecond => Some(Complex::new(0.0, -1e3 / omega)),
            Self::MetrePerSecondSquared => real(-1e6 / (omega * omega)),
            Self::G => real(-1e6 * G_M_S2 / (omega * omega)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_displacement_is_found_again_from_its_derivatives() {
        // 10 µm cos Ωt at 3000 rpm: velocity −10 Ω sin Ωt, acceleration −10 Ω² cos Ωt
        let omega = 100.0 * std::f64::consts::PI;
        let velocity_mm_s = Complex::new(0.0, 10e-3 * omega);
        let acceleration_m_s2 = Complex::new(-10e-6 * omega * omega, 0.0);
        for (unit, y) in [
            (Unit::MillimetrePerSecond, velocity_mm_s),
            (Unit::MetrePerSecondSquared, acceleration_m_s2),
            (Unit::G, acceleration_m_s2 / 9.80665),
        ] {
            let found = y * unit.integral(3000.0).unwrap();
            assert!((found - 10.0).norm() < 1e-12, "{unit:?}: {found}");
        }
    }
}
