//! Days of a record as dates of the calendar.

use std::cell::Cell;
use std::path::Path;

use anyhow::{Context, Result};

use super::calendar::{Moment, ParsedMoment, of_text};
use super::readings::written::COUNTS_FROM;

/// A date, for messages.
const EXAMPLE: &str = "2026-03-01T06:00:00Z";

/// Column of a track with each estimate's moment.
pub const TIME: &str = "time";

/// Days of the times in a table, which are numbers of days or dates; the first date is that of day 0, unless it is known.
pub struct DayCount {
    begin: Cell<Option<Moment>>,
    /// What the times before were.
    are_dates: Cell<Option<bool>>,
}

impl DayCount {
    /// Counts from this moment on.
    pub fn from(dates: Dates) -> Self {
        Self { begin: Cell::new(dates.0), are_dates: Cell::new(None) }
    }

    /// The day of a cell; nothing of a number.
    pub fn day(&self, cell: &str) -> Option<Result<f64, String>> {
        let is_date = !cell.is_empty() && cell.parse::<f64>().is_err();
        if self.are_dates.get().is_some_and(|before| before != is_date) && !cell.is_empty() {
            return Some(Err(format!(
                "\"{cell}\": days and dates are mixed, expected one of them in every row"
            )));
        }
        self.are_dates.set(Some(is_date));
        is_date.then(|| self.day_of_date(cell))
    }

    fn day_of_date(&self, cell: &str) -> Result<f64, String> {
        let date = match of_text(cell, None) {
            ParsedMoment::Moment(date) if date.iso().is_some() => date,
            ParsedMoment::Ambiguous => {
                return Err(format!("\"{cell}\" may be two dates, expected one as in {EXAMPLE}"));
            }
            _ => {
                return Err(format!(
                    "\"{cell}\" is no date, expected one as in {EXAMPLE}, or a number of days"
                ));
            }
        };
        let begin = self.begin.get().unwrap_or(date);
        self.begin.set(Some(begin));
        let day = date.days_since(begin);
        day.ok_or_else(|| format!("\"{cell}\": its time zone is stated, or that of day 0, but not both"))
    }

    /// When day 0 was, as far as it is known now.
    pub fn dates(&self) -> Dates {
        Dates(self.begin.get())
    }
}

/// When day 0 was, where somebody said so.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dates(Option<Moment>);

/// The moment that a text on the command line is.
pub fn moment(text: &str) -> Result<Moment, String> {
    match of_text(text, None) {
        ParsedMoment::Moment(moment) => Ok(moment),
        _ => Err(format!("\"{text}\" is no moment, expected one as in 2024-03-01T06:00+01:00")),
    }
}

impl Dates {
    /// As stated, or as the header comment of a record says.
    ///
    /// # Errors
    /// If the record cannot be read.
    pub fn of(stated: Option<Moment>, record: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(record)
            .with_context(|| format!("{}: cannot be read", record.display()))?;
        let comments = text.lines().take_while(|line| line.starts_with('#'));
        let said = comments.filter_map(|line| line.split_once(COUNTS_FROM)?.1.parse().ok());
        Ok(Self(stated.or(said.last())))
    }

    /// As the first estimate of a track has it.
    pub fn of_track(text: &str) -> Self {
        let first = || -> Option<Moment> {
            let mut reader = csv::Reader::from_reader(text.as_bytes());
            let headers = reader.headers().ok()?.clone();
            let row = reader.records().next()?.ok()?;
            let cell = |name: &str| row.get(headers.iter().position(|h| h.trim() == name)?);
            let day: f64 = cell("time_d")?.trim().parse().ok()?;
            Some(cell(TIME)?.trim().parse::<Moment>().ok()?.later(-day))
        };
        Self(first())
    }

    /// Whether nobody said when day 0 was.
    pub fn is_unknown(self) -> bool {
        self.0.is_none()
    }

    /// A day's moment in ISO 8601, in UTC or, of a clock whose zone nobody stated, without one.
    pub fn iso(self, time_d: f64) -> Option<String> {
        self.0?.later(time_d).iso()
    }

    pub fn day(self, time_d: f64) -> String {
        let date = self.0.and_then(|start| start.later(time_d).to_the_minute());
        date.map_or(format!("day {time_d:.0}"), |date| format!("day {time_d:.0}, {date}"))
    }

    /// What the axis of time is.
    pub fn axis(self) -> String {
        let from = self.0.and_then(Moment::to_the_minute);
        from.map_or("time, days".into(), |from| format!("time, days from {from}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_told_with_its_date_in_utc_where_the_start_is_known() {
        let dates = Dates(Some(moment("2024-03-01T06:00+01:00").unwrap()));
        assert_eq!(dates.day(125.0), "day 125, 2024-07-04 05:00 UTC");
        assert_eq!(dates.iso(0.5).unwrap(), "2024-03-01T17:00:00Z");
        assert_eq!(Dates::default().day(125.4), "day 125");
        assert_eq!(Dates(Some(moment("2024-03-01 06:00").unwrap())).day(1.0), "day 1, 2024-03-02 06:00");
        assert!(moment("yesterday").unwrap_err().contains("expected one as in 2024-03-01T06:00+01:00"));
    }

    #[test]
    fn dates_count_from_the_first_and_are_not_mixed_with_days() {
        let count = DayCount::from(Dates::default());
        for (cell, day) in [("2026-03-01T06:00:00Z", 0.0), ("2026-03-02T07:00:00+01:00", 1.0)] {
            assert_eq!(count.day(cell), Some(Ok(day)));
        }
        assert_eq!(count.dates().iso(0.0).unwrap(), "2026-03-01T06:00:00Z");
        for (cell, says) in [
            ("4.5", "days and dates are mixed"),
            ("2026-03-04 06:00", "time zone"),
            ("03/04/2026 06:00", "may be two dates"),
            ("06:00", "is no date, expected one as in 2026-03-01T06:00:00Z"),
        ] {
            assert!(matches!(count.day(cell), Some(Err(why)) if why.contains(says)), "{cell}");
        }
        let days = DayCount::from(Dates::default());
        assert_eq!((days.day("3"), days.day("")), (None, None));
        assert!(matches!(days.day("2026-03-01"), Some(Err(why)) if why.contains("mixed")));
    }

    #[test]
    fn a_track_and_a_record_say_when_day_0_was() {
        let dates = Dates::of_track("time_d,time,x\n10,2024-03-11T05:00:00Z,1\n");
        assert_eq!(dates.iso(0.0).unwrap(), "2024-03-01T05:00:00Z");
        assert!(Dates::of_track("time_d,x\n10,1\n").is_unknown());
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("# # {COUNTS_FROM}2024-03-01T05:00:00Z\ntime_d\n")).unwrap();
        assert_eq!(Dates::of(None, file.path()).unwrap().day(0.0), "day 0, 2024-03-01 05:00 UTC");
        let local = moment("2020-01-01").unwrap();
        assert_eq!(Dates::of(Some(local), file.path()).unwrap().iso(0.0).unwrap(), "2020-01-01T00:00:00");
    }
}
