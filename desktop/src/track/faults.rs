//! Checks of a record before tracking; an error names the row.

use nalgebra::Complex;

use super::record::time_d;
use crate::diagnose::checks;
use crate::error::{Error, TrackError};
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;
use crate::measurement::sequence::{frozen, moved_reference};
use crate::units::same_speed;

/// Fewest complete readings: phase I takes three, an event needs readings before and after it.
pub const FEWEST: usize = 10;
/// Gaps longer than this get a remark, days.
pub const LONG_GAP_D: f64 = 14.0;
/// Effects whose supports depend on how far the shaft moves.
const NONLINEAR: [&str; 2] = ["nonlinear_stiffness", "rub"];
/// Readings further apart than this, days, are not compared, as bearings change.
const FAR_D: f64 = 3.0;

/// Checks times, frozen values and the phase reference of a record; `file` is for messages. Rows are those of the file that
/// the readings were read from, or of one that has a header and then every reading.
///
/// # Errors
/// The first fault that is found, in one sentence that names the row and what to do about it.
pub fn check(file: &str, rotor: &Rotor, record: &[Reading]) -> Result<(), Error> {
    let day = |index: usize| time_d(index, &record[index]);
    let row = |index: usize| record[index].row.unwrap_or(index + 2);
    let fault =
        |index: usize, what: String| Err(Error::measurement(file, format!("row {}", row(index)), what));
    for next in 1..record.len() {
        let (from, to) = (day(next - 1), day(next));
        if to < from {
            return fault(next, format!("time_d goes back from {from} to {to}, expected ascending days"));
        }
        if to == from {
            let what =
                format!("day {to} is there twice, expected one reading at a time; leave one of them out");
            return fault(next, what);
        }
    }
    for (p, probe) in rotor.probe.iter().enumerate() {
        let values: Vec<_> = record.iter().map(|r| r.probes[p]).collect();
        // a probe that never shows anything else is stuck, which is told by name elsewhere
        if let Some(stretch) =
            frozen(&values).filter(|stretch| stretch.len() < values.iter().flatten().count())
        {
            let (from, to) = (stretch.start, stretch.end - 1);
            let what = format!(
                "the values of probe {} are the same to the last digit until row {} (day {} to {}): they froze, \
                 leave them empty",
                probe.name,
                row(to),
                day(from),
                day(to)
            );
            return fault(from, what);
        }
    }
    let whole = |(index, r): (usize, &Reading)| Some((index, r.speed_rpm, r.complete()?));
    let complete: Vec<(usize, f64, Vec<Complex<f64>>)> =
        record.iter().enumerate().filter_map(whole).collect();
    let steady = |a: &(usize, f64, Vec<_>), b: &(usize, f64, Vec<_>)| {
        same_speed(a.1, b.1) && day(b.0) - day(a.0) <= FAR_D
    };
    for stretch in complete.chunk_by(steady) {
        let phasors: Vec<&[Complex<f64>]> = stretch.iter().map(|(_, _, y)| y.as_slice()).collect();
        if let Some((at, angle_deg)) = moved_reference(&phasors) {
            let index = stretch[at].0;
            let what = format!(
                "from day {} on all probes are turned by {angle_deg:.0}° while their amplitudes stay: the keyphasor was \
                 moved; correct the angles from that day on, or follow both parts separately",
                day(index)
            );
            return fault(index, what);
        }
    }
    Ok(())
}

/// Remarks on a record that can be tracked.
///
/// # Errors
/// If there are too few readings, a probe is stuck or clipped, or [`check`] finds a fault.
pub fn remarks(rotor: &Rotor, record: &[Reading]) -> Result<Vec<String>, Error> {
    let complete = record.iter().filter(|r| r.complete().is_some()).count();
    if complete < FEWEST {
        return Err(TrackError::TooFewReadings { complete, needed: FEWEST }.into());
    }
    if let Some(nonlinear) = rotor.effect.iter().find(|e| NONLINEAR.contains(&e.kind.as_str())) {
        return Err(TrackError::NonlinearEffect { effect: nonlinear.kind.clone() }.into());
    }
    let mut remarks = checks::before(rotor, record)?;
    check("the record", rotor, record)?;
    if complete < record.len() {
        remarks.push(format!("{} of {} readings lost a probe.", record.len() - complete, record.len()));
    }
    for (row, pair) in record.windows(2).enumerate() {
        let (from, to) = (time_d(row, &pair[0]), time_d(row + 1, &pair[1]));
        if to - from > LONG_GAP_D {
            remarks.push(format!(
                "No reading from day {from:.0} to day {to:.0}: what changed in between is seen as one step."
            ));
        }
    }
    Ok(remarks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    /// Forty days of four probes that are never the same twice.
    fn record() -> Vec<Reading> {
        let reading = |day: u32| {
            let wave = f64::from(day * day % 17) * 1e-2;
            let pair = [Complex::new(20.0 + wave, 3.0), Complex::new(-5.0, 14.0 - wave)];
            let probes = [pair, pair.map(|y| y * 1.5)].concat();
            Reading {
                time_d: Some(f64::from(day)),
                speed_rpm: 9000.0 + f64::from(day % 5),
                probes: probes.iter().map(|y| Some(y * 1e-6)).collect(),
                ..Reading::default()
            }
        };
        (0..40).map(reading).collect()
    }

    fn refusal(change: impl Fn(&mut Vec<Reading>)) -> String {
        let mut changed = record();
        change(&mut changed);
        check("r.csv", &sample_rotor(), &changed).unwrap_err().to_string()
    }

    #[test]
    fn sound_record_passes_and_each_fault_names_its_row() {
        assert_eq!(check("r.csv", &sample_rotor(), &record()), Ok(()));
        let back = refusal(|r| r[7].time_d = Some(3.0));
        assert_eq!(back, "r.csv: row 9: time_d goes back from 6 to 3, expected ascending days");
        let twice = refusal(|r| r[7].time_d = Some(6.0));
        assert!(twice.starts_with("r.csv: row 9: day 6 is there twice"), "{twice}");
        let froze = refusal(|r| {
            let stuck = r[10].probes[1];
            r[10..15].iter_mut().for_each(|reading| reading.probes[1] = stuck);
        });
        assert!(
            froze.contains("row 12: the values of probe AY are") && froze.contains("until row 16"),
            "{froze}"
        );
        let moved = refusal(|r| {
            let turn = Complex::from_polar(1.0, 0.5);
            r[20..].iter_mut().flat_map(|r| r.probes.iter_mut().flatten()).for_each(|y| *y *= turn);
        });
        assert!(moved.contains("row 22: from day 20 on all probes are turned by 29°"), "{moved}");
        assert!(moved.contains("keyphasor"), "{moved}");
    }

    #[test]
    fn speed_change_is_no_moved_phase_reference() {
        let mut record = record();
        let turn = Complex::from_polar(1.0, 0.5);
        for reading in &mut record[20..] {
            reading.speed_rpm = 6000.0;
            reading.probes.iter_mut().flatten().for_each(|y| *y *= turn);
        }
        assert_eq!(check("r.csv", &sample_rotor(), &record), Ok(()));
    }
}
