//! Units and conventions of numbers, and their conversion factors.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Unit of an amplitude or a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Length {
    Um,
    Mil,
    Mm,
    M,
    Inch,
    /// Of a probe with a known sensitivity.
    Mv,
    V,
}

impl Length {
    /// µm of one unit; `sensitivity_mv_um` where it is a voltage.
    pub fn um(self, sensitivity_mv_um: Option<f64>) -> Option<f64> {
        Some(match self {
            Self::Um => 1.0,
            Self::Mil => 25.4,
            Self::Mm => 1e3,
            Self::M => 1e6,
            Self::Inch => 25.4e3,
            Self::Mv => 1.0 / sensitivity_mv_um?,
            Self::V => 1e3 / sensitivity_mv_um?,
        })
    }
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

/// Unit of a phase.
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
            Self::RadS => rotor_edge_desktop::units::rpm(1.0),
        }
    }
}

/// How a number is a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
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
