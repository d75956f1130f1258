//! The two files that everything begins with, as text.

use std::path::Path;

use anyhow::{Result, bail};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;

/// A rotor as TOML and as JSON.
pub fn rotor(path: &Path) -> Result<(String, String)> {
    let rotor = rotor_file::read(path)?;
    Ok((toml::to_string(&rotor)?, serde_json::to_string(&rotor)?))
}

/// A measurement as CSV, whose rows fit the rotor if there is one.
pub fn measurement(path: &Path, rotor: Option<&Path>) -> Result<String> {
    if let Some(rotor) = rotor {
        measurement::read(path, &rotor_file::read(rotor)?)?;
    }
    let series = measurement::read_series(path, |_| Ok(()))?;
    if series.unit != "um" {
        bail!("{}: amplitudes are in {}, expected µm", path.display(), series.unit);
    }
    let mut text = Vec::new();
    measurement::write_with_conditions(&mut text, &series.probes, &series.conditions, &series.readings)?;
    Ok(String::from_utf8(text)?)
}
