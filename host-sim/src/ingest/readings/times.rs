//! Times that rows do not state in full: times of day without a date, and the hour that comes twice in autumn.

use anyhow::{Result, bail};
use jiff::Timestamp;
use jiff::civil::Weekday;
use jiff::tz::TimeZone;

use super::record::Record;
use crate::ingest::calendar::{DAY_US, Moment};

const HOUR_US: i64 = 3_600_000_000;
/// Clocks go back in these months, north or south of the equator,
const MONTHS: [i8; 6] = [3, 4, 5, 9, 10, 11];
/// and come to an hour no later than this.
const LATEST_HOUR: i8 = 3;

/// What was completed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CompletedTimes {
    /// Whether times were times of day.
    pub of_day: bool,
    /// Table and row from which on the clock was an hour back.
    pub set_back: Option<(u32, u32)>,
}

/// Completes the times of all tables by the order of their rows; `places` are their files and sheets.
///
/// # Errors
/// One sentence with the row if the order of the rows does not say on which day they are.
pub fn complete(record: &mut Record, places: &[String]) -> Result<CompletedTimes> {
    let mut completed = CompletedTimes::default();
    let mut before_change: Option<i64> = None;
    let tables: Vec<Vec<usize>> = (0..places.len())
        .map(|table| {
            let is_of = |at: &usize| record.samples[*at].table as usize == table;
            in_time(record, (0..record.samples.len()).filter(is_of).collect())
        })
        .collect();
    for (rows, place) in tables.iter().zip(places) {
        completed.of_day |= add_days(record, rows, place)?;
        if let Some((at, last)) = add_hour(record, rows) {
            let sample = record.samples[at];
            completed.set_back.get_or_insert((sample.table, sample.row));
            before_change = before_change.max(Some(last));
        }
    }
    // a file of the time after it has the same clock
    for rows in tables.iter().filter(|_| before_change.is_some()) {
        if !rows.iter().any(|at| is_set_back(record, *at, &completed)) {
            for at in rows {
                match &mut record.samples[*at].when {
                    Some(Moment::Local(us)) if Some(*us) > before_change => *us += HOUR_US,
                    _ => (),
                }
            }
        }
    }
    Ok(completed)
}

fn is_set_back(record: &Record, at: usize, completed: &CompletedTimes) -> bool {
    completed.set_back.is_some_and(|(table, _)| table == record.samples[at].table)
}

fn us(record: &Record, at: usize) -> Option<i64> {
    match record.samples[at].when {
        Some(Moment::OfDay(us) | Moment::Local(us)) => Some(us),
        _ => None,
    }
}

/// A row that is earlier than the last one of the same probe.
struct Fall {
    at: usize,
    fall: i64,
    before: i64,
}

/// Rows that are earlier than the one before, and how many are later.
fn falls(record: &Record, rows: &[usize]) -> (Vec<Fall>, usize) {
    let mut last = LastTimes::of(record);
    let (mut falls, mut later) = (Vec::new(), 0);
    for at in rows.iter().copied() {
        let Some(now) = us(record, at) else { continue };
        let Some(before) = last.of_probe(record, at).replace(now) else { continue };
        let of_day = matches!(record.samples[at].when, Some(Moment::OfDay(_)));
        // a time of day is the same a day later, and the shorter way round counts
        let rise =
            if of_day { (now - before + DAY_US / 2).rem_euclid(DAY_US) - DAY_US / 2 } else { now - before };
        later += usize::from(rise > 0);
        if rise < 0 {
            falls.push(Fall { at, fall: -rise, before });
        }
    }
    (falls, later)
}

/// The last time of each probe: rows of different probes may follow each other in any order.
struct LastTimes<T>(Vec<Option<T>>);

impl<T> LastTimes<T> {
    fn of(record: &Record) -> Self {
        Self((0..=record.probes.len()).map(|_| None).collect())
    }

    fn of_probe(&mut self, record: &Record, at: usize) -> &mut Option<T> {
        let held = record.holds(at);
        &mut self.0[held.iter().position(|held| *held).unwrap_or(held.len())]
    }
}

/// Rows of a table in the order of time: as they are, or from below if the newest stands first.
fn in_time(record: &Record, mut rows: Vec<usize>) -> Vec<usize> {
    let (falls, later) = falls(record, &rows);
    if falls.len() > later {
        rows.reverse();
    }
    rows
}

/// Gives times of day the day on which they are: one later whenever the clock has passed midnight.
fn add_days(record: &mut Record, rows: &[usize], place: &str) -> Result<bool> {
    let is_of_day = |at: &&usize| matches!(record.samples[**at].when, Some(Moment::OfDay(_)));
    let Some(first) = rows.iter().find(is_of_day).and_then(|at| us(record, *at)) else { return Ok(false) };
    let mut last = LastTimes::<(i64, i64)>::of(record);
    for at in rows {
        let Some(Moment::OfDay(now)) = record.samples[*at].when else { continue };
        // a probe whose first row is just after midnight
        let begins = (i64::from(first - now > DAY_US / 2), now);
        let (day, before) = last.of_probe(record, *at).get_or_insert(begins);
        let fall = *before - now;
        if fall > HOUR_US {
            *day += 1;
        } else if fall > 0 {
            bail!(
                "{place}: row {}: the time of day is {:.0} s before that of the row before, expected rows in the order of time, or a date with each time",
                record.samples[*at].row,
                fall as f64 / 1e6
            );
        }
        *before = now;
        record.samples[*at].when = Some(Moment::Elapsed((*day * DAY_US + now) as f64 / DAY_US as f64));
    }
    Ok(true)
}

/// Adds an hour from where a clock of local time goes back on, if nothing else puts the rows out of the order of time; the
/// first row after that, and the last time before.
fn add_hour(record: &mut Record, rows: &[usize]) -> Option<(usize, i64)> {
    let (falls, _) = falls(record, rows);
    let first = falls.first()?.at;
    let last = falls.iter().map(|fall| fall.before).max()?;
    let is_change = |Fall { at, fall, before }: &Fall| {
        let is_local = matches!(record.samples[*at].when, Some(Moment::Local(_)));
        is_local && *fall <= HOUR_US && may_go_back(before - fall) && last - before < HOUR_US
    };
    if !falls.iter().all(is_change) {
        return None;
    }
    let mut has_fallen = LastTimes::<()>::of(record);
    for at in rows {
        let has_fallen = has_fallen.of_probe(record, *at);
        if falls.iter().any(|fall| fall.at == *at) {
            *has_fallen = Some(());
        }
        if let (Some(()), Some(Moment::Local(us))) = (has_fallen, &mut record.samples[*at].when) {
            *us += HOUR_US;
        }
    }
    Some((first, last))
}

/// Whether a clock of local time may have been set back to this moment.
fn may_go_back(us: i64) -> bool {
    let Ok(at) = Timestamp::from_microsecond(us) else { return false };
    let at = at.to_zoned(TimeZone::UTC);
    at.weekday() == Weekday::Sunday && MONTHS.contains(&at.month()) && at.hour() <= LATEST_HOUR
}
