//! A rotor's file as the model that a controller gets.

use std::path::Path;

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{EffectEntry, ParameterValue, Rotor};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;

use super::identify::{self, Days};
use super::listener::Listener;
use crate::edge::Deployment;
use crate::sample;

/// The model of a file, for speeds up to `fastest_rpm`, or that of the data it was fitted to; with the runout that a
/// slow roll shows, which the controller's readings hold.
///
/// # Errors
/// If the file is not one that was identified, or the controller cannot hold its model.
pub fn of_file(path: &Path, fastest_rpm: Option<f64>, slow_roll: Option<&Path>) -> Result<Deployment> {
    let mut rotor = rotor_file::read(path)?;
    let path = path.display();
    if rotor.plane.iter().any(|p| p.unbalance_g_mm.is_none()) {
        bail!("{path}: [[plane]]: unbalance_g_mm is missing; `rotor-edge identify` or `improve` finds it");
    }
    let Some(fastest_rpm) = fastest_rpm.or(rotor.fastest_rpm) else {
        bail!(
            "{path}: fastest_rpm is missing: give --fastest-rpm, the highest speed that the machine reaches"
        );
    };
    if !(1.0..=1e6).contains(&fastest_rpm) {
        bail!("--fastest-rpm {fastest_rpm}: expected a speed in rpm");
    }
    if let Some(slow_roll) = slow_roll {
        let runout_m = measurement::runout_m(slow_roll, &rotor)?;
        add_runout(&mut rotor, &runout_m)?;
    }
    // its readings have all probes, and it masks those that are not used
    Deployment::new(&rotor.whole(), fastest_rpm)
}

/// States runout as an effect of the machine.
fn add_runout(rotor: &mut Rotor, runout_m: &[Complex<f64>]) -> Result<()> {
    const KIND: &str = "runout";
    if rotor.effect.iter().any(|e| e.kind == KIND) {
        bail!("--slow-roll: the rotor's file has the effect {KIND} already, which is the same runout");
    }
    let vectors = ParameterValue::Phasors(runout_m.iter().map(|v| [v.re, v.im]).collect());
    let parameters = [("v".to_string(), vectors)].into();
    rotor.effect.push(EffectEntry { kind: KIND.into(), at: None, parameters });
    Ok(())
}

/// The built-in sample after phase I.
///
/// # Errors
/// None, as long as the sample can be identified.
pub fn of_sample(seed: u64) -> Result<Deployment> {
    let (rotor, record, runup) = sample::load()?;
    let days = Days::FIRST_THREE.select(&record)?;
    let found = identify::phase_one(&rotor, &days, Some(&runup), seed, Listener::Terminal)?;
    let fastest_rpm = record.iter().chain(&runup).map(|r| r.speed_rpm).fold(0.0, f64::max);
    Deployment::new(&found.rotor, fastest_rpm)
}

#[cfg(test)]
mod tests {
    use rotor_edge_desktop::machine::drawing::Run;

    use super::*;

    #[test]
    fn slow_roll_runout_becomes_one_reading_term_per_probe() {
        let (mut rotor, ..) = sample::load().unwrap();
        let runout_m: Vec<Complex<f64>> =
            (0..rotor.probe.len()).map(|p| Complex::new(1e-6 * p as f64, -2e-6)).collect();
        for plane in &mut rotor.plane {
            (plane.unbalance_g_mm, plane.angle_deg) = (Some(100.0), Some(0.0));
        }
        add_runout(&mut rotor, &runout_m).unwrap();
        rotor.validate().unwrap();
        let edge = Deployment::new(&rotor, 3600.0).unwrap().edge;
        for (probe, v) in edge.description().probes.iter().zip(&runout_m) {
            let um = v * 1e6;
            assert_eq!(probe.runout_um, [um.re as f32, um.im as f32]);
        }
        assert!(add_runout(&mut rotor, &runout_m).unwrap_err().to_string().contains("already"));
    }

    #[test]
    fn effect_no_controller_runs_is_refused_by_name() {
        let (mut rotor, ..) = sample::load().unwrap();
        for plane in &mut rotor.plane {
            (plane.unbalance_g_mm, plane.angle_deg) = (Some(100.0), Some(0.0));
        }
        let real = |name: &str, value| (name.to_string(), ParameterValue::Real(value));
        let stated = |kind: &str, at: Option<&str>, parameters: Vec<(String, ParameterValue)>| EffectEntry {
            kind: kind.into(),
            at: at.map(String::from),
            parameters: parameters.into_iter().collect(),
        };
        let (bearing, disk) = (rotor.bearing[0].name.clone(), rotor.disk[0].name.clone());
        let small = |name: &str| (name.to_string(), ParameterValue::Phasor([1e-6, 0.0]));
        for left in [
            stated("speed_factor", None, vec![real("factor", 1.1)]),
            stated("rub", Some(&disk), vec![real("k", 1e6), real("clearance", 1e-4), real("mu", 0.1)]),
            stated("thermal_bow", None, vec![small("cold"), small("growth")]),
        ] {
            rotor.effect = vec![left];
            rotor.validate().unwrap();
            let refused = Deployment::new(&rotor, 3600.0).err().unwrap().to_string();
            assert!(refused.contains(&rotor.effect[0].kind), "{refused}");
        }
        let run = |name: &str| Run { name: name.into(), added_unbalance: Vec::new(), slow_roll: false };
        let bare = Deployment::new(&Rotor { effect: Vec::new(), ..rotor.clone() }, 3600.0).unwrap();
        assert!(bare.left_out.is_empty());
        rotor.run = ["cold", "hot"].map(run).to_vec();
        let u = ParameterValue::Phasors(vec![[1e-4, 0.0]; rotor.plane.len()]);
        rotor.effect = vec![stated("unbalance_of_run", Some("hot"), vec![("u".into(), u)])];
        rotor.validate().unwrap();
        let of_all_runs = Deployment::new(&rotor, 3600.0).unwrap();
        assert!(
            of_all_runs.edge.description().forcings.is_empty()
                && of_all_runs.left_out == ["unbalance_of_run@hot"]
        );
        rotor.effect = vec![
            stated("probes_swapped", Some(&bearing), vec![]),
            stated("keyphasor_offset", None, vec![real("phase", 0.5)]),
        ];
        rotor.validate().unwrap();
        let [x, y] = [0, 1].map(|p| rotor.probe[p].angle_deg.to_radians().cos() as f32);
        let edge = Deployment::new(&rotor, 3600.0).unwrap().edge;
        let probes = edge.description().probes;
        assert_eq!([probes[0].direction[0], probes[1].direction[0]], [y, x]);
        assert!(probes.iter().all(|p| (p.gain[1] - 0.5_f32.sin()).abs() < 1e-6));
    }
}
