//! When a residual is suspicious, when suspicion becomes a flag, and how long evidence lasts: all in seconds.
//!
//! On the wire and in storage: u8 version, then the fields in their order, f32 little endian and u8.

use core::error::Error;
use core::fmt;

use crate::packed::{Packed, Reader, pack, packed};

const VERSION: u8 = 1;
pub const THRESHOLDS_BYTES: usize = 1 + 13 * 4 + 2;
pub type ThresholdBytes = [u8; THRESHOLDS_BYTES];

const DAY_S: f32 = 86_400.0;
const YEAR_S: f32 = 365.25 * DAY_S;
/// Shortest time constant, s: of a record of days that is played in milliseconds.
const SHORTEST_S: f32 = 1e-6;

/// What a monitor judges by. The defaults treat a record of one reading a day as Bera et al. (2023) do.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Thresholds {
    /// Rise of the residual above its level that is suspicious, relative: 0.5 means half as much again. 0 to 100.
    pub rise: f32,
    /// Residual ratio e/f that is suspicious whatever the level. 0 to 10.
    pub ratio_limit: f32,
    /// Residual ratio below which a rise is not suspicious: the model still describes the machine. 0 to 1.
    pub ratio_floor: f32,
    /// Residual below which nothing is suspicious, beside that of the model's noise, µm. 0 to 1000.
    pub floor_um: f32,
    /// Time constant of the mean over readings, s: they are averaged before they are judged. 0 to an hour.
    pub average_s: f32,
    /// Suspicion lasts so long before it is a flag, s. 0 to 30 days.
    pub persistence_s: f32,
    /// Time over which the level is averaged, s. A microsecond to 10 years.
    pub level_s: f32,
    /// Time after a deployment whose mean residual is the reference for ever, s. 0 to 30 days.
    pub learning_s: f32,
    /// A plane's unbalance may become this much greater within `growth_s`. 1 to 10.
    pub growth: f32,
    /// See `growth`, s. A microsecond to a year.
    pub growth_s: f32,
    /// Evidence older than this is none, s. 0.1 s to 10 years.
    pub age_limit_s: f32,
    /// A probe whose stated gap voltage is outside is not used, V; in order, within ±100.
    pub gap_range_v: [f32; 2],
    /// Suspicious readings that make a flag at least; those within `average_s` count as one. From 1.
    pub persistence_readings: u8,
    /// Readings that make a reference at least, counted in the same way. From 1.
    pub learning_readings: u8,
}

/// Which threshold is out of its bounds. The numbers travel in a node's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum ThresholdError {
    /// Not the bytes of thresholds.
    Encoding = 1,
    Rise = 2,
    RatioLimit = 3,
    RatioFloor = 4,
    Floor = 5,
    Average = 6,
    /// [`Thresholds::persistence_s`] or [`Thresholds::persistence_readings`].
    Persistence = 7,
    Level = 8,
    /// [`Thresholds::learning_s`] or [`Thresholds::learning_readings`].
    Learning = 9,
    /// [`Thresholds::growth`] or [`Thresholds::growth_s`].
    Growth = 10,
    AgeLimit = 11,
    GapRange = 12,
}

impl fmt::Display for ThresholdError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Encoding => "the bytes are not thresholds of this version",
            Self::Rise => "rise must be from 0 to 100",
            Self::RatioLimit => "ratio_limit must be from 0 to 10",
            Self::RatioFloor => "ratio_floor must be from 0 to 1",
            Self::Floor => "floor_um must be from 0 to 1000 µm",
            Self::Average => "average_s must be from 0 to 3600 s",
            Self::Persistence => {
                "persistence_s must be from 0 s to 30 days, persistence_readings from 1 to 255"
            }
            Self::Level => "level_s must be from 1 µs to 10 years",
            Self::Learning => "learning_s must be from 0 s to 30 days, learning_readings from 1 to 255",
            Self::Growth => "growth must be from 1 to 10, growth_s from 1 µs to a year",
            Self::AgeLimit => "age_limit_s must be from 0.1 s to 10 years",
            Self::GapRange => "gap_range_v must be two voltages in ascending order within ±100 V",
        })
    }
}

impl Error for ThresholdError {}

impl ThresholdError {
    const ALL: [Self; 12] = [
        Self::Encoding,
        Self::Rise,
        Self::RatioLimit,
        Self::RatioFloor,
        Self::Floor,
        Self::Average,
        Self::Persistence,
        Self::Level,
        Self::Learning,
        Self::Growth,
        Self::AgeLimit,
        Self::GapRange,
    ];

    /// The error of a number on the wire.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|error| *error as u8 == code)
    }
}

packed!(Thresholds {
    rise,
    ratio_limit,
    ratio_floor,
    floor_um,
    average_s,
    persistence_s,
    level_s,
    learning_s,
    growth,
    growth_s,
    age_limit_s,
    gap_range_v,
    persistence_readings,
    learning_readings,
});

impl Thresholds {
    pub const DEFAULT: Self = Self {
        rise: 0.5,
        ratio_limit: 1.0 / 3.0,
        ratio_floor: 0.1,
        floor_um: 0.0,
        average_s: 1.0,
        persistence_s: 10.0,
        level_s: 10.0 * DAY_S,
        learning_s: 60.0,
        growth: 1.2,
        growth_s: DAY_S,
        age_limit_s: 10.0,
        gap_range_v: [-18.0, -2.0],
        persistence_readings: 3,
        learning_readings: 10,
    };

    /// Every threshold within its bounds.
    ///
    /// Errors: the first [`ThresholdError`].
    #[inline(never)]
    pub fn check(&self) -> Result<(), ThresholdError> {
        let [lowest_v, highest_v] = self.gap_range_v;
        let fields = [
            (self.rise, [0.0, 100.0], ThresholdError::Rise),
            (self.ratio_limit, [0.0, 10.0], ThresholdError::RatioLimit),
            (self.ratio_floor, [0.0, 1.0], ThresholdError::RatioFloor),
            (self.floor_um, [0.0, 1000.0], ThresholdError::Floor),
            (self.average_s, [0.0, 3600.0], ThresholdError::Average),
            (self.persistence_s, [0.0, 30.0 * DAY_S], ThresholdError::Persistence),
            (f32::from(self.persistence_readings), [1.0, 255.0], ThresholdError::Persistence),
            (self.level_s, [SHORTEST_S, 10.0 * YEAR_S], ThresholdError::Level),
            (self.learning_s, [0.0, 30.0 * DAY_S], ThresholdError::Learning),
            (f32::from(self.learning_readings), [1.0, 255.0], ThresholdError::Learning),
            (self.growth, [1.0, 10.0], ThresholdError::Growth),
            (self.growth_s, [SHORTEST_S, YEAR_S], ThresholdError::Growth),
            (self.age_limit_s, [0.1, 10.0 * YEAR_S], ThresholdError::AgeLimit),
            (lowest_v, [-100.0, 100.0], ThresholdError::GapRange),
            (highest_v, [lowest_v, 100.0], ThresholdError::GapRange),
        ];
        let wrong = fields.iter().find(|(value, [least, most], _)| !(least..=most).contains(&value));
        wrong.map_or(Ok(()), |&(_, _, error)| Err(error))
    }

    pub fn encode(&self) -> ThresholdBytes {
        let mut bytes = [0; THRESHOLDS_BYTES];
        let [version, body @ ..] = &mut bytes;
        *version = VERSION;
        // Cannot fail: the buffer has the size.
        let _ = pack(self, body);
        bytes
    }

    /// Reads and checks what [`Thresholds::encode`] wrote.
    ///
    /// Errors: [`ThresholdError::Encoding`] for another number of bytes or another version, and those of
    /// [`Thresholds::check`].
    ///
    /// ```
    /// use rotor_edge_core::thresholds::{ThresholdError, Thresholds};
    /// let patient = Thresholds { persistence_s: 86_400.0, ..Thresholds::DEFAULT };
    /// assert_eq!(Thresholds::decode(&patient.encode()), Ok(patient));
    /// let never = Thresholds { age_limit_s: 0.0, ..Thresholds::DEFAULT };
    /// assert_eq!(Thresholds::decode(&never.encode()), Err(ThresholdError::AgeLimit));
    /// ```
    pub fn decode(bytes: &[u8]) -> Result<Self, ThresholdError> {
        let bytes = <&ThresholdBytes>::try_from(bytes).map_err(|_| ThresholdError::Encoding)?;
        let [VERSION, body @ ..] = bytes else {
            return Err(ThresholdError::Encoding);
        };
        let mut thresholds = Self::EMPTY;
        // The length is right, and every byte is a part of a number.
        thresholds.read(&mut Reader::new(body));
        thresholds.check()?;
        Ok(thresholds)
    }
}

impl Default for Thresholds {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_the_documented_ones_and_come_back() {
        let thresholds = Thresholds { learning_readings: 77, ..Thresholds::DEFAULT };
        let bytes = thresholds.encode();
        assert_eq!((bytes[0], &bytes[1..5]), (1, &0.5_f32.to_le_bytes()[..]));
        assert_eq!(bytes[45..49], (-18.0_f32).to_le_bytes());
        assert_eq!(bytes[53..], [3, 77]);
        assert_eq!(Thresholds::decode(&bytes), Ok(thresholds));
        assert_eq!(Thresholds::decode(&bytes[..54]), Err(ThresholdError::Encoding));
        assert_eq!(Thresholds::decode(&[2; THRESHOLDS_BYTES]), Err(ThresholdError::Encoding));
    }

    #[test]
    fn each_threshold_out_of_its_bounds_or_not_a_number_is_named() {
        type Fault = (fn(&mut Thresholds, f32), f32, ThresholdError);
        let faults: [Fault; 14] = [
            (|t, x| t.rise = x, -0.1, ThresholdError::Rise),
            (|t, x| t.ratio_limit = x, 11.0, ThresholdError::RatioLimit),
            (|t, x| t.ratio_floor = x, 1.1, ThresholdError::RatioFloor),
            (|t, x| t.floor_um = x, -1.0, ThresholdError::Floor),
            (|t, x| t.average_s = x, 3601.0, ThresholdError::Average),
            (|t, x| t.persistence_s = x, -1.0, ThresholdError::Persistence),
            (|t, x| t.level_s = x, 5e-7, ThresholdError::Level),
            (|t, x| t.learning_s = x, 1e9, ThresholdError::Learning),
            (|t, x| t.growth = x, 0.99, ThresholdError::Growth),
            (|t, x| t.growth_s = x, 0.0, ThresholdError::Growth),
            (|t, x| t.age_limit_s = x, 0.0, ThresholdError::AgeLimit),
            (|t, x| t.gap_range_v[0] = x, -1.0, ThresholdError::GapRange),
            (|t, x| t.gap_range_v[1] = x, 101.0, ThresholdError::GapRange),
            (|t, x| t.persistence_readings = x as u8, 0.0, ThresholdError::Persistence),
        ];
        assert_eq!(Thresholds::DEFAULT.check(), Ok(()));
        for (spoil, value, error) in faults {
            for value in [value, f32::NAN, f32::INFINITY] {
                let mut thresholds = Thresholds::DEFAULT;
                spoil(&mut thresholds, value);
                if thresholds != Thresholds::DEFAULT && thresholds.persistence_readings != 255 {
                    assert_eq!(thresholds.check(), Err(error), "{value}");
                    assert_eq!(Thresholds::decode(&thresholds.encode()), Err(error), "{value}");
                }
            }
        }
        for code in 1..=12 {
            assert_eq!(ThresholdError::from_code(code).map(|error| error as u8), Some(code));
        }
        assert_eq!((ThresholdError::from_code(0), ThresholdError::from_code(13)), (None, None));
    }
}
