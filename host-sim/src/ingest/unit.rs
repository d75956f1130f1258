//! Units and conventions of numbers, and their conversion factors.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use nalgebra::Complex;
use rotor_edge_desktop::units::{SECONDS_A_DAY, rad_s, rpm};
use serde::{Deserialize, Serialize};

/// Acceleration of free fall, m/s² (ISO 80000-3).
const G_M_S2: f64 = 9.806_65;

/// Unit of a vibration, or of the voltage of its transducer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    #[serde(rename = "um")]
    Micrometre,
    #[serde(rename = "mil")]
    Mil,
    #[serde(rename = "mm")]
    Millimetre,
    #[serde(rename = "m")]
    Metre,
    #[serde(rename = "inch")]
    Inch,
    #[serde(rename = "mv")]
    Millivolt,
    #[serde(rename = "v")]
    Volt,
    #[serde(skip)]
    MillimetrePerSecond,
    #[serde(skip)]
    InchPerSecond,
    #[serde(skip)]
    MetrePerSecond,
    #[serde(skip)]
    MetrePerSecondSquared,
    /// Multiples of 9.80665 m/s².
    #[serde(skip)]
    G,
}

/// What a unit measures, with the size of the unit in µm, mV, µm/s or µm/s².
enum Dimension {
    Displacement(f64),
    Voltage(f64),
    Velocity(f64),
    Acceleration(f64),
}

impl Unit {
    /// As headers, options and messages write the unit.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Micrometre => "um",
            Self::Mil => "mil",
            Self::Millimetre => "mm",
            Self::Metre => "m",
            Self::Inch => "inch",
            Self::Millivolt => "mV",
            Self::Volt => "V",
            Self::MillimetrePerSecond => "mm/s",
            Self::InchPerSecond => "in/s",
            Self::MetrePerSecond => "m/s",
            Self::MetrePerSecondSquared => "m/s2",
            Self::G => "g",
        }
    }

    fn dimension(self) -> Dimension {
        match self {
            Self::Micrometre => Dimension::Displacement(1.0),
            Self::Mil => Dimension::Displacement(25.4),
            Self::Millimetre => Dimension::Displacement(1e3),
            Self::Metre => Dimension::Displacement(1e6),
            Self::Inch => Dimension::Displacement(25.4e3),
            Self::Millivolt => Dimension::Voltage(1.0),
            Self::Volt => Dimension::Voltage(1e3),
            Self::MillimetrePerSecond => Dimension::Velocity(1e3),
            Self::InchPerSecond => Dimension::Velocity(25.4e3),
            Self::MetrePerSecond => Dimension::Velocity(1e6),
            Self::MetrePerSecondSquared => Dimension::Acceleration(1e6),
            Self::G => Dimension::Acceleration(1e6 * G_M_S2),
        }
    }

    pub fn is_voltage(self) -> bool {
        matches!(self.dimension(), Dimension::Voltage(_))
    }

    /// Whether it is one of velocity or acceleration, which no proximity probe has.
    pub fn is_derivative(self) -> bool {
        matches!(self.dimension(), Dimension::Velocity(_) | Dimension::Acceleration(_))
    }

    /// µm of one unit; a voltage needs the sensitivity, mV/µm. Nothing for velocities and accelerations.
    pub fn um(self, sensitivity_mv_um: Option<f64>) -> Option<f64> {
        match self.dimension() {
            Dimension::Displacement(um) => Some(um),
            Dimension::Voltage(mv) => Some(mv / sensitivity_mv_um?),
            Dimension::Velocity(_) | Dimension::Acceleration(_) => None,
        }
    }

    /// mV that the core's extraction takes for one unit; 1 for units other than voltages, with 1 mV/µm.
    pub fn mv(self) -> f64 {
        if let Dimension::Voltage(mv) = self.dimension() { mv } else { 1.0 }
    }

    /// Factor from a phasor in this unit at a speed to the displacement in µm; nothing where the factor is 1 or the unit a
    /// voltage. `u = Re(Y e^{iΩt})` has the velocity `iΩY` and the acceleration `−Ω²Y`.
    pub fn integral(self, speed_rpm: f64) -> Option<Complex<f64>> {
        let omega = rad_s(speed_rpm);
        match self.dimension() {
            Dimension::Voltage(_) | Dimension::Displacement(1.0) => None,
            Dimension::Displacement(um) => Some(Complex::new(um, 0.0)),
            Dimension::Velocity(um_s) => Some(Complex::new(0.0, -um_s / omega)),
            Dimension::Acceleration(um_s2) => Some(Complex::new(-um_s2 / (omega * omega), 0.0)),
        }
    }

    /// Parses `--unit` of exported amplitudes.
    pub fn of_amplitudes() -> impl TypedValueParser<Value = Self> {
        let all = [
            (Self::Micrometre, PossibleValue::new("um")),
            (Self::Mil, PossibleValue::new("mil")),
            (Self::Millimetre, PossibleValue::new("mm")),
            (Self::Metre, PossibleValue::new("m")),
            (Self::Inch, PossibleValue::new("inch")),
            (Self::Millivolt, PossibleValue::new("mv").help("Of a probe with a known sensitivity")),
            (Self::Volt, PossibleValue::new("v")),
        ];
        one_of(all)
    }

    /// Parses `--unit` of sampled channels.
    pub fn of_channels() -> impl TypedValueParser<Value = Self> {
        let all = [
            (Self::Volt, "Volts of a proximity probe"),
            (Self::Millivolt, "Millivolts of a proximity probe"),
            (Self::Micrometre, "Displacement, µm"),
            (Self::MillimetrePerSecond, "Velocity, mm/s"),
            (Self::MetrePerSecondSquared, "Acceleration, m/s²"),
            (Self::G, "Acceleration in multiples of 9.80665 m/s²"),
        ];
        one_of(all.map(|(unit, help)| (unit, PossibleValue::new(unit.symbol()).help(help))))
    }
}

/// Parses one of the names, and no other.
fn one_of<const N: usize>(all: [(Unit, PossibleValue); N]) -> impl TypedValueParser<Value = Unit> {
    let units = all.each_ref().map(|(unit, value)| (value.get_name().to_string(), *unit));
    PossibleValuesParser::new(all.map(|(_, value)| value)).try_map(move |name| {
        let named = units.iter().find(|(of, _)| *of == name).map(|(_, unit)| *unit);
        named.ok_or("expected one of the units")
    })
}

/// How an amplitude is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detection {
    PeakToPeak,
    ZeroToPeak,
    Rms,
}

impl Detection {
    /// Zero-to-peak of one unit of it, of a sinusoid.
    pub fn zero_to_peak(self) -> f64 {
        match self {
            Self::PeakToPeak => 0.5,
            Self::ZeroToPeak => 1.0,
            Self::Rms => std::f64::consts::SQRT_2,
        }
    }
}

/// Which way a phase counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sense {
    /// From the keyphasor's mark to the peak that comes after it.
    Lag,
    Lead,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Angle {
    Degrees,
    Radians,
}

impl Angle {
    pub fn radians(self) -> f64 {
        if self == Self::Degrees { std::f64::consts::PI / 180.0 } else { 1.0 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpeedUnit {
    Rpm,
    Hz,
    RadS,
}

impl SpeedUnit {
    pub fn rpm(self) -> f64 {
        match self {
            Self::Rpm => 1.0,
            Self::Hz => 60.0,
            Self::RadS => rpm(1.0),
        }
    }
}

/// How a number is a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    Microseconds,
    Milliseconds,
    Seconds,
    Minutes,
    Hours,
    Days,
    /// Days since 1899-12-30.
    Excel,
    /// Since 1970, UTC.
    EpochSeconds,
    EpochMilliseconds,
}

impl TimeUnit {
    pub fn per_day(self) -> f64 {
        match self {
            Self::Microseconds => 1e6 * SECONDS_A_DAY,
            Self::Milliseconds | Self::EpochMilliseconds => 1e3 * SECONDS_A_DAY,
            Self::Seconds | Self::EpochSeconds => SECONDS_A_DAY,
            Self::Minutes => 1440.0,
            Self::Hours => 24.0,
            Self::Days | Self::Excel => 1.0,
        }
    }

    pub fn seconds(self) -> f64 {
        SECONDS_A_DAY / self.per_day()
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
            (Unit::InchPerSecond, velocity_mm_s / 25.4),
            (Unit::MetrePerSecondSquared, acceleration_m_s2),
            (Unit::G, acceleration_m_s2 / 9.80665),
        ] {
            let found = y * unit.integral(3000.0).unwrap();
            assert!((found - 10.0).norm() < 1e-12, "{unit:?}: {found}");
        }
    }

    #[test]
    fn units_of_time_are_their_parts_of_a_day() {
        for (unit, seconds) in [
            (TimeUnit::Milliseconds, 1e-3),
            (TimeUnit::Seconds, 1.0),
            (TimeUnit::Minutes, 60.0),
            (TimeUnit::Days, 86_400.0),
        ] {
            assert_eq!(unit.seconds(), seconds, "{unit:?}");
        }
    }
}
