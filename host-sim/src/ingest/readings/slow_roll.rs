//! The runout of the probes, as an export shows it: in a row of the first file, a run, or another file.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge_desktop::measurement::{Reading, less_runout};

use super::gathered;
use super::mapping::Mapping;
use super::record::Record;

/// Takes it off all other readings, and leaves its own out; the runout, µm.
///
/// # Errors
/// One sentence if it is neither a run of the files nor a file nor a row, or turns too fast.
pub fn take_off(
    record: &mut Record,
    slow_roll: &str,
    files: &[PathBuf],
    of_rotor: Option<&[String]>,
    mapping: &Mapping,
) -> Result<Vec<Complex<f64>>> {
    let place = files[0].display().to_string();
    let path = Path::new(slow_roll);
    let rolls = if path.is_file() {
        let alone = gathered(&[path.to_path_buf()], of_rotor, &of_another_file(mapping))?.record;
        aligned(&alone, record, slow_roll)?
    } else {
        let is_run = record.runs.iter().any(|run| run == slow_roll);
        let row = slow_roll.parse::<u32>().ok().filter(|_| !is_run);
        let slow = |k: &usize| {
            let sample = &record.samples[*k];
            row.map_or(record.run(*k) == Some(slow_roll), |row| sample.table == 0 && sample.row == row)
        };
        let (rolls, rest): (Vec<usize>, Vec<usize>) = (0..record.samples.len()).partition(slow);
        let rolls = rolls.into_iter().map(|k| record.reading(k, None)).collect();
        record.keep(&rest);
        rolls
    };
    if rolls.is_empty() {
        bail!("{place}: --slow-roll \"{slow_roll}\" is neither a run, nor a row with a reading, nor a file");
    }
    let mut rest: Vec<Reading> = (0..record.samples.len()).map(|k| record.reading(k, None)).collect();
    let probes: Vec<&str> = record.probes.iter().map(String::as_str).collect();
    let runout_m = less_runout(&place, &probes, &rolls, &mut rest)?;
    for (k, less) in rest.into_iter().enumerate() {
        for (p, y) in less.probes.into_iter().enumerate() {
            record.set(k, p, y.map(|y| y * 1e6));
        }
    }
    Ok(runout_m.into_iter().map(|y| y * 1e6).collect())
}

/// The same conventions, without what is of the measured files alone.
fn of_another_file(mapping: &Mapping) -> Mapping {
    Mapping {
        phase_shift: Vec::new(),
        slow_roll: None,
        runs_from_files: false,
        keep_stale: true,
        ..mapping.clone()
    }
}

/// Readings of another file with the probes in the order of the record.
fn aligned(other: &Record, record: &Record, file: &str) -> Result<Vec<Reading>> {
    let mut order = Vec::new();
    for name in &record.probes {
        match other.probes.iter().position(|p| p == name) {
            Some(at) => order.push(at),
            None => bail!("{file}: slow roll: there is no reading of probe {name}, so its runout is unknown"),
        }
    }
    let reading = |k: usize| {
        let reading = other.reading(k, None);
        Reading { probes: order.iter().map(|at| reading.probes[*at]).collect(), ..reading }
    };
    Ok((0..other.samples.len()).map(reading).collect())
}
