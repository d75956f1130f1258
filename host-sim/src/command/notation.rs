//! How commands that need no data are told speeds, unbalances, trial weights, noise and parameters.

use std::path::Path;

use anyhow::{Result as Answer, bail};
use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{Noise, ParameterValue};
use rotor_edge_desktop::unbalance::{G_MM, phasor_kg_m};

use crate::ingest::weights;

type C = Complex<f64>;

/// Speeds of a range that does not say how many.
const SPEEDS: usize = 40;
const MOST_SPEEDS: usize = 2000;
/// No rotor of this kind turns faster, rpm.
const FASTEST_RPM: f64 = 500_000.0;

/// Speeds of every run, rpm.
#[derive(Debug, Clone, PartialEq)]
pub struct Speeds(pub Vec<f64>);

/// A weight of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialWeight {
    pub run: String,
    pub plane: String,
    /// kg·m.
    pub unbalance: C,
}

/// `A..B:N`, `A..B`, or speeds with commas between them.
pub fn speeds(text: &str) -> Result<Speeds, String> {
    let wrong = |what: &str| {
        format!("\"{text}\" {what}, expected for example 600..6000:40, or speeds in rpm as in 3000,3600")
    };
    let is_speed = |rpm: &f64| *rpm > 0.0 && *rpm <= FASTEST_RPM;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(is_speed);
    let Some((from, rest)) = text.split_once("..") else {
        let all: Option<Vec<f64>> = text.split(',').map(number).collect();
        return all.map(Speeds).ok_or_else(|| wrong("is no list of speeds"));
    };
    let (to, count) = match rest.split_once(':') {
        Some((to, count)) => (to, count.trim().parse().ok()),
        None => (rest, Some(SPEEDS)),
    };
    let (Some(from), Some(to)) = (number(from), number(to)) else {
        return Err(wrong("is no range of speeds"));
    };
    match count {
        Some(count) if from < to && (2..=MOST_SPEEDS).contains(&count) => {
            let at = |k: usize| from + (to - from) * k as f64 / (count - 1) as f64;
            Ok(Speeds((0..count).map(|k| (1e3 * at(k)).round() / 1e3).collect()))
        }
        Some(_) if from >= to => Err(wrong("does not go up")),
        _ => Err(wrong(&format!("has no number of speeds from 2 to {MOST_SPEEDS}"))),
    }
}

/// `PLANE=SIZE@ANGLE`, g·mm and degrees; in kg·m.
pub fn unbalance(text: &str) -> Result<(String, C), String> {
    let wrong = || {
        format!("\"{text}\" is no unbalance, expected PLANE=SIZE@ANGLE in g·mm and degrees, as in A=500@30")
    };
    let (plane, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    let (size, angle_deg) = sized(value).ok_or_else(wrong)?;
    if size < 0.0 || plane.trim().is_empty() {
        return Err(wrong());
    }
    Ok((plane.trim().into(), phasor_kg_m(size, angle_deg)))
}

/// `RUN:PLANE=SIZE@ANGLE`, g·mm and degrees.
pub fn weight(text: &str) -> Result<TrialWeight, String> {
    let wrong = || {
        format!(
            "\"{text}\" is no weight, expected RUN:PLANE=SIZE@ANGLE in g·mm and degrees, as in trial:A=500@30"
        )
    };
    let (run, rest) = text.split_once(':').ok_or_else(wrong)?;
    let (plane, unbalance) = unbalance(rest).map_err(|_| wrong())?;
    if run.trim().is_empty() {
        return Err(wrong());
    }
    Ok(TrialWeight { run: run.trim().into(), plane, unbalance })
}

/// The weights of a table `run,plane,magnitude_g_mm,angle_deg`.
///
/// # Errors
/// If the file cannot be read or states masses.
pub fn weights_of_table(path: &Path) -> Answer<Vec<TrialWeight>> {
    let table = weights::read(path, false)?;
    if table.unit.is_mass() {
        bail!("{}: states masses, expected unbalances as magnitude_g_mm", path.display());
    }
    let weight = |(run, plane, g_mm): &(String, usize, C)| TrialWeight {
        run: run.clone(),
        plane: table.planes[*plane].clone(),
        unbalance: g_mm / G_MM,
    };
    Ok(table.rows.iter().map(weight).collect())
}

/// `RELATIVE,FLOOR_UM`, or the relative part alone.
pub fn noise(text: &str) -> Result<Noise, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let is_noise =
        |relative: f64, floor_um: f64| (0.0..1.0).contains(&relative) && (0.0..1000.0).contains(&floor_um);
    match numbers.as_deref() {
        Some(&[relative]) if is_noise(relative, 0.0) => Ok(Noise { relative, ..Noise::default() }),
        Some(&[relative, floor_um]) if is_noise(relative, floor_um) => {
            Ok(Noise { relative, floor_um, ..Noise::default() })
        }
        _ => Err(format!(
            "\"{text}\" is no noise, expected a part of the amplitude and µm 0-pk, as in 0.02,0.05, or 0 for none"
        )),
    }
}

/// `NAME=VALUE`: a number, a phasor as SIZE@DEGREES or [RE,IM], or several phasors with commas between them.
pub fn setting(text: &str) -> Result<(String, ParameterValue), String> {
    let wrong = || {
        format!(
            "\"{text}\" is no parameter, expected NAME=VALUE as in k=2e7, NAME=SIZE@DEGREES as in m=2e-6@30, or several of these \
             with commas between them"
        )
    };
    let (name, value) = text.split_once('=').ok_or_else(wrong)?;
    let value = value.trim();
    let parsed = match value.starts_with('[') {
        true => serde_json::from_str::<ParameterValue>(value).ok(),
        false => phasors(value),
    };
    Ok((name.trim().into(), parsed.ok_or_else(wrong)?))
}

fn phasors(text: &str) -> Option<ParameterValue> {
    let pair = |text: &str| {
        let (size, angle_deg) = sized(text)?;
        let value = C::from_polar(size, angle_deg.to_radians());
        Some([value.re, value.im])
    };
    match (text.contains(','), text.contains('@')) {
        (true, _) => Some(ParameterValue::Phasors(text.split(',').map(pair).collect::<Option<_>>()?)),
        (false, true) => Some(ParameterValue::Phasor(pair(text)?)),
        (false, false) => Some(ParameterValue::Real(finite(text)?)),
    }
}

/// `SIZE@ANGLE`, or a size at 0°.
pub fn sized(text: &str) -> Option<(f64, f64)> {
    let (size, angle) = text.split_once('@').unwrap_or((text, "0"));
    Some((finite(size)?, finite(angle.trim().trim_end_matches('°'))?))
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_a_range_with_a_count_or_a_list() {
        assert_eq!(speeds("1000..3000:3"), Ok(Speeds(vec![1000.0, 2000.0, 3000.0])));
        assert_eq!(speeds("3000, 3600"), Ok(Speeds(vec![3000.0, 3600.0])));
        assert_eq!(speeds("600..4200").unwrap().0.len(), SPEEDS);
        assert_eq!(speeds("1000..2000:7").unwrap().0[1], 1166.667);
        for wrong in
            ["", "0..100", "3000..600", "1..2:1", "1..2:x", "1..2:9999", "a,b", "-5", "nan", "1..inf"]
        {
            assert!(speeds(wrong).unwrap_err().contains("expected"), "{wrong}");
        }
    }

    #[test]
    fn unbalance_and_weight_name_plane_size_and_angle() {
        let (plane, u) = unbalance("plane 1=500@90").unwrap();
        assert!(plane == "plane 1" && (u - C::new(0.0, 5e-4)).norm() < 1e-12);
        let w = weight("trial 1:A=500@-90°").unwrap();
        assert_eq!((w.run.as_str(), w.plane.as_str()), ("trial 1", "A"));
        assert!((w.unbalance - C::new(0.0, -5e-4)).norm() < 1e-12);
        for wrong in ["A", "A=", "A=x@1", "=5@1", "A=-5@1", "A=inf@1"] {
            assert!(unbalance(wrong).is_err() && weight(&format!("run:{wrong}")).is_err(), "{wrong}");
        }
        assert!(weight("A=5@1").is_err() && weight(":A=5@1").is_err());
    }

    #[test]
    fn noise_is_relative_and_floor() {
        let of = |text: &str| noise(text).map(|n| (n.relative, n.floor_um));
        assert_eq!(
            (of("0.01,0.05"), of("0"), of("0.02")),
            (Ok((0.01, 0.05)), Ok((0.0, 0.0)), Ok((0.02, 0.0)))
        );
        for wrong in ["", "-1", "1.5", "0.1,-1", "0.1,0.2,0.3", "nan"] {
            assert!(noise(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn parameters_are_numbers_phasors_or_lists_of_them() {
        let of = |text: &str| setting(text).map(|(_, value)| value);
        assert_eq!(of("k=2e7"), Ok(ParameterValue::Real(2e7)));
        assert_eq!(of("m=[1e-5, 0]"), Ok(ParameterValue::Phasor([1e-5, 0.0])));
        assert_eq!(of("v=[[1,2],[3,4]]"), Ok(ParameterValue::Phasors(vec![[1.0, 2.0], [3.0, 4.0]])));
        let Ok(ParameterValue::Phasors(two)) = of("v=2@90,1") else { panic!() };
        assert!((two[0][1] - 2.0).abs() < 1e-12 && two[1] == [1.0, 0.0]);
        for wrong in ["k", "k=", "k=x", "k=nan", "k=[1", "v=1,,2"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
