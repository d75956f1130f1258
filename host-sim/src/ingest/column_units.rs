//! Units and conventions that the name of a column states.

use std::fmt;

use super::conditions::SourceUnit;
use super::unit::{Angle, Detection, Sense, SpeedUnit, TimeUnit, Unit};
use super::words::Word;

/// Units and conventions that a column states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ColumnUnits {
    pub length: Option<Unit>,
    pub detection: Option<Detection>,
    pub sense: Option<Sense>,
    pub angle: Option<Angle>,
    pub speed: Option<SpeedUnit>,
    pub time: Option<TimeUnit>,
    /// Of a condition of operation.
    pub condition: Option<SourceUnit>,
}

impl ColumnUnits {
    /// What is stated here, else there.
    pub fn or(self, other: Self) -> Self {
        Self {
            length: self.length.or(other.length),
            detection: self.detection.or(other.detection),
            sense: self.sense.or(other.sense),
            angle: self.angle.or(other.angle),
            speed: self.speed.or(other.speed),
            time: self.time.or(other.time),
            condition: self.condition.or(other.condition),
        }
    }

    /// Takes what a word says of units, if it does and nothing else was said before.
    pub fn take(&mut self, word: Word) -> bool {
        fn put<T: PartialEq>(place: &mut Option<T>, value: T) -> bool {
            let agrees = place.as_ref().is_none_or(|was| *was == value);
            place.get_or_insert(value);
            agrees
        }
        match word {
            Word::Unit(unit) => put(&mut self.length, unit),
            Word::Detection(detection) => put(&mut self.detection, detection),
            Word::Sense(sense) => put(&mut self.sense, sense),
            Word::Angle(angle) => put(&mut self.angle, angle),
            Word::SpeedUnit(speed) => put(&mut self.speed, speed),
            Word::TimeUnit(time) => put(&mut self.time, time),
            _ => false,
        }
    }
}

impl fmt::Display for ColumnUnits {
    /// As it is read from a column's name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length = self.length.map(Unit::symbol);
        let detection = self.detection.map(|detection| match detection {
            Detection::PeakToPeak => "pp",
            Detection::ZeroToPeak => "0p",
            Detection::Rms => "rms",
        });
        let angle = self.angle.map(|angle| if angle == Angle::Degrees { "deg" } else { "rad" });
        let sense = self.sense.map(|sense| if sense == Sense::Lag { "lag" } else { "lead" });
        let speed = self.speed.map(|speed| match speed {
            SpeedUnit::Rpm => "rpm",
            SpeedUnit::Krpm => "krpm",
            SpeedUnit::Hz => "Hz",
            SpeedUnit::PerSecond => "1/s",
            SpeedUnit::RadS => "rad/s",
        });
        let time = self.time.map(|time| match time {
            TimeUnit::Nanoseconds => "ns",
            TimeUnit::Microseconds => "us",
            TimeUnit::Milliseconds => "ms",
            TimeUnit::Seconds => "s",
            TimeUnit::Minutes => "min",
            TimeUnit::Hours => "h",
            TimeUnit::Days => "d",
            TimeUnit::Excel => "excel",
            TimeUnit::EpochSeconds => "epoch_s",
            TimeUnit::EpochMilliseconds => "epoch_ms",
            TimeUnit::EpochMicroseconds => "epoch_us",
            TimeUnit::EpochNanoseconds => "epoch_ns",
        });
        let condition = self.condition.map(|unit| unit.symbol);
        let words = [length, detection, angle, sense, speed, time, condition];
        let words: Vec<&str> = words.into_iter().flatten().collect();
        f.write_str(&words.join(" "))
    }
}
