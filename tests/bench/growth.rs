//! How work and memory grow with readings, runs, bearings, shaft pieces and days: run by `tests/growth`.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use nalgebra::{Complex, DVector};
use rotor_edge_desktop::diagnose::{diagnose, judged_fit, solved_responses};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::track::{Config, Method, track};
use rotor_edge_tests::repository;

/// Largest exponent of the number of responses, from the first size of a series to the last: in the amount of data, and in the number of
/// bearings, where every bearing adds unknowns and candidates.
const OF_DATA: f64 = 1.1;
const OF_BEARINGS: f64 = 2.0;
/// Number of speeds at which the train is measured.
const TRAIN_SPEEDS: usize = 40;

fn read(folder: &Path, measured: &str) -> Result<(Rotor, Vec<Reading>)> {
    let rotor = rotor_file::read(&folder.join("rotor.toml"))?;
    let readings = measurement::read(&folder.join(measured), &rotor)?;
    Ok((rotor, readings))
}

/// Readings at so many speeds of one run, by straight lines between the given ones: the misfit of the model stays as it is.
fn denser(readings: &[Reading], count: usize) -> Vec<Reading> {
    let last = readings.len() - 1;
    (0..count)
        .map(|k| {
            let at = k as f64 * last as f64 / (count - 1) as f64;
            let left = (at.floor() as usize).min(last - 1);
            let (a, b, share) = (&readings[left], &readings[left + 1], at - left as f64);
            let between = |(a, b): (&Option<_>, &Option<_>)| Some((*a)? * (1.0 - share) + (*b)? * share);
            Reading {
                row: None,
                speed_rpm: a.speed_rpm * (1.0 - share) + b.speed_rpm * share,
                probes: a.probes.iter().zip(&b.probes).map(between).collect(),
                ..a.clone()
            }
        })
        .collect()
}

/// A train of so many equal spans and one bearing more, with probes at its first and last bearing and a balancing plane beside each.
fn train(bearings: usize) -> Result<Rotor> {
    let mut text = "schema = 2\nname = \"train\"\n[tolerance]\nexact = true\n[noise]\nrelative = 0.01\nfloor_um = 0.05\n".to_string();
    let last = bearings - 1;
    for _ in 0..2 * last {
        text += "[[shaft]]\nlength_m = 0.5\nouter_diameter_m = 0.12\n";
    }
    for k in 0..last {
        writeln!(
            text,
            "[[disk]]\nname = \"{k}\"\nposition_m = {}\nmass_kg = 60.0\ndiametral_inertia_kg_m2 = 0.6\n\
             polar_inertia_kg_m2 = 1.1",
            k as f64 + 0.5
        )?;
    }
    for k in 0..bearings {
        writeln!(
            text,
            "[[bearing]]\nname = \"B{k}\"\nposition_m = {k}.0\nstiffness_n_m = {{ xx = 6e7, yy = 9e7 }}\n\
             damping_n_s_m = {{ xx = 6e4, yy = 9e4 }}"
        )?;
    }
    for k in [0, last] {
        for (axis, angle_deg) in [("X", 45), ("Y", 135)] {
            writeln!(
                text,
                "[[probe]]\nname = \"B{k}{axis}\"\nbearing = \"B{k}\"\nposition_m = {k}.0\nangle_deg = {angle_deg}"
            )?;
        }
    }
    for position_m in [0.5, last as f64 - 0.5].into_iter().take(last.min(2)) {
        writeln!(text, "[[plane]]\nname = \"at {position_m}\"\nposition_m = {position_m}")?;
    }
    Ok(rotor_file::parse("train.toml", &text)?)
}

/// What a machine would show of its planes' unbalance if its bearings were softer than drawn, with noise of about one percent.
fn run_up(rotor: &Rotor) -> Result<Vec<Reading>> {
    let mut built = rotor.clone();
    for bearing in &mut built.bearing {
        let constants = bearing.constants_mut().context("constant coefficients")?;
        constants.stiffness_n_m.xx *= 0.8;
    }
    let model = Model::finite_elements(&built);
    let unbalance = DVector::from_element(rotor.plane.len(), Complex::new(4e-4, 3e-4));
    let mut turn = 0.0_f64;
    let speeds = (1..=TRAIN_SPEEDS).map(|k| 3_600.0 * k as f64 / TRAIN_SPEEDS as f64);
    let reading = |speed_rpm: f64| {
        let mut reading = Reading { speed_rpm, ..Reading::default() };
        let shown = model.response(reading.speed_rad_s())?.at(&unbalance);
        reading.probes = shown
            .iter()
            .map(|y| {
                turn += 2.4;
                Some(y * (1.0 + Complex::from_polar(0.012, turn * turn)))
            })
            .collect();
        Ok(reading)
    };
    speeds.map(reading).collect()
}

/// The same rotor with each piece of its shaft cut into so many.
fn cut(rotor: &Rotor, parts: usize) -> Rotor {
    let mut cut = rotor.clone();
    let piece = |piece: &_| std::iter::repeat_n(Clone::clone(piece), parts);
    cut.shaft = rotor.shaft.iter().flat_map(piece).collect();
    cut.shaft.iter_mut().for_each(|piece| piece.length_m /= parts as f64);
    cut
}

/// Largest memory of this process since the last call, MB; of systems that do not tell, not a number.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
    // begins to count again
    let is_reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    peak.filter(|_| is_reset).and_then(|kb| kb.parse().ok()).map_or(f64::NAN, |kb: f64| 1.024e-3 * kb)
}

/// Prints a series and tells whether responses grow by no more than the exponent `most`.
fn series(what: &str, sizes: &[usize], most: f64, work: impl Fn(usize) -> Result<()>) -> Result<bool> {
    println!(
        "{what:>10}{:>12}{:>10}{:>12}{:>10}{:>10}",
        "responses", "exponent", "seconds", "exponent", "peak MB"
    );
    let mut before: Option<[f64; 3]> = None;
    let mut first = None;
    for size in sizes {
        peak_mb();
        let (solved, began) = (solved_responses(), Instant::now());
        work(*size)?;
        let now = [*size as f64, (solved_responses() - solved) as f64, began.elapsed().as_secs_f64()];
        let exponent = |k: usize| {
            before.map_or(String::new(), |b| format!("{:.2}", (now[k] / b[k]).ln() / (now[0] / b[0]).ln()))
        };
        let peak = peak_mb();
        println!(
            "{size:>10}{:>12}{:>10}{:>12.2}{:>10}{peak:>10.0}",
            now[1],
            exponent(1),
            now[2],
            exponent(2)
        );
        first = first.or(Some(now));
        before = Some(now);
    }
    let (first, last) = (first.context("no sizes")?, before.context("no sizes")?);
    let exponent = |k: usize| (last[k] / first[k]).ln() / (last[0] / first[0]).ln();
    println!(
        "{:>10}: exponent {:.2} over all, at most {most}; {:.2} in seconds\n",
        "responses",
        exponent(1),
        exponent(2)
    );
    Ok(exponent(1) <= most)
}

fn main() -> Result<ExitCode> {
    let (kit, measured) = read(&repository("host-sim/sample/kit"), "startup.csv")?;
    let first_run = measured[0].run.clone();
    let one_run: Vec<Reading> = measured.into_iter().filter(|r| r.run == first_run).collect();
    let by_readings = series("readings", &[75, 150, 300, 600, 1200], OF_DATA, |count| {
        Ok(diagnose(&kit, &denser(&one_run, count)).map(drop)?)
    })?;
    let by_pieces = series("pieces", &[1, 2, 4, 8], OF_DATA, |parts| {
        Ok(diagnose(&cut(&kit, parts), &one_run).map(drop)?)
    })?;
    let (rig, all) = read(&repository("tests/rigs/rk4"), "measured.csv")?;
    let mut runs: Vec<Option<String>> = all.iter().map(|r| r.run.clone()).collect();
    runs.dedup();
    let by_runs = series("runs", &[10, 20, 40, 80], OF_DATA, |count| {
        // spread over all sessions of measurement, so that the model misfits in the same way
        let kept: Vec<_> = runs.iter().step_by(runs.len() / count).take(count).collect();
        let kept: Vec<Reading> = all.iter().filter(|r| kept.contains(&&r.run)).cloned().collect();
        Ok(diagnose(&rig, &kept).map(drop)?)
    })?;
    let by_bearings = series("bearings", &[2, 4, 8, 12], OF_BEARINGS, |bearings| {
        let rotor = train(bearings)?;
        Ok(judged_fit(&rotor, &run_up(&rotor)?).map(drop)?)
    })?;
    let turbine = repository("tests/records");
    let rotor = rotor_file::read(&turbine.join("rotor.toml"))?;
    let [record, began] =
        ["record.csv", "runup.csv"].map(|name| measurement::read(&turbine.join("quiet").join(name), &rotor));
    let (record, began) = (record?, began?);
    let by_days = series("days", &[110, 220, 440], OF_DATA, |days| {
        let days = &record[..days.min(record.len())];
        Ok(track(&rotor, days, &began, &[], &Config::new(Method::Joint), &mut |_, _| ()).map(drop)?)
    })?;
    let all = [by_readings, by_pieces, by_runs, by_bearings, by_days];
    Ok(if all.iter().all(|held| *held) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
