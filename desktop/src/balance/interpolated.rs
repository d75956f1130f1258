//! Runs that were measured at unlike speeds, brought onto the speeds of one of them.
//!
//! Between two neighbouring speeds of a run its phasors are taken as straight. How far that is off shows where a reading is
//! predicted from its two neighbours: it misses by `h²|Y''|/2` for steps of h, and half-way between two readings by a quarter
//! of that.

use std::collections::BTreeMap;

use nalgebra::Complex;

use crate::error::Error;
use crate::measurement::Reading;

type C = Complex<f64>;

/// Largest relative step between neighbouring speeds that are interpolated.
const WIDEST_STEP: f64 = 0.05;

/// All runs at the speeds of one.
#[derive(Debug, Clone)]
pub struct Interpolated {
    pub readings: Vec<Reading>,
    /// The run whose speeds they have.
    pub run: String,
    /// Estimated error, root mean square, relative to the vibration; `None` where no run has three speeds near each other.
    pub off: Option<f64>,
}

impl Interpolated {
    /// A sentence for the user on the interpolation and its error.
    pub fn remark(&self) -> String {
        let off = match self.off {
            Some(off) => format!("off by about {:.1} % of the vibration, noise included", 100.0 * off),
            None => "by how much that is off cannot be told".into(),
        };
        format!("Runs are interpolated to the speeds of run \"{}\": {off}.", self.run)
    }
}

/// Brings all runs onto the speeds of the one with the fewest of them.
///
/// # Errors
/// One sentence if no other run has readings around any of these speeds.
pub fn interpolated(readings: &[Reading]) -> Result<Interpolated, Error> {
    let mut runs: BTreeMap<String, Vec<&Reading>> = BTreeMap::new();
    for reading in readings {
        runs.entry(reading.run.clone().unwrap_or_default()).or_default().push(reading);
    }
    runs.values_mut().for_each(|run| run.sort_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm)));
    let Some((name, base)) = runs.iter().min_by_key(|(_, run)| speeds(run).len()) else {
        return Err(Error::NoReading);
    };
    let mut all: Vec<Reading> = base.iter().map(|r| (*r).clone()).collect();
    let grid = speeds(base);
    for run in runs.values().filter(|run| !std::ptr::eq(*run, base)) {
        all.extend(grid.iter().filter_map(|speed_rpm| at(run, *speed_rpm)));
    }
    if all.len() == base.len() && runs.len() > 1 {
        return Err(Error::NoOverlap { run: name.clone(), within: WIDEST_STEP });
    }
    Ok(Interpolated { readings: all, run: name.clone(), off: off(runs.values()) })
}

fn speeds(run: &[&Reading]) -> Vec<f64> {
    let mut all: Vec<f64> = run.iter().map(|r| r.speed_rpm).collect();
    all.dedup();
    all
}

/// A run's reading at a speed between two of its own.
fn at(run: &[&Reading], speed_rpm: f64) -> Option<Reading> {
    let above = run.partition_point(|r| r.speed_rpm < speed_rpm);
    let high = run.get(above)?;
    if high.speed_rpm == speed_rpm {
        return Some((*high).clone());
    }
    between(run[above.checked_sub(1)?], high, speed_rpm)
}

fn between(low: &Reading, high: &Reading, speed_rpm: f64) -> Option<Reading> {
    if high.speed_rpm > low.speed_rpm * (1.0 + WIDEST_STEP) {
        return None;
    }
    let share = (speed_rpm - low.speed_rpm) / (high.speed_rpm - low.speed_rpm);
    let mix = |(a, b): (&Option<C>, &Option<C>)| Some((*a)? * (1.0 - share) + (*b)? * share);
    let probes = low.probes.iter().zip(&high.probes).map(mix).collect();
    Some(Reading { speed_rpm, probes, gaps_v: Vec::new(), ..low.clone() })
}

/// Root mean square error of linear interpolation half-way, relative to that of the vibration.
fn off<'a>(runs: impl Iterator<Item = &'a Vec<&'a Reading>>) -> Option<f64> {
    let (mut missed, mut squares) = (0.0, 0.0);
    for run in runs {
        for three in
            run.windows(3).filter(|t| t[0].speed_rpm < t[1].speed_rpm && t[1].speed_rpm < t[2].speed_rpm)
        {
            let Some(line) = between(three[0], three[2], three[1].speed_rpm) else { continue };
            for (y, line) in three[1].probes.iter().zip(&line.probes) {
                let (Some(y), Some(line)) = (y, line) else { continue };
                missed += (0.25 * (y - line)).norm_sqr();
                squares += y.norm_sqr();
            }
        }
    }
    (squares > 0.0).then(|| (missed / squares).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A resonance at 3000 rpm that a weight doubles.
    fn response(speed_rpm: f64, weight: f64) -> C {
        let ratio = speed_rpm / 3000.0;
        C::from(weight * ratio * ratio) / C::new(1.0 - ratio * ratio, 0.1 * ratio)
    }

    fn run(name: &str, from_rpm: f64, step_rpm: f64, weight: f64) -> Vec<Reading> {
        let reading = |k: usize| {
            let speed_rpm = from_rpm + step_rpm * k as f64;
            let probes = vec![Some(response(speed_rpm, weight))];
            Reading { run: Some(name.into()), speed_rpm, probes, ..Reading::default() }
        };
        (0..30).map(reading).collect()
    }

    #[test]
    fn interpolated_run_error_matches_estimated_error() {
        let all = [run("base", 2500.0, 30.0, 1.0), run("trial", 2507.0, 23.0, 2.0)].concat();
        let found = interpolated(&all).unwrap();
        assert_eq!(found.run, "base");
        let (mut missed, mut squares) = (0.0, 0.0);
        for reading in found.readings.iter().filter(|r| r.run.as_deref() == Some("trial")) {
            assert!(
                found
                    .readings
                    .iter()
                    .any(|r| r.run.as_deref() == Some("base") && r.speed_rpm == reading.speed_rpm)
            );
            let known = response(reading.speed_rpm, 2.0);
            missed += (reading.probes[0].unwrap() - known).norm_sqr();
            squares += known.norm_sqr();
        }
        let (truly, said) = ((missed / squares).sqrt(), found.off.unwrap());
        assert!(said < 0.02 && truly < 1.5 * said && said < 4.0 * truly, "{truly} {said}");
        assert!(found.remark().contains("run \"base\""));
    }

    #[test]
    fn interpolation_without_overlap_or_over_wide_gap_is_refused() {
        let apart = [run("base", 1000.0, 1.0, 1.0), run("trial", 2500.0, 30.0, 2.0)].concat();
        assert!(interpolated(&apart).unwrap_err().to_string().contains("expected run-ups that overlap"));
        let wide = [run("base", 2500.0, 30.0, 1.0), run("trial", 2400.0, 500.0, 2.0)].concat();
        assert!(interpolated(&wide).is_err(), "steps of 15 % and more");
    }
}
