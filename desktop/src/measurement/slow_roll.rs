//! Runout of the probes, as a slow roll shows it: what they read of a shaft that turns too slowly to vibrate.

use std::path::{Path, PathBuf};

use nalgebra::Complex;

use super::reading::Reading;
use super::rules::RowRules;
use super::table::{UnlistedRuns, rows, text_of};
use crate::error::Error;
use crate::machine::drawing::Rotor;

/// Speed of a slow roll over that of the machine: the force of an unbalance is a hundredth there.
pub(crate) const SLOW_ROLL_SHARE: f64 = 0.1;

/// What is taken off every reading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum SlowRoll {
    /// The mean of the runs that the rotor's file calls slow rolls, if it does.
    #[default]
    Stated,
    /// The mean of one run of the data.
    Run(String),
    /// The mean of another file.
    File(PathBuf),
    /// The same of the text of a file; `name` is only for messages.
    Text { name: String, text: String },
}

impl SlowRoll {
    /// A file if there is one of that name, else a run of the data.
    pub fn named(text: &str) -> Self {
        let path = Path::new(text);
        if path.is_file() { Self::File(path.into()) } else { Self::Run(text.into()) }
    }

    /// The run that it names.
    pub(super) fn run(&self) -> Option<&str> {
        match self {
            Self::Run(name) => Some(name),
            Self::Stated | Self::File(_) | Self::Text { .. } => None,
        }
    }

    /// Leaves slow rolls out of the readings of a file, and takes the runout off what remains.
    pub(crate) fn taken_off(
        &self,
        file: &str,
        readings: Vec<Reading>,
        rotor: &Rotor,
    ) -> Result<Vec<Reading>, Error> {
        let wrong = |what: String| Error::measurement(file, "slow roll", what);
        let stated = |name: &String| rotor.run.iter().any(|run| run.slow_roll && run.name == *name);
        let named = |name: &String| self.run() == Some(name);
        let slow = |r: &Reading| r.run.as_ref().is_some_and(|name| stated(name) || named(name));
        let (mut rolls, mut rest): (Vec<Reading>, Vec<Reading>) = readings.into_iter().partition(slow);
        match self {
            Self::Stated if rolls.is_empty() => return Ok(rest),
            Self::Stated => (),
            Self::Run(name) => rolls.retain(|r| r.run.as_ref() == Some(name)),
            Self::File(path) => {
                let (file, text) = text_of(path)?;
                rolls = readings_of(&file, &text, rotor)?;
            }
            Self::Text { name, text } => rolls = readings_of(name, text, rotor)?,
        }
        if let (Self::Run(name), true) = (self, rolls.is_empty()) {
            return Err(wrong(format!("\"{name}\" is neither a run of this file nor a file")));
        }
        less_runout(file, &names(rotor), &rolls, &mut rest)?;
        Ok(rest)
    }
}

fn names(rotor: &Rotor) -> Vec<&str> {
    rotor.probe.iter().map(|p| p.name.as_str()).collect()
}

/// Takes the mean of slow rolls off all other readings; the runout of each probe, m. `file` is only for messages.
///
/// # Errors
/// If there is nothing else, the slow rolls turn too fast to show nothing but runout, or a probe has no reading in them.
pub fn less_runout(
    file: &str,
    probes: &[&str],
    rolls: &[Reading],
    rest: &mut [Reading],
) -> Result<Vec<Complex<f64>>, Error> {
    let wrong = |what: String| Error::measurement(file, "slow roll", what);
    let fastest_rpm = |all: &[Reading]| all.iter().map(|r| r.speed_rpm).fold(0.0, f64::max);
    if rest.is_empty() {
        return Err(wrong("the data hold slow rolls alone, expected a run beside them".into()));
    }
    // at half the speed a quarter of the unbalance's force is still there
    if fastest_rpm(rolls) > fastest_rpm(rest) / 2.0 {
        let what = "expected no more than half the fastest speed, where a probe shows runout alone";
        return Err(wrong(format!("{} rpm of {}: {what}", fastest_rpm(rolls), fastest_rpm(rest))));
    }
    let runout_m = mean_m(file, rolls, probes)?;
    for reading in rest {
        let shown = reading.probes.iter_mut().zip(&runout_m);
        shown.filter_map(|(y, v)| Some((y.as_mut()?, v))).for_each(|(y, v)| *y -= v);
    }
    Ok(runout_m)
}

/// Runout of every probe in a file that holds nothing but slow roll, m.
///
/// # Errors
/// As [`super::read`], and if a probe has no reading.
pub fn runout_m(path: &Path, rotor: &Rotor) -> Result<Vec<Complex<f64>>, Error> {
    let (file, text) = text_of(path)?;
    mean_m(&file, &readings_of(&file, &text, rotor)?, &names(rotor))
}

/// Readings of a file that holds nothing but slow roll.
fn readings_of(file: &str, text: &str, rotor: &Rotor) -> Result<Vec<Reading>, Error> {
    Ok(rows(file, text, rotor, None, UnlistedRuns::Refused, &RowRules::STRICT)?.readings)
}

fn mean_m(file: &str, rolls: &[Reading], probes: &[&str]) -> Result<Vec<Complex<f64>>, Error> {
    let of = |(i, name): (usize, &str)| {
        let seen: Vec<Complex<f64>> = rolls.iter().filter_map(|r| r.probes[i]).collect();
        if seen.is_empty() {
            let what = format!("there is no reading of probe {name}, so its runout is unknown");
            return Err(Error::measurement(file, "slow roll", what));
        }
        Ok(seen.iter().sum::<Complex<f64>>() / seen.len() as f64)
    };
    probes.iter().copied().enumerate().map(of).collect()
}
