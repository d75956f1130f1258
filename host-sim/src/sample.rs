//! A three-stage turbine at 11,000 rpm: 460 days of 1x vibration and two run-ups.
//!
//! On day 125 a labyrinth ring was replaced: bearing 16 changed and a seal began to act at disk 3.

use rotor_edge_desktop::Error;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

/// The drawing, with guessed bearings.
pub const ROTOR: &str = include_str!("../sample/turbine/rotor.toml");
/// One reading a day.
pub const RECORD: &str = include_str!("../sample/turbine/record.csv");
/// The run-up when the machine was commissioned.
pub const RUNUP_DAY_0: &str = include_str!("../sample/turbine/runup-day000.csv");

/// The run-up on the day after the event.
pub const RUNUP_DAY_126: &str = include_str!("../sample/turbine/runup-day126.csv");

/// Rotor, record and commissioning run-up.
///
/// # Errors
/// None, as long as the embedded files pass their own checks.
pub fn load() -> Result<(Rotor, Vec<Reading>, Vec<Reading>), Error> {
    let rotor = rotor_file::parse("sample rotor.toml", ROTOR)?;
    let record = measurement::parse("sample record.csv", RECORD, &rotor)?;
    let runup = measurement::parse("sample runup-day000.csv", RUNUP_DAY_0, &rotor)?;
    Ok((rotor, record, runup))
}
