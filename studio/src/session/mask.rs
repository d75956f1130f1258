//! Readings that are left out of fits, to be predicted by them.

use anyhow::{Result, bail};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;
use serde::{Deserialize, Serialize};

/// What is left out; nothing by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Mask {
    /// Names of runs; the run without a name is the empty text.
    pub runs: Vec<String>,
    pub probes: Vec<String>,
    /// Slowest and fastest speed of a range, rpm.
    pub speeds_rpm: Option<[f64; 2]>,
}

impl Mask {
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    fn leaves_out(&self, reading: &Reading) -> bool {
        let run = reading.run.as_deref().unwrap_or_default();
        let in_range = |[low, high]: [f64; 2]| (low..=high).contains(&reading.speed_rpm);
        self.runs.iter().any(|name| name == run) || self.speeds_rpm.is_some_and(in_range)
    }

    /// The machine with the probes of `given` that are not left out.
    ///
    /// # Errors
    /// If a probe is unknown, or none is left.
    pub fn rotor(&self, rotor: &Rotor, given: &Rotor) -> Result<Rotor> {
        let all = with_probes_of(rotor, given)?;
        if self.probes.is_empty() {
            return Ok(all);
        }
        if self.probes.len() >= given.probe.len() {
            bail!("every probe is left out, expected at least one that is kept");
        }
        Ok(all.without_probes(&self.probes)?)
    }

    /// The readings that fits use; `given` has the probes of `readings`.
    ///
    /// # Errors
    /// If none is left.
    pub fn readings(&self, given: &Rotor, readings: &[Reading]) -> Result<Vec<Reading>> {
        let kept: Vec<bool> = given.probe.iter().map(|p| !self.probes.contains(&p.name)).collect();
        let of_probes = |r: &Reading| Reading {
            probes: chosen(&r.probes, &kept),
            gaps_v: chosen(&r.gaps_v, &kept),
            ..r.clone()
        };
        let left: Vec<Reading> = readings.iter().filter(|r| !self.leaves_out(r)).map(of_probes).collect();
        if left.is_empty() {
            bail!("every reading is left out, expected some to fit the model to");
        }
        Ok(left)
    }

    /// Readings with those values alone that are left out.
    pub fn left_out(&self, given: &Rotor, readings: &[Reading]) -> Vec<Reading> {
        let values = |r: &Reading| {
            let whole = self.leaves_out(r);
            let value = |(probe, y): (usize, &Option<_>)| {
                y.filter(|_| whole || self.probes.contains(&given.probe[probe].name))
            };
            Reading { probes: r.probes.iter().enumerate().map(value).collect(), ..r.clone() }
        };
        readings.iter().map(values).filter(|r| r.probes.iter().any(Option::is_some)).collect()
    }
}

/// Those that are kept; of a list that is empty, none.
fn chosen<T: Clone>(all: &[T], kept: &[bool]) -> Vec<T> {
    all.iter().zip(kept).filter(|(_, kept)| **kept).map(|(one, _)| one.clone()).collect()
}

/// A machine with the probes in use that another state of it has in use.
///
/// # Errors
/// If it is no machine that a file can have.
pub fn with_probes_of(rotor: &Rotor, given: &Rotor) -> Result<Rotor> {
    if rotor.probe.iter().map(|p| &p.name).eq(given.probe.iter().map(|p| &p.name)) {
        return Ok(rotor.clone());
    }
    let mut whole = rotor.whole();
    for probe in &mut whole.probe {
        probe.used = given.probe.iter().any(|p| p.name == probe.name);
    }
    Ok(rotor_file::parse("the model", &rotor_file::text("the model", &whole)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::files::InputFiles;

    #[test]
    fn kept_and_left_out_values_are_all_values() {
        let (rotor, readings) = InputFiles::sample().parsed().unwrap();
        let mask = Mask { probes: vec!["15Y".into()], speeds_rpm: Some([3000.0, 5000.0]), ..Mask::default() };
        let count = |all: &[Reading]| all.iter().flat_map(|r| &r.probes).flatten().count();
        let kept = mask.readings(&rotor, &readings).unwrap();
        assert_eq!(count(&kept) + count(&mask.left_out(&rotor, &readings)), count(&readings));
        let without = mask.rotor(&rotor, &rotor).unwrap();
        assert!(kept.iter().all(|r| r.probes.len() == without.probe.len()));
        assert_eq!(Mask::default().rotor(&without, &rotor).unwrap().probe, rotor.probe);
    }

    #[test]
    fn nothing_left_to_fit_is_refused() {
        let (rotor, readings) = InputFiles::sample().parsed().unwrap();
        let all = Mask { speeds_rpm: Some([0.0, 1e6]), ..Mask::default() };
        assert!(all.readings(&rotor, &readings).is_err());
        let probes = rotor.probe.iter().map(|p| p.name.clone()).collect();
        assert!(Mask { probes, ..Mask::default() }.rotor(&rotor, &rotor).is_err());
    }
}
