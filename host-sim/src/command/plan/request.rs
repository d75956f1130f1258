//! Speeds, runs and unbalances of a plan on the command line.

use std::path::Path;

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{Rotor, Run};
use rotor_edge_desktop::plan::runs_of;
use rotor_edge_desktop::unbalance::phasor_kg_m;

use crate::command::notation::{TrialWeight, sized, weights_of_table};

/// Readings of a run at most: more than that say nothing new and take minutes.
const MOST: usize = 2000;

/// A range of speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speeds {
    range_rpm: [f64; 2],
    count: usize,
}

impl Speeds {
    /// Evenly over the range.
    pub fn all_rpm(&self) -> Vec<f64> {
        let [from, to] = self.range_rpm;
        let share = |k: usize| k as f64 / (self.count - 1).max(1) as f64;
        (0..self.count).map(|k| from + (to - from) * share(k)).collect()
    }
}

/// `A..B:N`, or a single speed `A` or `A:N`.
pub fn speeds(text: &str) -> Result<Speeds, String> {
    let wrong = || {
        format!(
            "\"{text}\" is no range of speeds with a number of readings, 1 to {MOST}; expected for example 1000..6000:51"
        )
    };
    let (range, count) = text.split_once(':').map_or((text, None), |(range, count)| (range, Some(count)));
    let (from, to) = range.split_once("..").unwrap_or((range, range));
    let count = match count {
        Some(count) => count.parse::<usize>().map_err(|_| wrong())?,
        None if from == to => 1,
        None => return Err(wrong()),
    };
    match (from.parse::<f64>(), to.parse::<f64>()) {
        (Ok(from), Ok(to)) if 0.0 < from && from <= to && to.is_finite() && (1..=MOST).contains(&count) => {
            Ok(Speeds { range_rpm: [from, to], count })
        }
        _ => Err(wrong()),
    }
}

/// `[PLANE=]X[@DEG]`, g·mm and degrees.
pub fn unbalance(text: &str) -> Result<(Option<String>, f64, f64), String> {
    let (plane, size) = match text.rsplit_once('=') {
        Some((plane, size)) => (Some(plane.trim().to_string()), size.trim()),
        None => (None, text.trim()),
    };
    let found = sized(size).filter(|(magnitude, _)| *magnitude >= 0.0);
    found.map(|(magnitude, angle)| (plane, magnitude, angle)).ok_or_else(|| {
        format!(
            "\"{text}\" is no unbalance in g·mm with an angle in degrees; expected for example 300, 300@45 or A=300@45"
        )
    })
}

/// The unbalance of each plane, kg·m; `None` where none is stated.
///
/// # Errors
/// If a plane is unknown, or has none.
pub fn by_plane(stated: &[(Option<String>, f64, f64)], rotor: &Rotor) -> Result<Option<Vec<Complex<f64>>>> {
    if stated.is_empty() {
        return Ok(None);
    }
    let mut all: Vec<Option<Complex<f64>>> = vec![None; rotor.plane.len()];
    for (plane, magnitude_g_mm, angle_deg) in stated {
        let value = Some(phasor_kg_m(*magnitude_g_mm, *angle_deg));
        match plane {
            None => all.fill(value),
            Some(name) => match rotor.plane.iter().position(|p| p.name == *name) {
                Some(k) => all[k] = value,
                None => {
                    bail!("--unbalance: there is no plane \"{name}\", expected one of {}", plane_names(rotor))
                }
            },
        }
    }
    match all.iter().position(Option::is_none) {
        Some(k) => bail!(
            "--unbalance: plane \"{}\" has none, expected one for each plane, as in {}=300@45",
            rotor.plane[k].name,
            rotor.plane[k].name
        ),
        None => Ok(Some(all.into_iter().flatten().collect())),
    }
}

/// The runs of a table of trial weights.
///
/// # Errors
/// If the file cannot be read, names a plane that the rotor has not, or states masses.
pub fn runs(path: &Path, rotor: &Rotor) -> Result<Vec<Run>> {
    let placed = weights_of_table(path)?.into_iter().map(|weight| {
        let TrialWeight { run, plane: name, unbalance } = weight;
        match rotor.plane.iter().find(|p| p.name == name) {
            Some(plane) => Ok((run, plane.position_m, unbalance)),
            None => bail!(
                "{}: run \"{run}\": there is no plane \"{name}\", expected one of {}",
                path.display(),
                plane_names(rotor)
            ),
        }
    });
    Ok(runs_of(&placed.collect::<Result<Vec<_>>>()?))
}

/// Names of the planes in quotation marks.
fn plane_names(rotor: &Rotor) -> String {
    rotor.plane.iter().map(|p| format!("\"{}\"", p.name)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_even_over_their_range_and_nonsense_is_refused() {
        assert_eq!(speeds("1000..3000:5").unwrap().all_rpm(), [1000.0, 1500.0, 2000.0, 2500.0, 3000.0]);
        assert_eq!(speeds("1500").unwrap().all_rpm(), [1500.0]);
        assert_eq!(speeds("1500:3").unwrap().all_rpm(), [1500.0; 3]);
        for wrong in
            ["3000..1000:5", "0..1000:5", "1000..3000", "1000..3000:0", "1000..3000:many", "a..b:3", ""]
        {
            assert!(speeds(wrong).unwrap_err().contains("1000..6000:51"), "{wrong}");
        }
    }

    #[test]
    fn unbalance_has_plane_and_angle_where_stated() {
        assert_eq!(unbalance("300"), Ok((None, 300.0, 0.0)));
        assert_eq!(unbalance("A=300@-45"), Ok((Some("A".into()), 300.0, -45.0)));
        for wrong in ["-3", "A=", "3@x", "A@3"] {
            assert!(unbalance(wrong).is_err(), "{wrong}");
        }
    }
}
