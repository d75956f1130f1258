//! What a monitor told over a time, in stretches that a figure has room for.

use anyhow::Result;
use rusqlite::Connection;

/// Stretches of a period, as many as a figure has room for.
pub const STRETCHES: i64 = 300;
/// Rows that a stretch is judged by, its first ones, so that a month is shown as fast as an hour: of an hour with ten readings
/// a second these are all.
pub const MOST_ROWS: usize = 120;

/// A quantity of a row: one column, or the amplitude of two.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    pub name: &'static str,
    /// One column, or cosine and sine.
    pub columns: &'static [&'static str],
}

/// A quantity in one stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Of the rows that have it.
    pub mean: f64,
    pub least: f64,
    pub most: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Its middle, µs since 1970.
    pub at_us: i64,
    /// Each quantity, none where no row has it.
    pub spreads: Vec<Option<Spread>>,
}

/// How finely a period is told.
#[derive(Debug, Clone, Copy)]
pub struct Resolution {
    /// Equal stretches of the period.
    pub stretches: i64,
    /// Rows that a stretch is judged by, its first ones.
    pub rows: usize,
}

/// Time of the `number`th newest reading, or of the oldest if there are fewer, µs since 1970; none without readings. Readings with
/// a doubtful time are left out, as in figures.
///
/// # Errors
/// If the store cannot be read.
pub fn nth_newest_us(connection: &Connection, source: i64, number: u32) -> Result<Option<i64>> {
    let sql = "SELECT min(time_us) FROM (SELECT time_us FROM reading WHERE source = ? AND clock_doubtful = 0 \
               ORDER BY time_us DESC LIMIT ?)";
    Ok(connection.query_row(sql, (source, number), |row| row.get(0))?)
}

/// The rows of a table in a period, which ends with `to_us`, as finely as a figure shows them; those whose time is doubtful are
/// left out.
///
/// # Errors
/// If the store cannot be read.
pub fn of(
    connection: &Connection,
    table_and_source: (&str, i64),
    quantities: &[Quantity],
    period_us: (i64, i64),
) -> Result<Vec<Stretch>> {
    let resolution = Resolution { stretches: STRETCHES, rows: MOST_ROWS };
    sampled(connection, table_and_source, quantities, period_us, resolution)
}

/// The same at any resolution.
///
/// # Errors
/// If the store cannot be read.
pub fn sampled(
    connection: &Connection,
    (table, source): (&str, i64),
    quantities: &[Quantity],
    (from_us, to_us): (i64, i64),
    resolution: Resolution,
) -> Result<Vec<Stretch>> {
    let Resolution { stretches, rows: most_rows } = resolution;
    let columns: Vec<&str> = quantities.iter().flat_map(|q| q.columns.iter().copied()).collect();
    let sql = format!(
        "SELECT {} FROM {table} WHERE source = ? AND time_us > ? AND time_us <= ? AND clock_doubtful = 0 \
         ORDER BY time_us LIMIT {most_rows}",
        columns.join(", ")
    );
    let mut statement = connection.prepare(&sql)?;
    let edge = |stretch: i64| from_us + (to_us - from_us) * stretch / stretches;
    let mut all = Vec::new();
    for stretch in 0..stretches {
        let (begin, end) = (edge(stretch), edge(stretch + 1));
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); quantities.len()];
        let mut rows = statement.query((source, begin, end))?;
        while let Some(row) = rows.next()? {
            let mut column = 0;
            for (quantity, values) in quantities.iter().zip(&mut values) {
                let parts = (column..column + quantity.columns.len()).map(|c| row.get::<_, Option<f64>>(c));
                let parts: Vec<Option<f64>> = parts.collect::<rusqlite::Result<_>>()?;
                column += quantity.columns.len();
                match parts[..] {
                    [Some(value)] => values.push(value),
                    [Some(cos), Some(sin)] => values.push(cos.hypot(sin)),
                    _ => {}
                }
            }
        }
        let spreads = values.iter().map(|values| spread(values)).collect();
        all.push(Stretch { at_us: begin.midpoint(end), spreads });
    }
    Ok(all)
}

fn spread(values: &[f64]) -> Option<Spread> {
    let ends = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (!values.is_empty()).then_some(Spread { mean, least: ends[0], most: ends[1] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_is_judged_by_its_rows_and_an_empty_one_by_nothing() {
        let connection = Connection::open_in_memory().unwrap();
        connection.execute_batch("CREATE TABLE told (source, time_us, clock_doubtful, a, c, s)").unwrap();
        let quantities =
            [Quantity { name: "a", columns: &["a"] }, Quantity { name: "amplitude", columns: &["c", "s"] }];
        let rows = [(1, 0, -7.0), (10, 0, 1.0), (20, 0, 3.0), (30, 1, 99.0), (300_000, 0, 5.0)];
        for (time_us, doubtful, a) in rows {
            let row = (time_us, doubtful, a);
            connection.execute("INSERT INTO told VALUES (7, ?1, ?2, ?3, 3.0, 4.0)", row).unwrap();
        }
        connection.execute("INSERT INTO told VALUES (7, 40, 0, NULL, NULL, 4.0)", []).unwrap();
        // a stretch of 1,000 µs begins after its first moment
        let all = of(&connection, ("told", 7), &quantities, (1, 300_001)).unwrap();
        assert_eq!(all.len(), 300);
        let amplitude = Some(Spread { mean: 5.0, least: 5.0, most: 5.0 });
        assert_eq!(all[0].at_us, 501);
        assert_eq!(all[0].spreads, [Some(Spread { mean: 2.0, least: 1.0, most: 3.0 }), amplitude]);
        assert_eq!(all[1].spreads, [None, None]);
        assert_eq!(all[299].spreads, [Some(Spread { mean: 5.0, least: 5.0, most: 5.0 }), amplitude]);
    }

    #[test]
    fn nth_newest_time_counts_no_doubtful_clock() {
        let connection = Connection::open_in_memory().unwrap();
        connection.execute_batch("CREATE TABLE reading (source, time_us, clock_doubtful)").unwrap();
        for row in [(7, 10, 0), (7, 5, 1), (7, 30, 0), (7, 20, 0), (8, 1, 0), (9, 4, 1)] {
            connection.execute("INSERT INTO reading VALUES (?1, ?2, ?3)", row).unwrap();
        }
        let time_us = |source, number| nth_newest_us(&connection, source, number).unwrap();
        assert_eq!([2, 3, 9].map(|number| time_us(7, number)), [Some(20), Some(10), Some(10)]);
        assert_eq!(time_us(9, 1), None);
    }
}
