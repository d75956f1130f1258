//! What is wrong with readings that no single one shows: values that went stale, values far from those before and
//! after, a phase reference that was moved.

use anyhow::{Result, anyhow, bail};
use nalgebra::Complex;
use rayon::prelude::*;
use rotor_edge_desktop::measurement::frozen;

use super::record::Record;
use crate::ingest::calendar::{self, DateOrder, Moment, ParsedMoment};

/// Readings are neighbours if their speeds differ by no more than this, relative: a resonance is no outlier.
const STEADY: f64 = 0.005;
/// An outlier is so many times the usual step from its neighbours, which are no further apart than half of that,
const UNUSUAL: f64 = 20.0;
/// and further than this part of what they read.
const FAR: f64 = 0.9;

/// Readings of single probes that were marked as lost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MarkedValues {
    pub stale: usize,
    pub outliers: usize,
}

/// Marks values as lost that are one and the same four times in a row or more, but for the first of them.
pub fn mark_stale(record: &mut Record) -> usize {
    mark(record, |record, p| {
        let values: Vec<Option<Complex<f64>>> =
            (0..record.samples.len()).map(|k| record.value(k, p)).collect();
        let (mut marked, mut from) = (Vec::new(), 0);
        while let Some(stretch) = frozen(&values[from..]) {
            marked.extend(from + stretch.start + 1..from + stretch.end);
            from += stretch.end;
        }
        marked
    })
}

/// Marks readings of each probe as lost, and counts them.
fn mark(record: &mut Record, of_probe: fn(&Record, usize) -> Vec<usize>) -> usize {
    let all: Vec<Vec<usize>> =
        (0..record.probes.len()).into_par_iter().map(|p| of_probe(record, p)).collect();
    for (p, marked) in all.iter().enumerate() {
        marked.iter().for_each(|k| record.set(*k, p, None));
    }
    all.iter().map(Vec::len).sum()
}

/// Marks a value as lost that is far from the one before and the one after, at one speed, which are near each other:
/// a spike, or a phase that was averaged over the step from 360 to 0 degrees.
pub fn mark_outliers(record: &mut Record) -> usize {
    mark(record, outliers)
}

fn outliers(record: &Record, p: usize) -> Vec<usize> {
    let steady = |a: usize, b: usize| {
        let [a, b] = [&record.samples[a], &record.samples[b]];
        a.run == b.run && (a.speed_rpm / b.speed_rpm - 1.0).abs() <= STEADY
    };
    let seen: Vec<usize> = (0..record.samples.len()).filter(|k| record.value(*k, p).is_some()).collect();
    let value = |k: usize| record.value(k, p).unwrap_or_default();
    // squares are in the same order
    let mut steps: Vec<f64> = seen
        .windows(2)
        .filter(|w| steady(w[0], w[1]))
        .map(|w| (value(w[1]) - value(w[0])).norm_sqr())
        .collect();
    if steps.is_empty() {
        return Vec::new();
    }
    let middle = steps.len() / 2;
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let is_far = |w: &&[usize]| {
        let (before, now, after) = (value(w[0]), value(w[1]), value(w[2]));
        let least = (UNUSUAL * UNUSUAL * usual).max(FAR * FAR * before.norm_sqr().max(after.norm_sqr()));
        let away = (now - before).norm_sqr().min((now - after).norm_sqr());
        away > least && 4.0 * (after - before).norm_sqr() < least && steady(w[0], w[1]) && steady(w[1], w[2])
    };
    seen.windows(3).filter(is_far).map(|w| w[1]).collect()
}

/// A day on which the phase reference was moved, and by how much phase lags grew with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseShift {
    from: Moment,
    lag_rad: f64,
}

impl PhaseShift {
    /// From `DATE=DEGREES`, or `DAYS=DEGREES` where a record has no calendar.
    ///
    /// # Errors
    /// One sentence with the text.
    pub fn parse(text: &str, order: Option<DateOrder>) -> Result<Self> {
        let wrong = || {
            anyhow!(
                "--phase-shift {text}: expected DATE=DEGREES, such as 2024-03-05=40 or 2024-03-05T12:00Z=-15"
            )
        };
        let (date, degrees) = text.rsplit_once('=').ok_or_else(wrong)?;
        let degrees: f64 = degrees.trim().parse().ok().filter(|d: &f64| d.is_finite()).ok_or_else(wrong)?;
        let from = match (date.trim().parse::<f64>(), calendar::of_text(date.trim(), order)) {
            (_, ParsedMoment::Moment(moment)) => moment,
            (Ok(days), _) => Moment::Elapsed(days),
            (_, ParsedMoment::Ambiguous) => {
                bail!(
                    "--phase-shift {text}: the day or the month may come first, expected a date such as 2024-03-05"
                )
            }
            (_, ParsedMoment::Nothing) => return Err(wrong()),
        };
        Ok(Self { from, lag_rad: degrees.to_radians() })
    }

    /// Turns what came after it back to the reference before.
    ///
    /// # Errors
    /// If the record's times and this date are not of one kind.
    pub fn take_off(&self, record: &mut Record) -> Result<usize> {
        let mut turned = 0;
        for k in 0..record.samples.len() {
            let Some(when) = record.samples[k].when else {
                bail!("--phase-shift: the readings have no time, expected a column of times")
            };
            let after = match (when, self.from) {
                // a date without a zone is one of the record's own zone
                (Moment::Zoned(a), Moment::Local(b)) | (Moment::Local(a), Moment::Zoned(b)) => a >= b,
                (a, b) if a.days_since(b).is_none() => {
                    bail!(
                        "--phase-shift: the times are days without a calendar and the date is of one, or the other way, expected \
                         both of one kind"
                    )
                }
                (Moment::Elapsed(a), Moment::Elapsed(b)) => a >= b,
                (a, b) => a.days_since(b).is_some_and(|days| days >= 0.0),
            };
            if after {
                let back = Complex::from_polar(1.0, self.lag_rad);
                for p in 0..record.probes.len() {
                    record.set(k, p, record.value(k, p).map(|y| y * back));
                }
                turned += 1;
            }
        }
        Ok(turned)
    }
}
