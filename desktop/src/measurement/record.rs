//! Records over days: their times may be dates, and their machine stands still at times.

use std::path::Path;

use super::condition::Condition;
use super::reading::Reading;
use super::rules::{DayOfDate, RowRules, Rows};
use super::slow_roll::{SLOW_ROLL_SHARE, SlowRoll};
use super::table::{UnlistedRuns, rows, text_of};
use super::{parse_less, within_films};
use crate::error::Error;
use crate::machine::drawing::Rotor;

/// Columns with the days of a record, or with its dates.
const TIMES: [&str; 2] = ["time_d", "time"];

/// A record, without the rows that say nothing of an unbalance.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub readings: Vec<Reading>,
    /// Conditions of operation that the readings hold.
    pub conditions: Vec<Condition>,
    /// Rows at 0 rpm.
    pub at_rest: usize,
    /// Rows below [`Record::slowest_rpm`].
    pub too_slow: usize,
    /// Speed below which a row counts as slow roll: a tenth of the median speed, where the force of an unbalance is 1 % of the usual one.
    pub slowest_rpm: f64,
}

impl Record {
    /// What was passed over, in one sentence.
    pub fn passed_over(&self) -> Option<String> {
        let count = self.at_rest + self.too_slow;
        let rows = if count == 1 { "row was" } else { "rows were" };
        (count > 0).then(|| {
            format!(
                "{count} {rows} passed over, {} at 0 rpm and {} below {:.0} rpm: a machine at rest or on slow roll \
                 says nothing of its unbalance.",
                self.at_rest, self.too_slow, self.slowest_rpm
            )
        })
    }
}

/// Reads a record of this rotor, less a slow roll. A column `time` may hold the dates instead of `time_d`.
///
/// # Errors
/// As [`super::read_less`], and if no row is of a machine that turns.
pub fn read_record(
    path: &Path,
    rotor: &Rotor,
    slow_roll: &SlowRoll,
    days: &DayOfDate,
) -> Result<Record, Error> {
    let (file, text) = text_of(path)?;
    parse_record(&file, &text, rotor, slow_roll, days)
}

/// Reads a measurement of this rotor, less a slow roll; times may be dates, as those of [`read_record`].
///
/// # Errors
/// As [`super::read_less`].
pub fn read_dated(
    path: &Path,
    rotor: &Rotor,
    slow_roll: &SlowRoll,
    days: &DayOfDate,
) -> Result<Vec<Reading>, Error> {
    let (file, text) = text_of(path)?;
    let rules = RowRules { times: &TIMES, days, passes_over_standstill: false };
    parse_less(&file, &text, rotor, slow_roll, UnlistedRuns::Refused, &rules)
}

fn parse_record(
    file: &str,
    text: &str,
    rotor: &Rotor,
    slow_roll: &SlowRoll,
    days: &DayOfDate,
) -> Result<Record, Error> {
    let rules = RowRules { times: &TIMES, days, passes_over_standstill: true };
    let Rows { readings, conditions, at_rest } =
        rows(file, text, rotor, slow_roll.run(), UnlistedRuns::Refused, &rules)?;
    let all = slow_roll.taken_off(file, readings, rotor)?;
    let mut speeds_rpm: Vec<f64> = all.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    let usual_rpm = speeds_rpm.get(speeds_rpm.len() / 2).copied().unwrap_or_default();
    let slowest_rpm = SLOW_ROLL_SHARE * usual_rpm;
    let (readings, slow): (Vec<Reading>, Vec<Reading>) =
        all.into_iter().partition(|r| r.speed_rpm >= slowest_rpm);
    within_films(file, &readings, rotor)?;
    Ok(Record { readings, conditions, at_rest, too_slow: slow.len(), slowest_rpm })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    fn parsed(times: [&str; 4], speeds: [&str; 4]) -> Result<Record, Error> {
        let rotor = sample_rotor();
        let phasors =
            rotor.probe.iter().flat_map(|p| [format!("{}_cos_um", p.name), format!("{}_sin_um", p.name)]);
        let mut text = ["time".to_string(), "speed_rpm".to_string()]
            .into_iter()
            .chain(phasors)
            .collect::<Vec<_>>()
            .join(",");
        for (time, speed) in times.iter().zip(speeds) {
            text += &format!("\n{time},{speed}{}", ",1.5".repeat(2 * rotor.probe.len()));
        }
        let days = |text: &str| {
            text.strip_prefix("day ").map(|d| d.parse().map_err(|_| format!("\"{text}\" is no day")))
        };
        parse_record("r.csv", &text, &rotor, &SlowRoll::Stated, &days)
    }

    #[test]
    fn rows_at_rest_and_on_slow_roll_are_counted_and_passed_over() {
        let record = parsed(["day 0", "day 1", "2", "3.5"], ["9000", "0", "8900", "300"]).unwrap();
        let days: Vec<Option<f64>> = record.readings.iter().map(|r| r.time_d).collect();
        assert_eq!(days, [Some(0.0), Some(2.0)]);
        assert_eq!(record.readings[1].row, Some(4));
        let said = record.passed_over().unwrap();
        assert!(said.starts_with("2 rows were passed over, 1 at 0 rpm and 1 below 890 rpm:"), "{said}");
    }

    #[test]
    fn bad_date_and_record_at_rest_are_refused_with_their_place() {
        let wrong = parsed(["day 0", "day x", "2", "3"], ["9000"; 4]).unwrap_err().to_string();
        assert_eq!(wrong, "r.csv: row 3, column time: \"day x\" is no day");
        let rest = parsed(["0", "1", "2", "3"], ["0"; 4]).unwrap_err().to_string();
        assert!(rest.contains("every row is at 0 rpm"), "{rest}");
    }
}
