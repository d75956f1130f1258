//! The four series of a track that are forecast, a value for each day.

use std::path::Path;

use nalgebra::Complex;

use super::filter_state::FilterState;
use super::known::{COLUMNS, KNOWN, Places};
use crate::error::Error;
use crate::measurement::sequence::{frozen, moved_reference};

/// Static and dynamic unbalance: magnitudes in g·mm and angles in degrees.
pub const NAMES: [&str; 4] = ["U_g", "alpha_g", "U_d", "alpha_d"];
/// The column that is 1 on the first estimate after an event, else 0.
pub const EVENT: &str = "event";
/// Days without an estimate that a straight line may bridge.
const LONGEST_GAP_D: f64 = 7.0;

/// A series with a value a day.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// One of [`NAMES`].
    pub name: &'static str,
    /// The estimates: what forecasts are held against.
    pub values: Vec<f64>,
    /// What was known on each day: what forecasts may use.
    pub known: Vec<f64>,
    /// The state of the filter on each day, of a track whose method has one.
    pub filter_states: Option<Vec<FilterState>>,
}

/// A track as read from CSV.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    pub first_d: f64,
    /// The four series, of equal length.
    pub series: Vec<Series>,
    /// Events that its method found, of a track that says.
    pub events: Option<usize>,
}

impl History {
    pub fn last_d(&self) -> f64 {
        self.first_d + self.series.first().map_or(0, |s| s.values.len().saturating_sub(1)) as f64
    }
}

/// Reads what `track --csv` wrote.
///
/// # Errors
/// If a column is missing, a cell is no number, days do not ascend, or weeks are missing.
pub fn read(path: &Path) -> Result<History, Error> {
    let file = path.display().to_string();
    let text =
        std::fs::read_to_string(path).map_err(|e| Error::file(&file, format!("cannot be read ({e})")))?;
    parse(&file, &text)
}

/// Parses the text of a track; `file` is only for messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<History, Error> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| Error::measurement(file, "header", e.to_string()))?.clone();
    let columns = TrackColumns::find(file, &headers)?;
    let mut track = TrackTable { cells: vec![Vec::new(); 8], ..TrackTable::default() };
    for record in reader.records() {
        let record = record.map_err(|e| Error::measurement(file, "text", e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        track.push(&columns, &TrackRow { file, headers: &headers, record: &record, line })?;
    }
    let Some(first_d) = track.times.first().copied() else {
        return Err(Error::measurement(file, "row 2", "there is no estimate, expected at least one"));
    };
    sound(file, &track.times, &track.cells)?;
    track.unwrap_angles();
    Ok(History {
        first_d,
        series: track.series(columns.filter_states.is_some()),
        events: columns.event.map(|_| track.events),
    })
}

/// Places of the columns in a row.
struct TrackColumns {
    time: usize,
    /// The estimates, in the order of [`COLUMNS`].
    values: Vec<usize>,
    /// What was known on each day; the estimates themselves where the file says nothing else.
    known: Vec<usize>,
    filter_states: Option<Places>,
    event: Option<usize>,
}

impl TrackColumns {
    fn find(file: &str, headers: &csv::StringRecord) -> Result<Self, Error> {
        let find = |name: &str| headers.iter().position(|h| h.trim() == name);
        let need = |name: &str| {
            let what = format!("the column {name} is missing, expected a file that `track --csv` wrote");
            find(name).ok_or_else(|| Error::measurement(file, "header", what))
        };
        let time = need("time_d")?;
        let values = COLUMNS.map(need).into_iter().collect::<Result<Vec<usize>, Error>>()?;
        let known = COLUMNS
            .iter()
            .zip(&values)
            .map(|(name, own)| find(&format!("{KNOWN}{name}")).unwrap_or(*own))
            .collect();
        Ok(Self { time, values, known, filter_states: Places::find(find), event: find(EVENT) })
    }
}

/// One row of the file, with its number for messages.
struct TrackRow<'a> {
    file: &'a str,
    headers: &'a csv::StringRecord,
    record: &'a csv::StringRecord,
    line: u64,
}

impl TrackRow<'_> {
    fn number(&self, column: usize) -> Result<f64, Error> {
        let cell = self.record.get(column).unwrap_or("").trim();
        let wrong = || self.cell_error(column, format!("\"{cell}\" is not a number"));
        cell.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(wrong)
    }

    fn cell_error(&self, column: usize, what: impl Into<String>) -> Error {
        let place = format!("row {}, column {}", self.line, self.headers.get(column).unwrap_or("?"));
        Error::measurement(self.file, place, what.into())
    }

    /// Checks that a row's day is after the last one, and not by more than a forecast may bridge.
    fn follows(&self, last: f64, at: f64) -> Result<(), Error> {
        let what = if at == last {
            format!("day {at} is there twice, expected one estimate at a time; leave one of them out")
        } else if at < last {
            format!("time_d goes back from {last} to {at}, expected ascending days")
        } else if at - last > LONGEST_GAP_D {
            format!(
                "no estimate from day {last} to day {at}; a forecast bridges {LONGEST_GAP_D} days at most, \
                 give the part after the gap alone"
            )
        } else {
            return Ok(());
        };
        Err(Error::measurement(self.file, format!("row {}", self.line), what))
    }
}

/// The rows of a track, column by column.
#[derive(Default)]
struct TrackTable {
    times: Vec<f64>,
    /// The four estimates, then the four numbers that were known on the day.
    cells: Vec<Vec<f64>>,
    filter_states: Vec<[FilterState; 4]>,
    events: usize,
}

impl TrackTable {
    fn push(&mut self, columns: &TrackColumns, row: &TrackRow) -> Result<(), Error> {
        let at = row.number(columns.time)?;
        if let Some(last) = self.times.last() {
            row.follows(*last, at)?;
        }
        self.times.push(at);
        if let Some(column) = columns.event {
            self.events += usize::from(row.number(column)? != 0.0);
        }
        for (all, column) in self.cells.iter_mut().zip(columns.values.iter().chain(&columns.known)) {
            all.push(row.number(*column)?);
        }
        if let Some(places) = &columns.filter_states {
            let out_of_range =
                |column| row.cell_error(column, "is out of range, expected what `track --csv` wrote");
            self.filter_states.push(places.read(|column| row.number(column), out_of_range)?);
        }
        Ok(())
    }

    /// Removes whole turns from the angles; the angle known on the day stays within half a turn of the angle known today.
    fn unwrap_angles(&mut self) {
        for angles in [1, 3, 5, 7] {
            unwrap(&mut self.cells[angles]);
        }
        for (own, then) in [(1, 5), (3, 7)] {
            let (left, right) = self.cells.split_at_mut(then);
            let turn = ((left[own][0] - right[0][0]) / 360.0).round() * 360.0;
            right[0].iter_mut().for_each(|v| *v += turn);
        }
    }

    /// The four series with a value a day.
    fn series(&self, has_filter_states: bool) -> Vec<Series> {
        let daily = |values: &[f64]| every_day(&self.times, values);
        let series = |i: usize| {
            let known = &self.cells[i + 4];
            let levelled =
                |(of_day, level): (&[FilterState; 4], &f64)| FilterState { level: *level, ..of_day[i] };
            let own = || self.filter_states.iter().zip(known).map(levelled).collect::<Vec<_>>();
            Series {
                name: NAMES[i],
                values: daily(&self.cells[i]),
                known: daily(known),
                filter_states: has_filter_states.then(|| kept_up(&self.times, &own())),
            }
        };
        (0..4).map(series).collect()
    }
}

/// Whether the estimates are of a machine over time: none that froze, no phase reference that was moved.
fn sound(file: &str, times: &[f64], cells: &[Vec<f64>]) -> Result<(), Error> {
    let phasor = |size: usize, k: usize| Complex::from_polar(cells[size][k], cells[size + 1][k].to_radians());
    let estimates: Vec<[Complex<f64>; 2]> = (0..times.len()).map(|k| [phasor(0, k), phasor(2, k)]).collect();
    let fault = |k: usize, what: String| Err(Error::measurement(file, format!("row {}", k + 2), what));
    let of_static: Vec<Option<Complex<f64>>> = estimates.iter().map(|e| Some(e[0])).collect();
    if let Some(stretch) = frozen(&of_static).filter(|stretch| stretch.len() < times.len()) {
        let what = format!(
            "the static unbalance is the same to the last digit until row {} (day {} to {}): its values froze, leave \
             the rows out",
            stretch.end + 1,
            times[stretch.start],
            times[stretch.end - 1]
        );
        return fault(stretch.start, what);
    }
    let estimates: Vec<&[Complex<f64>]> = estimates.iter().map(|e| e.as_slice()).collect();
    if let Some((at, angle_deg)) = moved_reference(&estimates) {
        let what = format!(
            "from day {} on static and dynamic unbalance are turned by {angle_deg:.0}° while their sizes stay: the phase \
             reference (keyphasor) was moved; turn the angles from there on back, or forecast from the later part alone",
            times[at]
        );
        return fault(at, what);
    }
    Ok(())
}

/// Takes out jumps by whole turns.
fn unwrap(angles_deg: &mut [f64]) {
    for i in 1..angles_deg.len() {
        let change = angles_deg[i] - angles_deg[i - 1];
        angles_deg[i] -= (change / 360.0).round() * 360.0;
    }
}

/// Whole days from the first time to the last.
fn whole_days(times: &[f64]) -> impl Iterator<Item = f64> {
    let days = (times[times.len() - 1] - times[0] + 1e-9).floor() as usize;
    let first = times[0];
    (0..=days).map(move |day| first + day as f64)
}

/// What was known on each whole day: the newest until then, moved on over days without one.
fn kept_up(times: &[f64], filter_states: &[FilterState]) -> Vec<FilterState> {
    let on = |at: f64| {
        let newest = times.partition_point(|t| *t <= at + 1e-9).saturating_sub(1);
        let days = (at - times[newest]).round() as usize;
        (0..days).fold(filter_states[newest], |state, _| state.next_day())
    };
    whole_days(times).map(on).collect()
}

/// A value for each whole day from the first on, straight lines in between.
fn every_day(times: &[f64], values: &[f64]) -> Vec<f64> {
    whole_days(times)
        .map(|at| {
            let right = times.partition_point(|t| *t < at - 1e-9).min(times.len() - 1);
            let left = right.saturating_sub(1);
            let width = times[right] - times[left];
            if width <= 0.0 || (times[right] - at).abs() < 1e-9 {
                return values[right];
            }
            values[left] + (values[right] - values[left]) * (at - times[left]) / width
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "time_d,static_g_mm,static_deg,dynamic_g_mm,dynamic_deg\n";

    #[test]
    fn missing_days_are_bridged_and_angles_go_through_half_a_turn() {
        let text = format!("{HEAD}3,10,175,1,0\n4,11,179,1,0\n7,14,-177,4,-3\n");
        let h = parse("t.csv", &text).unwrap();
        assert_eq!(h.first_d, 3.0);
        assert_eq!(h.series[0].values, [10.0, 11.0, 12.0, 13.0, 14.0]);
        assert_eq!(h.series[1].values[4], 183.0);
        assert_eq!(h.series[0].known, h.series[0].values);
    }

    #[test]
    fn long_gaps_and_invalid_cells_are_refused_with_their_row() {
        let refusal = |rows: &str| parse("t.csv", &format!("{HEAD}{rows}")).unwrap_err().to_string();
        assert!(refusal("0,1,1,1,1\n20,1,1,1,1\n").contains("row 3: no estimate from day 0 to day 20"));
        assert!(refusal("0,1,x,1,1\n").contains("row 2, column static_deg: \"x\" is not a number"));
        assert!(refusal("0,1,1,1,1\n0,1,1,1,1\n").contains("row 3: day 0 is there twice"));
        assert!(refusal("1,1,1,1,1\n0,1,1,1,1\n").contains("row 3: time_d goes back from 1 to 0"));
        let froze: String = (0..9).map(|d| format!("{d},{},10,20,30\n", 400 + d.min(3))).collect();
        assert!(
            refusal(&froze)
                .contains("row 5: the static unbalance is the same to the last digit until row 10")
        );
        let turned =
            |d: u32| format!("{d},400,{},{},{}\n", d % 3 + 50 * (d / 12), 80 + d % 2, 7 + 50 * (d / 12));
        let moved = refusal(&(0..24).map(turned).collect::<String>());
        assert!(moved.contains("row 14: from day 12 on") && moved.contains("keyphasor"), "{moved}");
        assert!(refusal("").contains("there is no estimate"));
        assert!(parse("t.csv", "time_d\n").unwrap_err().to_string().contains("static_g_mm is missing"));
    }
}
