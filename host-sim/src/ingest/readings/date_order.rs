//! Which of day and month stands first in dates that may be read both ways.

use crate::ingest::calendar::{self, DateOrder, Moment, ParsedMoment};
use crate::ingest::sheet::{Cell, SheetRow};
use crate::ingest::table::ReadingTable;

/// Steps are even if none is longer than so many times the usual one.
const EVEN: f64 = 2.5;
/// Fewer steps are no evidence.
const FEWEST: usize = 3;

/// The order with which alone the rows follow one another in even steps from one date to the next: with the other one there
/// is a month between the dates.
pub fn order_of_steps(table: &ReadingTable, time: usize, clock: Option<usize>) -> Option<DateOrder> {
    let first = table.rows.find_map(|row| row.cell(time).as_text().map(str::to_string))?;
    if matches!(calendar::of_text(&first, None), ParsedMoment::Moment(_)) {
        return None;
    }
    let even = |order: DateOrder| is_even(table, time, clock, order);
    match (even(DateOrder::DayFirst), even(DateOrder::MonthFirst)) {
        (true, false) => Some(DateOrder::DayFirst),
        (false, true) => Some(DateOrder::MonthFirst),
        _ => None,
    }
}

/// Whether the times of all rows are one kind of moment in even steps, over more than one date.
fn is_even(table: &ReadingTable, time: usize, clock: Option<usize>, order: DateOrder) -> bool {
    let mut days: Vec<f64> = Vec::new();
    let (mut start, mut is_read) = (None, true);
    let read = |row: &SheetRow| {
        let clock = clock.and_then(|clock| row.cell(clock).as_text()).unwrap_or_default();
        let Cell::Text(date) = row.cell(time) else { return row.cell(time).is_empty().then_some(None) };
        match calendar::of_text(format!("{date} {clock}").trim(), Some(order)) {
            ParsedMoment::Moment(moment) => Some(Some(moment)),
            _ => None,
        }
    };
    table.rows.find_map(|row| {
        match read(row) {
            Some(Some(moment)) => {
                let start: &mut Moment = start.get_or_insert(moment);
                days.extend(moment.days_since(*start));
            }
            // lines below the table have no time
            Some(None) => (),
            None => is_read = !days.is_empty() && row.cells.iter().filter(|c| !c.is_empty()).count() < 2,
        }
        (!is_read).then_some(())
    });
    let mut steps: Vec<f64> = days.windows(2).map(|w| w[1] - w[0]).filter(|step| *step != 0.0).collect();
    let is_one_way = steps.iter().all(|step| *step > 0.0) || steps.iter().all(|step| *step < 0.0);
    steps.iter_mut().for_each(|step| *step = step.abs());
    steps.sort_by(f64::total_cmp);
    let Some([usual, longest]) = steps.get(steps.len() / 2).zip(steps.last()).map(|(a, b)| [*a, *b]) else {
        return false;
    };
    // steps of a day or more are a month of the other order's
    is_read && is_one_way && steps.len() >= FEWEST && usual < 1.0 && longest <= EVEN * usual
}
