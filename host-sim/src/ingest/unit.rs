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
    #[serde(rename = "um/s")]
    MicrometrePerSecond,
    #[serde(rename = "mm/s")]
    MillimetrePerSecond,
    #[serde(rename = "mil/s")]
    MilPerSecond,
    #[serde(rename = "in/s")]
    InchPerSecond,
    #[serde(rename = "m/s")]
    MetrePerSecond,
    #[serde(rename = "mm/s2")]
    MillimetrePerSecondSquared,
    #[serde(rename = "in/s2")]
    InchPerSecondSquared,
    #[serde(rename = "m/s2")]
    MetrePerSecondSquared,
    /// Multiples of 9.80665 m/s².
    #[serde(rename = "g")]
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
            Self::MicrometrePerSecond => "um/s",
            Self::MillimetrePerSecond => "mm/s",
            Self::MilPerSecond => "mil/s",
            Self::InchPerSecond => "in/s",
            Self::MetrePerSecond => "m/s",
            Self::MillimetrePerSecondSquared => "mm/s2",
            Self::InchPerSecondSquared => "in/s2",
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
            Self::MicrometrePerSecond => Dimension::Velocity(1.0),
            Self::MillimetrePerSecond => Dimension::Velocity(1e3),
            Self::MilPerSecond => Dimension::Velocity(25.4),
            Self::InchPerSecond => Dimension::Velocity(25.4e3),
            Self::MetrePerSecond => Dimension::Velocity(1e6),
            Self::MillimetrePerSecondSquared => Dimension::Acceleration(1e3),
            Self::InchPerSecondSquared => Dimension::Acceleration(25.4e3),
            Self::MetrePerSecondSquared => Dimension::Acceleration(1e6),
            Self::G => Dimension::Acceleration(1e6 * G_M_S2),
        }
    }

    pub fn is_voltage(self) -> bool {
        matches!(self.dimension(), Dimension::Voltage(_))
    }

    pub fn is_displacement(self) -> bool {
        matches!(self.dimension(), Dimension::Displacement(_))
    }

    /// Whether it is one of velocity or acceleration, which no proximity probe has.
    pub fn is_derivative(self) -> bool {
        matches!(self.dimension(), Dimension::Velocity(_) | Dimension::Acceleration(_))
    }

    /// What one unit is of a vibration; a voltage needs the sensitivity of its transducer.
    pub fn vibration(self, sensitivity: Option<Sensitivity>) -> Option<Vibration> {
        match self.dimension() {
            Dimension::Displacement(size) => Some(Vibration { size, derivative: 0 }),
            Dimension::Velocity(size) => Some(Vibration { size, derivative: 1 }),
            Dimension::Acceleration(size) => Some(Vibration { size, derivative: 2 }),
            Dimension::Voltage(mv) => {
                let Sensitivity { mv: of_one, per } = sensitivity?;
                let one = per.vibration(None)?;
                Some(Vibration { size: one.size * mv / of_one, ..one })
            }
        }
    }

    /// mV that the core's extraction takes for one unit; 1 for units other than voltages, with 1 mV/µm.
    pub fn mv(self) -> f64 {
        if let Dimension::Voltage(mv) = self.dimension() { mv } else { 1.0 }
    }

    /// Factor from a phasor in this unit at a speed to the displacement in µm; nothing where the factor is 1 or the unit a
    /// voltage.
    pub fn integral(self, speed_rpm: f64) -> Option<Complex<f64>> {
        let vibration = self.vibration(None)?;
        let is_one = vibration == Vibration { size: 1.0, derivative: 0 };
        (!is_one).then(|| vibration.size * vibration.displacement(speed_rpm))
    }

    /// Parses `--unit` of exported amplitudes.
    pub fn of_amplitudes() -> impl TypedValueParser<Value = Self> {
        let all = [
            (Self::Micrometre, PossibleValue::new("um")),
            (Self::Mil, PossibleValue::new("mil")),
            (Self::Millimetre, PossibleValue::new("mm")),
            (Self::Metre, PossibleValue::new("m")),
            (Self::Inch, PossibleValue::new("inch")),
            (Self::MillimetrePerSecond, PossibleValue::new("mm/s").help("Velocity")),
            (Self::InchPerSecond, PossibleValue::new("in/s")),
            (Self::MetrePerSecondSquared, PossibleValue::new("m/s2").help("Acceleration")),
            (Self::G, PossibleValue::new("g").help("Acceleration in multiples of 9.80665 m/s²")),
            (Self::Millivolt, PossibleValue::new("mv").help("Of a transducer with a known sensitivity")),
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

/// A vibration: how much of it one unit is, and which derivative of the displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vibration {
    /// µm, µm/s or µm/s².
    pub size: f64,
    /// 0 for a displacement, 1 for a velocity, 2 for an acceleration.
    pub derivative: u8,
}

impl Vibration {
    /// Factor from its phasor at a speed to that of the displacement: `u = Re(Y e^{iΩt})` has the velocity `iΩY` and the
    /// acceleration `−Ω²Y`.
    pub fn displacement(self, speed_rpm: f64) -> Complex<f64> {
        Complex::new(0.0, rad_s(speed_rpm)).powi(-i32::from(self.derivative))
    }
}

/// Sensitivity of a transducer, such as 100 mV/g.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    pub mv: f64,
    pub per: Unit,
}

impl Sensitivity {
    pub fn of_probe(mv_um: f64) -> Self {
        Self { mv: mv_um, per: Unit::Micrometre }
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
    /// Thousands of revolutions a minute.
    Krpm,
    Hz,
    /// Of revolutions; of radians where the header names an angular speed.
    PerSecond,
    RadS,
}

impl SpeedUnit {
    pub fn rpm(self) -> f64 {
        match self {
            Self::Rpm => 1.0,
            Self::Krpm => 1e3,
            Self::Hz | Self::PerSecond => 60.0,
            Self::RadS => rpm(1.0),
        }
    }
}

/// How a number is a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    Nanoseconds,
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
    EpochMicroseconds,
    EpochNanoseconds,
}

impl TimeUnit {
    /// Units of times since 1970.
    pub const EPOCHS: [Self; 4] =
        [Self::EpochSeconds, Self::EpochMilliseconds, Self::EpochMicroseconds, Self::EpochNanoseconds];

    pub fn is_epoch(self) -> bool {
        Self::EPOCHS.contains(&self)
    }

    pub fn per_day(self) -> f64 {
        match self {
            Self::Nanoseconds | Self::EpochNanoseconds => 1e9 * SECONDS_A_DAY,
            Self::Microseconds | Self::EpochMicroseconds => 1e6 * SECONDS_A_DAY,
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
            (Unit::MilPerSecond, velocity_mm_s / 25.4e-3),
            (Unit::MicrometrePerSecond, velocity_mm_s * 1e3),
            (Unit::MetrePerSecondSquared, acceleration_m_s2),
            (Unit::G, acceleration_m_s2 / 9.80665),
            (Unit::MillimetrePerSecondSquared, acceleration_m_s2 * 1e3),
            (Unit::InchPerSecondSquared, acceleration_m_s2 / 25.4e-3),
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
