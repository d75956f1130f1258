//! Units and conventions of a column, and what they make of its numbers.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::words::Word;

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
            Self::RadS => 30.0 / std::f64::consts::PI,
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

/// What a column states of its numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stated {
    pub length: Option<Length>,
    pub detection: Option<Detection>,
    pub sense: Option<Sense>,
    pub angle: Option<Angle>,
    pub speed: Option<SpeedUnit>,
    pub time: Option<TimeUnit>,
}

impl Stated {
    /// What is stated here, else there.
    pub fn or(self, other: Self) -> Self {
        Self {
            length: self.length.or(other.length),
            detection: self.detection.or(other.detection),
            sense: self.sense.or(other.sense),
            angle: self.angle.or(other.angle),
            speed: self.speed.or(other.speed),
            time: self.time.or(other.time),
        }
    }
}

impl Stated {
    /// Takes what a word says of units, if it does and nothing else was said before.
    pub fn take(&mut self, word: Word) -> bool {
        fn put<T: PartialEq>(place: &mut Option<T>, value: T) -> bool {
            let agrees = place.as_ref().is_none_or(|was| *was == value);
            place.get_or_insert(value);
            agrees
        }
        match word {
            Word::Length(length) => put(&mut self.length, length),
            Word::Detection(detection) => put(&mut self.detection, detection),
            Word::Sense(sense) => put(&mut self.sense, sense),
            Word::Angle(angle) => put(&mut self.angle, angle),
            Word::SpeedUnit(speed) => put(&mut self.speed, speed),
            Word::TimeUnit(time) => put(&mut self.time, time),
            _ => false,
        }
    }
}

impl fmt::Display for Stated {
    /// As it is read from a column's name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length = self.length.map(|length| match length {
            Length::Um => "um",
            Length::Mil => "mil",
            Length::Mm => "mm",
            Length::M => "m",
            Length::Inch => "inch",
            Length::Mv => "mV",
            Length::V => "V",
        });
        let detection = self.detection.map(|detection| match detection {
            Detection::PeakToPeak => "pp",
            Detection::ZeroToPeak => "0p",
            Detection::Rms => "rms",
        });
        let angle = self.angle.map(|angle| if angle == Angle::Degrees { "deg" } else { "rad" });
        let sense = self.sense.map(|sense| if sense == Sense::Lag { "lag" } else { "lead" });
        let speed = self.speed.map(|speed| match speed {
            SpeedUnit::Rpm => "rpm",
            SpeedUnit::Hz => "Hz",
            SpeedUnit::RadS => "rad/s",
        });
        let time = self.time.map(|time| match time {
            TimeUnit::Seconds => "s",
            TimeUnit::Minutes => "min",
            TimeUnit::Hours => "h",
            TimeUnit::Days => "d",
            TimeUnit::Excel => "excel",
            TimeUnit::EpochSeconds => "epoch_s",
            TimeUnit::EpochMilliseconds => "epoch_ms",
        });
        let words: Vec<&str> = [length, detection, angle, sense, speed, time].into_iter().flatten().collect();
        f.write_str(&words.join(" "))
    }
}
