//! `check` against ROSS 2.3.0 on the same mesh and coefficients: mass, static loads, critical speeds, damped
//! modes and unbalance response of machines on two, three and four bearings, one with a flexible coupling, and on film
//! bearings with tables of ROSS's own solvers.

use std::collections::BTreeMap;

use nalgebra::Complex;
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::check::critical::critical_speeds;
use rotor_edge_desktop::check::modes::{modes, roundness};
use rotor_edge_desktop::check::system::System;
use rotor_edge_desktop::check::unbalance::probes_at;
use rotor_edge_desktop::check::{CheckUnbalance, check};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::shaft::statics::statics;
use rotor_edge_desktop::units::rad_s;
use rotor_edge_tests::repository;
use serde_json::Value;

/// Design: desktop against ROSS on the same mesh.
const TOLERANCE: f64 = 1e-6;

fn machines() -> BTreeMap<String, (Rotor, Value)> {
    let folder = repository("tests/reference/check");
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            let rotor: Rotor = toml::from_str(&text).unwrap();
            let json = std::fs::read_to_string(path.with_extension("json")).unwrap();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            all.insert(name, (rotor, serde_json::from_str(&json).unwrap()));
        }
    }
    assert!(all.len() >= 12, "a good dozen machines");
    let on_tables = |rotor: &Rotor| rotor.bearing.iter().all(|b| matches!(b.law, Law::Table(_)));
    assert!(
        all.values().filter(|(rotor, _)| on_tables(rotor)).count() >= 2,
        "two with films of ROSS's solvers"
    );
    all
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn mass_centre_and_loads_equal_ross() {
    for (name, (rotor, ross)) in machines() {
        let s = statics(&rotor, &[]).unwrap();
        assert!((s.mass_kg / number(&ross["mass_kg"]) - 1.0).abs() < TOLERANCE, "{name}");
        let centre = number(&ross["centre_of_gravity_m"]);
        assert!((s.centre_of_gravity_m / centre - 1.0).abs() < TOLERANCE, "{name}");
        let Some(loads) = ross["load_n"].as_array() else { continue };
        for (ours, theirs) in s.load_n.iter().zip(loads) {
            // ROSS rounds g to 9.8065
            assert!((ours / number(theirs) - 1.0).abs() < 2e-5, "{name}: {ours} against {theirs}");
        }
    }
}

#[test]
fn undamped_critical_speeds_equal_ross() {
    let mut worst = 0.0_f64;
    for (name, (rotor, ross)) in machines() {
        let theirs = ross["critical_speeds"].as_array().unwrap();
        let theirs: Vec<[f64; 2]> =
            theirs.iter().map(|c| [number(&c["rad_s"]), number(&c["forward"])]).collect();
        let highest = theirs[theirs.len() - 1][0] * 1.000_001;
        let ours = critical_speeds(&System::new(&rotor).unwrap(), highest, 0);
        // forward and backward whirl of one speed are one critical speed
        let mut theirs = theirs;
        theirs.dedup_by(|b, a| {
            let one = (b[0] / a[0] - 1.0).abs() < 1e-8;
            a[1] = if one { (a[1] + b[1]).min(1.0) } else { a[1] };
            one
        });
        theirs.retain(|c| c[1] > 0.01);
        assert_eq!(ours.len(), theirs.len(), "{name}: {ours:?} {theirs:?}");
        for (a, [speed, forward]) in ours.iter().zip(theirs) {
            let off = (a.speed_rad_s / speed - 1.0).abs();
            println!("{name}: {speed:.2} rad/s within {off:.1e}, forward {:.4} {forward:.4}", a.forward);
            worst = worst.max(off);
            assert!((a.forward - forward).abs() < 1e-4, "{name}");
        }
    }
    assert!(worst < TOLERANCE, "{worst:e}");
}

#[test]
fn damped_modes_equal_ross_with_their_sense_of_whirl() {
    let mut worst = 0.0_f64;
    for (name, (rotor, ross)) in machines() {
        let system = System::new(&rotor).unwrap();
        for set in ross["modes"].as_array().unwrap() {
            let theirs = set["modes"].as_array().unwrap();
            let ours = modes(&system, rad_s(number(&set["speed_rpm"])), 0.0, theirs.len()).unwrap();
            let mut off_here = 0.0_f64;
            for mode in theirs {
                let value = Complex::new(number(&mode["re"]), number(&mode["im"]));
                let distance = |m: &&rotor_edge_desktop::check::modes::Mode| (m.eigenvalue - value).norm();
                let nearest = ours.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
                off_here = off_here.max(distance(&nearest) / value.norm());
                let turns: Vec<f64> = nearest
                    .x
                    .iter()
                    .zip(&nearest.y)
                    .map(|(x, y)| (x.norm_sqr() + y.norm_sqr(), roundness(*x, *y)))
                    .fold((0.0_f64, vec![]), |(most, mut all), one| {
                        all.push(one);
                        (most.max(one.0), all)
                    })
                    .into_turns();
                let [least, largest] = [number(&mode["least"]), number(&mode["largest"])];
                let ours = turns.iter().fold([1.0_f64, -1.0], |[l, h], t| [l.min(*t), h.max(*t)]);
                assert!(
                    (ours[0] - least).abs() < 1e-3 && (ours[1] - largest).abs() < 1e-3,
                    "{name} {value}: {ours:?} {least} {largest}"
                );
            }
            println!("{name} at {} rpm: {off_here:.1e}", set["speed_rpm"]);
            worst = worst.max(off_here);
        }
    }
    assert!(worst < TOLERANCE, "{worst:e}");
}

#[test]
fn unbalance_response_equals_ross() {
    let mut worst = 0.0_f64;
    for (name, (rotor, ross)) in machines() {
        let system = System::new(&rotor).unwrap();
        let planes: Vec<Complex<f64>> = ross["response"]["unbalance"]
            .as_array()
            .unwrap()
            .iter()
            .map(|u| Complex::from_polar(number(&u["magnitude_kg_m"]), number(&u["angle_deg"]).to_radians()))
            .collect();
        let probes = ross["response"]["probes"].as_array().unwrap();
        for (k, speed_rpm) in ross["response"]["speed_rpm"].as_array().unwrap().iter().enumerate() {
            let ours = probes_at(&system, rad_s(number(speed_rpm)), &planes).unwrap();
            let theirs: Vec<Complex<f64>> = probes
                .iter()
                .map(|p| Complex::new(number(&p["cos_m"][k]), -number(&p["sin_m"][k])))
                .collect();
            let largest = theirs.iter().map(|y| y.norm()).fold(0.0, f64::max);
            let off = ours.iter().zip(&theirs).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / largest;
            assert!(off < TOLERANCE, "{name} at {speed_rpm} rpm: {off:e}");
            worst = worst.max(off);
        }
    }
    println!("unbalance response within {worst:.1e} of ROSS");
}

#[test]
fn check_of_each_machine_agrees_with_ross_on_stability() {
    for (name, (rotor, ross)) in machines() {
        let top = number(&ross["top_rpm"]);
        let start = std::time::Instant::now();
        let found = check(&rotor, Some([0.1 * top, 1.1 * top]), CheckUnbalance::Assumed).unwrap();
        println!("{name}: {} stations, {:.2} s", found.stations_m.len(), start.elapsed().as_secs_f64());
        let grows = ross["modes"].as_array().unwrap().iter().position(|set| {
            set["modes"].as_array().unwrap().iter().any(|m| number(&m["re"]) > 1e-6 * number(&m["im"]))
        });
        let speeds = [0.1, 0.35, 0.6, 0.85, 1.1].map(|f| rad_s(f * top));
        match (grows, &found.threshold) {
            (None, None) => {}
            (Some(first), Some(t)) => {
                let before = first.checked_sub(1).map_or(0.0, |b| speeds[b]);
                assert!(
                    before <= t.speed_rad_s && t.speed_rad_s <= speeds[first] * 1.000_001,
                    "{name}: {t:?}"
                );
            }
            other => panic!("{name}: {other:?}"),
        }
        assert!(found.campbell.modes.iter().all(|here| here.len() >= 4), "{name}");
    }
}

trait Turns {
    /// Roundness of the orbits that move at least a twentieth of the largest.
    fn into_turns(self) -> Vec<f64>;
}

impl Turns for (f64, Vec<(f64, f64)>) {
    fn into_turns(self) -> Vec<f64> {
        let least = 0.05_f64.powi(2) * self.0;
        self.1.into_iter().filter(|(size, _)| *size > least).map(|(_, turn)| turn).collect()
    }
}
