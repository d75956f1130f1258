//! How the rows of a table are taken.

use super::condition::Condition;
use super::reading::Reading;

/// The day of a cell that holds a date, or why it has none; `None` of a cell that is no date.
pub type DayOfDate<'a> = dyn Fn(&str) -> Option<Result<f64, String>> + 'a;

/// How the rows of a table are taken.
pub(super) struct RowRules<'a> {
    /// Names that the column of days may have, the first of them that is there.
    pub times: &'a [&'a str],
    pub days: &'a DayOfDate<'a>,
    /// Rows at 0 rpm are counted, not refused.
    pub passes_over_standstill: bool,
}

impl RowRules<'_> {
    /// Days are numbers, and every row is of a machine that turns.
    pub const STRICT: Self = Self { times: &["time_d"], days: &|_| None, passes_over_standstill: false };
}

/// The rows of a table: the readings, and the number of rows at 0 rpm.
pub(super) struct Rows {
    pub readings: Vec<Reading>,
    /// Conditions of operation that the readings hold.
    pub conditions: Vec<Condition>,
    pub at_rest: usize,
}
