//! Runs with trial weights that the command line states.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use rotor_edge_desktop::Error;
use rotor_edge_desktop::machine::drawing::{AddedUnbalance, Rotor, Run};
use rotor_edge_desktop::unbalance::g_mm_deg;

use crate::command::notation::{TrialWeight, weights_of_table};

/// The run without weights, where the rotor's file lists none.
const BASE: &str = "as found";

/// The rotor with the runs of these weights behind its own.
pub fn with_runs(rotor: &Rotor, stated: &[TrialWeight], table: Option<&Path>) -> Result<Rotor> {
    let mut runs: Vec<Run> = Vec::new();
    if let Some(path) = table {
        let file = path.display().to_string();
        for weight in weights_of_table(path)? {
            add(rotor, &mut runs, &weight).with_context(|| file.clone())?;
        }
    }
    for weight in stated {
        add(rotor, &mut runs, weight).context("--weight")?;
    }
    let mut with = rotor.clone();
    let is_base = |run: &Run| run.added_unbalance.is_empty();
    if !runs.is_empty() && rotor.run.is_empty() && !runs.iter().any(is_base) {
        with.run.push(Run { name: BASE.into(), added_unbalance: Vec::new(), slow_roll: false });
    }
    with.run.append(&mut runs);
    Ok(with)
}

/// Puts a weight into its run; one of size zero only names the run.
fn add(rotor: &Rotor, runs: &mut Vec<Run>, weight: &TrialWeight) -> Result<()> {
    if rotor.run.iter().any(|run| run.name == weight.run) {
        bail!("the run \"{}\" is in the rotor's file already, expected another name", weight.run);
    }
    let Some(plane) = rotor.plane.iter().find(|p| p.name == weight.plane) else {
        let known = rotor.plane.iter().map(|p| p.name.clone()).collect();
        return Err(Error::UnknownPlane { plane: weight.plane.clone(), known }.into());
    };
    let at = runs.iter().position(|run| run.name == weight.run).unwrap_or_else(|| {
        runs.push(Run { name: weight.run.clone(), added_unbalance: Vec::new(), slow_roll: false });
        runs.len() - 1
    });
    let [magnitude_g_mm, angle_deg] = g_mm_deg(weight.unbalance);
    if magnitude_g_mm > 0.0 {
        let added = AddedUnbalance { position_m: plane.position_m, magnitude_g_mm, angle_deg };
        runs[at].added_unbalance.push(added);
    }
    Ok(())
}
