//! How the work of a diagnosis grows with readings and runs: run by `tests/growth`.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use rotor_edge_desktop::diagnose::{diagnose, solved_responses};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;
use rotor_edge_tests::repository;

/// Largest exponent of the responses from the first size of a series to the last.
const MOST: f64 = 1.1;

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

/// Prints a series and tells whether responses grow no faster than [`MOST`].
fn series(what: &str, sizes: &[usize], readings_of: impl Fn(usize) -> (Rotor, Vec<Reading>)) -> Result<bool> {
    println!("{what:>10}{:>12}{:>10}{:>12}{:>10}", "responses", "exponent", "seconds", "exponent");
    let mut before: Option<[f64; 3]> = None;
    let mut first = None;
    for size in sizes {
        let (rotor, readings) = readings_of(*size);
        let (solved, began) = (solved_responses(), Instant::now());
        diagnose(&rotor, &readings)?;
        let now = [*size as f64, (solved_responses() - solved) as f64, began.elapsed().as_secs_f64()];
        let exponent = |k: usize| {
            before.map_or(String::new(), |b| format!("{:.2}", (now[k] / b[k]).ln() / (now[0] / b[0]).ln()))
        };
        println!("{size:>10}{:>12}{:>10}{:>12.2}{:>10}", now[1], exponent(1), now[2], exponent(2));
        first = first.or(Some(now));
        before = Some(now);
    }
    let (first, last) = (first.context("no sizes")?, before.context("no sizes")?);
    let exponent = (last[1] / first[1]).ln() / (last[0] / first[0]).ln();
    println!("{:>10}: exponent {exponent:.2} over all, at most {MOST}\n", "responses");
    Ok(exponent <= MOST)
}

fn main() -> Result<ExitCode> {
    let (sample, measured) = read(&repository("host-sim/sample/kit"), "startup.csv")?;
    let first_run = measured[0].run.clone();
    let one_run: Vec<Reading> = measured.into_iter().filter(|r| r.run == first_run).collect();
    let by_readings =
        series("readings", &[75, 150, 300, 600, 1200], |count| (sample.clone(), denser(&one_run, count)))?;
    let (rig, all) = read(&repository("tests/rigs/rk4"), "measured.csv")?;
    let mut runs: Vec<Option<String>> = all.iter().map(|r| r.run.clone()).collect();
    runs.dedup();
    let by_runs = series("runs", &[10, 20, 40, 80], |count| {
        let kept = all.iter().filter(|r| runs[..count].contains(&r.run)).cloned().collect();
        (rig.clone(), kept)
    })?;
    Ok(if by_readings && by_runs { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
