//! The readings of one machine as the measurement file that the desk reads.

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge::bus::decoded::shortest;
use rotor_edge_desktop::measurement::{Reading, phasor_m, write_exactly};
use rusqlite::Row;

use crate::store::Store;

const US_A_DAY: f64 = 86_400e6;
/// Readings that a job takes: ten times what a fit does, and not more than a host has memory for.
const MOST_READINGS: usize = 200_000;
/// Of a row, in pairs of cosine and sine.
const COLUMNS: &str = "p1_cos_um, p1_sin_um, p2_cos_um, p2_sin_um, p3_cos_um, p3_sin_um, p4_cos_um, p4_sin_um, \
                       p5_cos_um, p5_sin_um, p6_cos_um, p6_sin_um, p7_cos_um, p7_sin_um, p8_cos_um, p8_sin_um";

/// A time, and how much of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Period {
    /// Its beginning, µs since 1970.
    pub from_us: i64,
    /// Its end, µs since 1970: a reading then is in it.
    pub to_us: i64,
    /// One reading in each such time, µs, and all readings for zero.
    pub every_us: i64,
}

/// From the first reading of a monitor to the last.
///
/// # Errors
/// If there is none.
pub fn whole(store: &mut Store, source: i64) -> Result<(i64, i64)> {
    let sql = "SELECT min(time_us), max(time_us) FROM reading WHERE source = ? AND clock_doubtful = 0";
    let ends = store.connection().query_row(sql, [source], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let (Some(from), Some(to)) = ends else { bail!("the machine has no reading") };
    Ok((from, to))
}

/// The readings of a period as CSV, for probes of these names; days count from its beginning. Of each stretch of
/// `every_us` it is the first reading with all probes, or the first at all. Readings whose time is doubtful are left out.
///
/// # Errors
/// One sentence if there are no readings, or some of another number of probes.
pub fn csv(store: &mut Store, source: i64, period: Period, probes: &[String]) -> Result<Vec<u8>> {
    let sql = format!(
        "SELECT time_us, speed_rpm, probes, {COLUMNS} FROM reading \
         WHERE source = ? AND time_us BETWEEN ? AND ? AND clock_doubtful = 0 ORDER BY time_us, epoch, sequence"
    );
    let mut statement = store.connection().prepare(&sql)?;
    let mut rows = statement.query((source, period.from_us, period.to_us))?;
    let mut readings: Vec<(i64, Reading)> = Vec::new();
    while let Some(row) = rows.next()? {
        let (time_us, number) = (row.get::<_, i64>(0)?, row.get::<_, u32>(2)? as usize);
        if number != probes.len() {
            bail!("a reading of {number} probes, but the drawing has {}", probes.len());
        }
        let Some(reading) = reading(row, number, period.from_us)? else { continue };
        let stretch =
            if period.every_us > 0 { (time_us - period.from_us) / period.every_us } else { time_us };
        let is_full = readings.len() == MOST_READINGS;
        match readings.last_mut() {
            Some((last, kept)) if period.every_us > 0 && *last == stretch => {
                if kept.complete().is_none() && reading.complete().is_some() {
                    *kept = reading;
                }
            }
            _ if is_full => {
                bail!("more than {MOST_READINGS} readings in this period; shorten it with --from and --to")
            }
            _ => readings.push((stretch, reading)),
        }
    }
    if readings.is_empty() {
        bail!("no reading in this period");
    }
    let readings: Vec<Reading> = readings.into_iter().map(|(_, reading)| reading).collect();
    let mut csv = Vec::new();
    write_exactly(&mut csv, probes, &readings)?;
    Ok(csv)
}

/// A row, unless its speed was lost.
fn reading(row: &Row, probes: usize, from_us: i64) -> Result<Option<Reading>> {
    let number = |column: usize| row.get::<_, Option<f64>>(column).map(|v| v.map(|v| shortest(v as f32)));
    let Some(speed_rpm) = number(1)? else { return Ok(None) };
    let mut phasors: Vec<Option<Complex<f64>>> = Vec::with_capacity(probes);
    for probe in 0..probes {
        let parts = number(3 + 2 * probe)?.zip(number(4 + 2 * probe)?);
        phasors.push(parts.map(|(cos_um, sin_um)| phasor_m(cos_um, sin_um)));
    }
    let time_d = (row.get::<_, i64>(0)? - from_us) as f64 / US_A_DAY;
    Ok(Some(Reading {
        row: None,
        run: None,
        session: None,
        time_d: Some(time_d),
        speed_rpm,
        probes: phasors,
        gaps_v: Vec::new(),
        conditions: Vec::new(),
    }))
}
