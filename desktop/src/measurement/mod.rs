//! Measured 1x vibration: the contents of `measured.csv`.
//!
//! Columns `run` (optional), `session` (optional), `time_d` (optional), `speed_rpm`, then `<probe>_cos_um` and
//! `<probe>_sin_um` for every probe: zero-to-peak, `u(t) = cos · cos Ωt + sin · sin Ωt`, t = 0 at the
//! keyphasor mark; and `<probe>_gap_v` (optional), the probe's mean voltage. Conditions of operation are columns whose names end with
//! their units ([`ConditionUnit`]). An empty cell is a lost reading of that probe or condition; a row
//! with neither a speed nor a probe is passed over.
//! Lines before the header that begin with `#` are comments.

mod condition;
mod noise;
mod reading;
mod record;
mod rules;
mod runs;
pub(crate) mod sequence;
mod slow_roll;
mod table;
mod writing;

use crate::units::rad_s;
use std::path::Path;

use crate::bearing::Law;
use crate::error::Error;
use crate::machine::drawing::Rotor;

pub(crate) use condition::values;
pub use condition::{Condition, ConditionUnit};
pub(crate) use noise::component_sd;
pub(crate) use reading::by_reading;
pub use reading::{Reading, phasor_m};

pub use record::{Record, read_dated, read_record};
pub use rules::DayOfDate;
use rules::RowRules;
pub use runs::SortedRun;
pub(crate) use runs::run_shares;
pub use sequence::frozen;
pub(crate) use slow_roll::SLOW_ROLL_SHARE;
pub use slow_roll::{SlowRoll, less_runout, runout_m};
pub use table::{LARGEST_UM, LOWEST_GAP_V, ProbeRecord};
use table::{UnlistedRuns, rows};
pub(crate) use table::{ragged, text_of};
pub use writing::{ReadingColumns, ReadingLines, write, write_exactly, write_probes, write_with_conditions};

/// Reads a measurement of this rotor, less the slow roll that its file states.
///
/// # Errors
/// One sentence with the file, the row or column and what was expected.
pub fn read(path: &Path, rotor: &Rotor) -> Result<Vec<Reading>, Error> {
    read_less(path, rotor, &SlowRoll::Stated)
}

/// Reads a measurement of this rotor, less a slow roll.
///
/// # Errors
/// As [`read`], and if the slow roll is not there.
pub fn read_less(path: &Path, rotor: &Rotor, slow_roll: &SlowRoll) -> Result<Vec<Reading>, Error> {
    let (file, text) = text_of(path)?;
    parse_less(&file, &text, rotor, slow_roll, UnlistedRuns::Refused, &RowRules::STRICT)
}

/// The same where runs that the rotor's file does not list are blind: what was added in them is sought.
///
/// # Errors
/// As [`read_less`].
pub fn read_with_blind_runs(path: &Path, rotor: &Rotor, slow_roll: &SlowRoll) -> Result<Vec<Reading>, Error> {
    let (file, text) = text_of(path)?;
    parse_less(&file, &text, rotor, slow_roll, UnlistedRuns::Blind, &RowRules::STRICT)
}

/// Reads a measurement of a machine that has no file: probes, and the one unit of all of them, are what the columns say.
/// `known` says why a run cannot be used.
///
/// # Errors
/// As [`read`].
pub fn read_series(path: &Path, known: impl Fn(&str) -> Result<(), String>) -> Result<ProbeRecord, Error> {
    let (file, text) = text_of(path)?;
    table::series(&file, &text, known)
}

/// Parses the text of a measurement file; `file` is only for messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str, rotor: &Rotor) -> Result<Vec<Reading>, Error> {
    parse_less(file, text, rotor, &SlowRoll::Stated, UnlistedRuns::Refused, &RowRules::STRICT)
}

/// Parses the text of a measurement file, less a slow roll; `file` is only for messages.
///
/// # Errors
/// As [`read_less`].
pub fn parse_with_slow_roll(
    file: &str,
    text: &str,
    rotor: &Rotor,
    slow_roll: &SlowRoll,
) -> Result<Vec<Reading>, Error> {
    parse_less(file, text, rotor, slow_roll, UnlistedRuns::Refused, &RowRules::STRICT)
}

fn parse_less(
    file: &str,
    text: &str,
    rotor: &Rotor,
    slow_roll: &SlowRoll,
    unlisted: UnlistedRuns,
    rules: &RowRules,
) -> Result<Vec<Reading>, Error> {
    let rows = rows(file, text, rotor, slow_roll.run(), unlisted, rules)?;
    let readings = slow_roll.taken_off(file, rows.readings, rotor)?;
    within_films(file, &readings, rotor)?;
    Ok(readings)
}

/// Every film must be solved for the slowest and the fastest reading, and so for all between.
fn within_films(file: &str, readings: &[Reading], rotor: &Rotor) -> Result<(), Error> {
    let speeds = || readings.iter().map(|r| r.speed_rpm);
    let ends = [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)];
    match beyond_films(rotor, ends) {
        Some(what) => Err(Error::measurement(file, "column speed_rpm", what)),
        None => Ok(()),
    }
}

/// The first film that is not solved for one of these speeds, rpm, and why.
pub(crate) fn beyond_films(rotor: &Rotor, speeds_rpm: [f64; 2]) -> Option<String> {
    let films = rotor.bearing.iter().filter_map(|b| match &b.law {
        Law::Film(film) => Some((b, film.curve())),
        _ => None,
    });
    films.into_iter().find_map(|(b, curve)| {
        let refused = |rpm: &f64| Some((*rpm, curve.state(rad_s(*rpm)).err()?));
        let (speed_rpm, why) = speeds_rpm.iter().find_map(refused)?;
        Some(format!("at {speed_rpm} rpm, bearing \"{}\": {why}", b.name))
    })
}
