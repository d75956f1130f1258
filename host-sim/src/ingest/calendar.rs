//! Moments as exports write them.

use rotor_edge_desktop::units::SECONDS_A_DAY;
use std::str::FromStr;

use clap::ValueEnum;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp};
use serde::{Deserialize, Serialize};

use super::unit::TimeUnit;

/// Microseconds a day.
pub const DAY_US: i64 = 86_400_000_000;
/// Numbers that are seconds since 1970 and nothing else: 1973 to 2128; milliseconds are a thousand times that.
const EPOCH_S: std::ops::Range<f64> = 1e8..5e9;
/// The same where a unit is stated, which may be of elapsed time: no record is longer than 31 years.
const STATED_EPOCH_S: f64 = 1e9;
/// Days since 1899-12-30 from 1954 to 2119.
const EXCEL_D: std::ops::Range<f64> = 20_000.0..80_000.0;

/// What comes first in a date such as 03/04/2024.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DateOrder {
    DayFirst,
    MonthFirst,
}

/// Behind a moment whose zone nobody stated.
const LOCAL: &str = " local time";

/// Days from the year 1 to 9999: no time is further from its start.
const LARGEST_D: f64 = 3_652_059.0;

/// A moment of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// Microseconds since 1970, UTC.
    Zoned(i64),
    /// The same of a clock on the wall, whose zone nobody stated.
    Local(i64),
    /// Microseconds since midnight of a day that is not stated.
    OfDay(i64),
    /// Days since something.
    Elapsed(f64),
}

impl Moment {
    /// Days from `start` on; nothing if they are not of one kind.
    pub fn days_since(self, start: Self) -> Option<f64> {
        match (self, start) {
            (Self::Zoned(a), Self::Zoned(b))
            | (Self::Local(a), Self::Local(b))
            | (Self::OfDay(a), Self::OfDay(b)) => Some((a - b) as f64 / DAY_US as f64),
            // elapsed time counts from the record's own start
            (Self::Elapsed(days), Self::Elapsed(_)) => Some(days),
            _ => None,
        }
    }

    /// As people write it; nothing if it is no calendar time.
    pub fn calendar(self) -> Option<String> {
        let zone = if matches!(self, Self::Local(_)) { LOCAL } else { "" };
        self.iso().map(|text| format!("{text}{zone}"))
    }

    /// In ISO 8601, in UTC where the zone is known; nothing if it is no calendar time.
    pub fn iso(self) -> Option<String> {
        let written = |us: i64| Timestamp::from_microsecond(us).ok().map(|t| t.to_string());
        match self {
            Self::Zoned(us) => written(us),
            Self::Local(us) => written(us).map(|text| text.trim_end_matches('Z').to_string()),
            Self::OfDay(_) | Self::Elapsed(_) => None,
        }
    }

    pub fn to_the_minute(self) -> Option<String> {
        let text = self.iso()?.replacen('T', " ", 1);
        let zone = if matches!(self, Self::Zoned(_)) { " UTC" } else { "" };
        Some(format!("{}{zone}", text.get(..16)?))
    }

    /// The moment of a clock on the wall; the year 1899 or the first day of 1900 is a spreadsheet's for a time of day.
    pub fn local(time: DateTime) -> Option<Self> {
        let us = time.to_zoned(TimeZone::UTC).ok()?.timestamp().as_microsecond();
        let is_of_day = time.year() == 1899 || time.date() == Date::constant(1900, 1, 1);
        Some(if is_of_day { Self::OfDay(us.rem_euclid(DAY_US)) } else { Self::Local(us) })
    }

    /// The same moment, later by a part of a day.
    pub fn later(self, days: f64) -> Self {
        let us = (days * DAY_US as f64).round() as i64;
        match self {
            Self::Zoned(start) => Self::Zoned(start.saturating_add(us)),
            Self::Local(start) => Self::Local(start.saturating_add(us)),
            Self::OfDay(start) => Self::OfDay(start.saturating_add(us)),
            Self::Elapsed(start) => Self::Elapsed(start + days),
        }
    }
}

/// Reads what [`Moment::calendar`] writes.
impl FromStr for Moment {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match of_text(text.trim().trim_end_matches(LOCAL), None) {
            ParsedMoment::Moment(moment) => Ok(moment),
            _ => Err(()),
        }
    }
}

/// The unit in which a number is a time since 1970, by its size.
pub fn epoch_unit(value: f64) -> Option<TimeUnit> {
    TimeUnit::EPOCHS.into_iter().find(|unit| EPOCH_S.contains(&(value * unit.seconds())))
}

/// The moment that a number is; nothing if the number alone does not say, nor `is_date` that it is one of a spreadsheet.
pub fn of_number(value: f64, unit: Option<TimeUnit>, is_date: impl Fn() -> bool) -> Option<Moment> {
    let by_size = epoch_unit(value);
    let unit = match unit {
        None => by_size.or((EXCEL_D.contains(&value) && is_date()).then_some(TimeUnit::Excel))?,
        // "unix" alone says no unit
        Some(stated) if stated.is_epoch() => by_size.unwrap_or(stated),
        // "ms" of an epoch is the epoch's
        Some(stated) => {
            let is_same = |epoch: &TimeUnit| {
                epoch.per_day() == stated.per_day() && value * epoch.seconds() >= STATED_EPOCH_S
            };
            by_size.filter(is_same).unwrap_or(stated)
        }
    };
    let days = value / unit.per_day();
    if !(-LARGEST_D..=LARGEST_D).contains(&days) {
        return None;
    }
    let whole_us = |seconds: f64| (seconds * 1e6).round() as i64;
    Some(match unit {
        // the quotient of two whole numbers is rounded once, a product with 1e-3 twice
        unit if unit.is_epoch() => Moment::Zoned(whole_us(value / (unit.per_day() / SECONDS_A_DAY))),
        // a double holds a date of today to a microsecond
        TimeUnit::Excel => {
            if (0.0..1.0).contains(&value) {
                return Some(Moment::OfDay(whole_us(value * SECONDS_A_DAY)));
            }
            let zero = Date::constant(1899, 12, 30).at(0, 0, 0, 0).to_zoned(TimeZone::UTC).ok()?;
            Moment::Local(zero.timestamp().as_microsecond() + whole_us(value * SECONDS_A_DAY))
        }
        _ => Moment::Elapsed(days),
    })
}

/// A civil time from its numbers, if there is such a time.
pub fn civil([year, month, day]: [i32; 3], [hour, minute, second]: [u8; 3], milli: u16) -> Option<DateTime> {
    let date = Date::new(year.try_into().ok()?, month.try_into().ok()?, day.try_into().ok()?).ok()?;
    let time = Time::new(hour as i8, minute as i8, second as i8, i32::from(milli) * 1_000_000).ok()?;
    Some(date.to_datetime(time))
}

/// What a text is as a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParsedMoment {
    Moment(Moment),
    /// A date that is another one with month and day exchanged.
    Ambiguous,
    Nothing,
}

/// The moment that a text is.
pub fn of_text(text: &str, order: Option<DateOrder>) -> ParsedMoment {
    if let Some(moment) = of_plain(text) {
        return ParsedMoment::Moment(moment);
    }
    if let Ok(moment) = text.parse::<Timestamp>() {
        return ParsedMoment::Moment(Moment::Zoned(moment.as_microsecond()));
    }
    // times of day and durations of open documents
    if let Some(time) = text.strip_prefix("PT").and_then(|_| text.parse::<SignedDuration>().ok()) {
        let us = i64::try_from(time.as_micros()).unwrap_or(i64::MAX);
        let is_of_day = (0..DAY_US).contains(&us);
        let days = us as f64 / DAY_US as f64;
        return ParsedMoment::Moment(if is_of_day { Moment::OfDay(us) } else { Moment::Elapsed(days) });
    }
    let spaced = text.replacen('T', " ", usize::from(text.as_bytes().get(10) == Some(&b'T')));
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let clock_at = words.iter().position(|w| w.contains(':')).unwrap_or(words.len());
    let clock = if clock_at == words.len() { Some((0.0, false)) } else { clock(&words[clock_at..]) };
    let Some((seconds, utc)) = clock else { return ParsedMoment::Nothing };
    if clock_at == 0 && !words.is_empty() && !utc {
        return ParsedMoment::Moment(Moment::OfDay((seconds * 1e6).round() as i64));
    }
    let date = match date(&words[..clock_at].join(" "), order) {
        Ok(Some(date)) => date,
        Ok(None) => return ParsedMoment::Nothing,
        Err(Exchangeable) => return ParsedMoment::Ambiguous,
    };
    let ns = (seconds * 1e6).round() as i64 * 1000;
    let time = date.to_datetime(Time::midnight()).checked_add(SignedDuration::from_nanos(ns));
    match time.ok().and_then(Moment::local) {
        Some(Moment::Local(us)) if utc => ParsedMoment::Moment(Moment::Zoned(us)),
        Some(moment) => ParsedMoment::Moment(moment),
        None => ParsedMoment::Nothing,
    }
}

/// The moment of `2024-03-05 14:30:15.25`, which most exports write, without a look at any other form.
fn of_plain(text: &str) -> Option<Moment> {
    let bytes = text.as_bytes();
    let number = |from: usize, to: usize| {
        let digits = bytes.get(from..to)?;
        digits
            .iter()
            .all(u8::is_ascii_digit)
            .then(|| digits.iter().fold(0, |n, d| 10 * n + i32::from(d - b'0')))
    };
    let is = |at: usize, of: &[u8]| bytes.get(at).is_some_and(|b| of.contains(b));
    let is_plain = is(4, b"-") && is(7, b"-") && is(10, b" T") && is(13, b":") && is(16, b":");
    let (fraction, digits) = match bytes.get(19) {
        None => (0, 0),
        Some(b'.') if (21..=26).contains(&bytes.len()) => (number(20, bytes.len())?, bytes.len() - 20),
        Some(_) => return None,
    };
    let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
    if !is_plain || hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let date = Date::new(number(0, 4)?.try_into().ok()?, number(5, 7)? as i8, number(8, 10)? as i8).ok()?;
    let micros = fraction * 10_i32.pow(6 - digits as u32);
    let time = Time::new(hour as i8, minute as i8, second as i8, micros * 1000).ok()?;
    Moment::local(date.to_datetime(time))
}

/// Seconds since midnight, and whether that is UTC.
pub fn clock(words: &[&str]) -> Option<(f64, bool)> {
    let (clock, behind) = words.split_first()?;
    let lower = clock.to_lowercase();
    let glued = ["am", "pm", "z"].into_iter().find(|suffix| lower.ends_with(suffix));
    let digits = &lower[..lower.len() - glued.map_or(0, str::len)];
    let mut parts = digits.split(':');
    let mut hours: f64 = parts.next()?.parse().ok()?;
    let minutes: f64 = parts.next()?.parse().ok()?;
    let seconds: f64 = parts.next().map_or(Some(0.0), |s| s.replace(',', ".").parse().ok())?;
    let mut utc = false;
    for word in glued.into_iter().map(String::from).chain(behind.iter().map(|w| w.to_lowercase())) {
        match word.as_str() {
            "am" | "a.m." if hours == 12.0 => hours = 0.0,
            "pm" | "p.m." if hours < 12.0 => hours += 12.0,
            "am" | "a.m." | "pm" | "p.m." | "uhr" => (),
            "utc" | "gmt" | "z" => utc = true,
            _ => return None,
        }
    }
    let fits =
        (0.0..=24.0).contains(&hours) && (0.0..60.0).contains(&minutes) && (0.0..61.0).contains(&seconds);
    let fits = fits && parts.next().is_none();
    fits.then_some((3600.0 * hours + 60.0 * minutes + seconds, utc))
}

/// Month and day may be exchanged.
struct Exchangeable;

fn date(text: &str, order: Option<DateOrder>) -> Result<Option<Date>, Exchangeable> {
    let pieces: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).filter(|p| !p.is_empty()).collect();
    let number = |text: &str| text.parse::<i32>().ok();
    let made = |year: i32, month: i32, day: i32, digits: usize| {
        let year = if digits <= 2 { 2000 + year } else { year };
        civil([year, month, day], [0; 3], 0).map(DateTime::date)
    };
    if let [compact] = pieces[..]
        && compact.len() == 8
        && let Some(n) = number(compact)
    {
        return Ok(made(n / 10_000, n / 100 % 100, n % 100, 4));
    }
    let [first, second, third] = pieces[..] else { return Ok(None) };
    if let Some(month) = month(second) {
        let (day, year) = if first.len() == 4 { (third, first) } else { (first, third) };
        return Ok(number(year).zip(number(day)).and_then(|(y, d)| made(y, month, d, year.len())));
    }
    if let Some(month) = month(first) {
        return Ok(number(third).zip(number(second)).and_then(|(y, d)| made(y, month, d, third.len())));
    }
    let (Some(a), Some(b), Some(c)) = (number(first), number(second), number(third)) else { return Ok(None) };
    if first.len() == 4 {
        return Ok(made(a, b, c, 4));
    }
    let day_first = match order {
        // points between the numbers are of countries that write the day first
        _ if text.contains('.') || a > 12 => true,
        _ if b > 12 => false,
        Some(order) => order == DateOrder::DayFirst,
        None if a == b => true,
        None => return Err(Exchangeable),
    };
    let (day, month) = if day_first { (a, b) } else { (b, a) };
    Ok(made(c, month, day, third.len()))
}

/// Which order a date shows, if it has only one reading.
pub fn order_shown(text: &str) -> Option<DateOrder> {
    if text.contains('.') && !text.contains('/') {
        return None;
    }
    let number = |piece: &str| piece.parse::<i32>().ok();
    let mut pieces = text.split(|c: char| !c.is_ascii_digit());
    let (first, second) = (pieces.next()?, pieces.next()?);
    match (number(first)?, number(second)?) {
        (a, _) if first.len() <= 2 && a > 12 => Some(DateOrder::DayFirst),
        (_, b) if first.len() <= 2 && b > 12 => Some(DateOrder::MonthFirst),
        _ => None,
    }
}

fn month(name: &str) -> Option<i32> {
    const MONTHS: [&[&str]; 12] = [
        &["jan"],
        &["feb"],
        &["mar", "mär", "mrz"],
        &["apr"],
        &["may", "mai"],
        &["jun"],
        &["jul"],
        &["aug"],
        &["sep"],
        &["oct", "okt"],
        &["nov"],
        &["dec", "dez"],
    ];
    let lower = name.to_lowercase();
    let at = MONTHS.iter().position(|names| names.iter().any(|n| lower.starts_with(n)))?;
    i32::try_from(at + 1).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_moment_in_all_its_forms() {
        for text in [
            "2024-03-05 14:30:15",
            "2024-03-05T14:30:15",
            "05.03.2024 14:30:15",
            "5.3.24 14:30:15 Uhr",
            "05-Mar-2024 02:30:15 PM",
            "Mar 5, 2024 2:30:15pm",
            "20240305 14:30:15",
            "2024/03/05 14:30:15.000",
        ] {
            let ParsedMoment::Moment(moment) = of_text(text, None) else { panic!("{text}") };
            assert_eq!(moment.calendar().unwrap(), "2024-03-05T14:30:15 local time", "{text}");
        }
        for text in ["2024-03-05T14:30:15Z", "2024-03-05T15:30:15+01:00", "05.03.2024 14:30:15 UTC"] {
            let ParsedMoment::Moment(moment) = of_text(text, None) else { panic!("{text}") };
            assert_eq!(moment.calendar().unwrap(), "2024-03-05T14:30:15Z", "{text}");
        }
        let serial = of_number(45_356.604_340_277_78, Some(TimeUnit::Excel), || false).unwrap();
        assert_eq!(serial.calendar().unwrap(), "2024-03-05T14:30:15 local time");
        assert_eq!(of_number(45356.6, None, || false), None, "elapsed seconds, or a date");
    }

    #[test]
    fn epochs_of_every_unit_are_told_by_their_size() {
        let elapsed =
            [TimeUnit::Seconds, TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds];
        for ((epoch, elapsed), times) in TimeUnit::EPOCHS.into_iter().zip(elapsed).zip([1.0, 1e3, 1e6, 1e9]) {
            let number = 1_709_649_015.0 * times;
            for unit in [None, Some(epoch), Some(TimeUnit::EpochSeconds), Some(elapsed)] {
                let moment = of_number(number, unit, || false).unwrap();
                assert_eq!(moment.calendar().unwrap(), "2024-03-05T14:30:15Z", "{number} {unit:?}");
            }
            let twenty_years = of_number(6.3e8 * times, Some(elapsed), || false).unwrap();
            assert_eq!(twenty_years, Moment::Elapsed(6.3e8 * times / elapsed.per_day()), "{elapsed:?}");
        }
        let early = of_number(1e6, Some(TimeUnit::EpochSeconds), || false).unwrap();
        assert_eq!(early.calendar().unwrap(), "1970-01-12T13:46:40Z");
        for (number, unit) in [(5e16, None), (5e20, None), (1e13, Some(TimeUnit::Hours)), (f64::NAN, None)] {
            assert_eq!(of_number(number, unit, || false), None, "{number} {unit:?}");
        }
    }

    #[test]
    fn dates_with_two_readings_are_told() {
        assert_eq!(of_text("03/04/2024 10:00", None), ParsedMoment::Ambiguous);
        assert_eq!(order_shown("03/14/2024"), Some(DateOrder::MonthFirst));
        assert_eq!(order_shown("14/03/2024"), Some(DateOrder::DayFirst));
        assert_eq!(order_shown("03/04/2024"), None);
        let (day, month) = (DateOrder::DayFirst, DateOrder::MonthFirst);
        assert_ne!(of_text("03/04/2024", Some(day)), of_text("03/04/2024", Some(month)));
        assert_eq!(of_text("stopped", None), ParsedMoment::Nothing);
    }

    #[test]
    fn impossible_clocks_are_no_moment_and_no_fault() {
        for clock in ["-1e300:00", "25:00", "10:-5", "10:nan", "nan:10", "1e300:00", "10:61:1e300"] {
            assert_eq!(of_text(&format!("2024-03-05 {clock}"), None), ParsedMoment::Nothing, "{clock}");
        }
        let ParsedMoment::Moment(moment) = of_text("2024-03-05 14:30", None) else { panic!() };
        for days in [1e300, -1e300, f64::INFINITY] {
            assert_ne!(moment.later(days), moment);
        }
    }
}
