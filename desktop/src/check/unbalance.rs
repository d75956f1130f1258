//! Response to a trial unbalance, and what standards read off it: amplification factors and separation margins.
//!
//! The trial is twice what the balance grade of the file's `[rated]` permits at the fastest rated speed, or without
//! one twice the residual unbalance that API 617 allows, 2 · 6350 W/N g·mm for a weight of W kg at N rpm, which is
//! the quality grade G 1.3 of ISO 21940-11; once in phase at all planes (static) and, where
//! there are two or more, once with the planes on the two sides of the centre of gravity against each other
//! (couple). Amplification factors are by the half-power points of the curve, `N₁ / (N₂ − N₁)` with the
//! amplitude at 0.707 of the peak; the separation margin that a peak of factor A ≥ 2.5 needs is
//! `17 (1 − 1/(A − 1.5))` percent below the running range and 10 more above it (API 617, lateral analysis).

use nalgebra::{Complex, DVector};
use rayon::prelude::*;

use crate::check::modes::Mode;
use crate::check::system::System;
use crate::error::Error;
use crate::grade::permissible_g_mm;
use crate::machine::drawing::Rotor;
use crate::units::rpm;

type C = Complex<f64>;

/// Residual unbalance that API 617 allows, g·mm · rpm / kg.
const API_G_MM_RPM_PER_KG: f64 = 6350.0;
/// A trial is this many times what is allowed.
const TRIAL: f64 = 2.0;
/// Speeds of the curve, and extra ones around each lightly damped critical speed.
const SPEEDS: usize = 240;
const AROUND: usize = 24;
/// Below this amplification factor a peak is taken as critically damped.
const DAMPED: f64 = 2.5;

/// Unbalance at each plane, kg·m.
#[derive(Debug, Clone)]
pub struct TrialUnbalance {
    /// `static` or `couple`.
    pub name: &'static str,
    /// Phasor of each plane of the rotor.
    pub planes_kg_m: Vec<C>,
}

/// A maximum of the amplitude over speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Speed of the maximum, rpm.
    pub speed_rpm: f64,
    /// Amplitude, zero to peak, m.
    pub amplitude_m: f64,
    /// Amplification factor; `None` where a half-power point is not reached.
    pub amplification: Option<f64>,
    /// Distance from the running range and what is needed, percent; `None` without a running range or for a
    /// peak that is critically damped. Negative inside the range.
    pub margin_percent: Option<[f64; 2]>,
}

/// One probe's answer to one trial.
#[derive(Debug, Clone)]
pub struct ProbeResponse {
    pub probe: String,
    /// Speed in rpm and phasor in m.
    pub points: Vec<(f64, C)>,
    pub peaks: Vec<Peak>,
}

/// The trials of a machine of this mass; the fastest speed is that of a machine whose file states no grade.
pub fn trials(rotor: &Rotor, mass_kg: f64, centre_m: f64, fastest_rpm: f64) -> Vec<TrialUnbalance> {
    let count = rotor.plane.len().max(1) as f64;
    let allowed_g_mm = permissible_g_mm(rotor).unwrap_or(API_G_MM_RPM_PER_KG * mass_kg / fastest_rpm);
    let each_kg_m = TRIAL * allowed_g_mm / count * 1e-6;
    let sides: Vec<f64> =
        rotor.plane.iter().map(|p| if p.position_m < centre_m { 1.0 } else { -1.0 }).collect();
    let mut all =
        vec![TrialUnbalance { name: "static", planes_kg_m: vec![C::from(each_kg_m); rotor.plane.len()] }];
    if sides.contains(&1.0) && sides.contains(&-1.0) {
        all.push(TrialUnbalance {
            name: "couple",
            planes_kg_m: sides.iter().map(|s| C::from(s * each_kg_m)).collect(),
        });
    }
    all
}

/// Speeds at which curves are drawn: evenly to the fastest, closer around the critical ones, rad/s.
pub fn speeds_rad_s(fastest_rad_s: f64, critical: &[Mode]) -> Vec<f64> {
    let mut speeds: Vec<f64> = (1..=SPEEDS).map(|k| fastest_rad_s * k as f64 / SPEEDS as f64).collect();
    for mode in critical {
        let half = -mode.eigenvalue.re;
        let reach = 3.0 * half;
        if half > 0.0 && reach < 0.3 * mode.speed_rad_s {
            let step = |k: usize| mode.speed_rad_s + reach * (2.0 * k as f64 / AROUND as f64 - 1.0);
            speeds.extend((0..=AROUND).map(step).filter(|s| *s < fastest_rad_s));
        }
    }
    speeds.sort_by(f64::total_cmp);
    speeds.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * fastest_rad_s);
    speeds
}

/// Phasors of all probes for these unbalances at a speed, m.
///
/// # Errors
/// If the machine is singular at this speed: an undamped critical speed.
pub fn probes_at(system: &System, speed_rad_s: f64, planes_kg_m: &[C]) -> Result<Vec<C>, Error> {
    let model = system.forced();
    let response = model.turning_at(speed_rad_s, &vec![[0.0; 2]; model.supports.len()])?;
    Ok((response.per_unbalance * DVector::from_column_slice(planes_kg_m)).iter().copied().collect())
}

/// Every probe's response to a trial over these speeds, with its peaks.
///
/// # Errors
/// As [`probes_at`].
pub fn responses(
    rotor: &Rotor,
    system: &System,
    trial: &TrialUnbalance,
    speeds_rad_s: &[f64],
    running_rpm: Option<[f64; 2]>,
) -> Result<Vec<ProbeResponse>, Error> {
    let rows: Vec<Vec<C>> = speeds_rad_s
        .par_iter()
        .map(|speed| probes_at(system, *speed, &trial.planes_kg_m))
        .collect::<Result<_, _>>()?;
    let of = |(i, probe): (usize, &crate::machine::drawing::Probe)| {
        let points: Vec<(f64, C)> =
            speeds_rad_s.iter().zip(&rows).map(|(speed, row)| (rpm(*speed), row[i])).collect();
        ProbeResponse { probe: probe.name.clone(), peaks: peaks(&points, running_rpm), points }
    };
    Ok(rotor.probe.iter().enumerate().map(of).collect())
}

fn peaks(points: &[(f64, C)], running_rpm: Option<[f64; 2]>) -> Vec<Peak> {
    let curve: Vec<(f64, f64)> = points.iter().map(|(s, y)| (*s, y.norm())).collect();
    let mut found = Vec::new();
    for i in 1..curve.len().saturating_sub(1) {
        if curve[i].1 <= curve[i - 1].1 || curve[i].1 < curve[i + 1].1 {
            continue;
        }
        let (speed_rpm, amplitude_m) = vertex(curve[i - 1], curve[i], curve[i + 1]);
        let half = amplitude_m / std::f64::consts::SQRT_2;
        let below = cross(curve[..=i].iter().rev(), half);
        let above = cross(curve[i..].iter(), half);
        let amplification = below.zip(above).map(|(n1, n2)| speed_rpm / (n2 - n1));
        let margin_percent = running_rpm
            .filter(|_| amplification.is_none_or(|a| a >= DAMPED))
            .map(|range| margin(speed_rpm, amplification, range));
        found.push(Peak { speed_rpm, amplitude_m, amplification, margin_percent });
    }
    found
}

/// Margin and what is needed, percent.
fn margin(speed_rpm: f64, amplification: Option<f64>, [from, to]: [f64; 2]) -> [f64; 2] {
    // a peak whose half-power points run into the next is at most as sharp as it would be alone
    let needed = amplification.map_or(17.0, |a| 17.0 * (1.0 - 1.0 / (a - 1.5)));
    if speed_rpm < from {
        [100.0 * (from - speed_rpm) / from, needed]
    } else if speed_rpm > to {
        [100.0 * (speed_rpm - to) / to, 10.0 + needed]
    } else {
        let inside = (speed_rpm - from).min(to - speed_rpm);
        [-100.0 * inside / speed_rpm, needed]
    }
}

/// Vertex of the parabola through three points.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> (f64, f64) {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    if bend < 0.0 { (b.0 - 0.5 * slope / bend, b.1 - 0.25 * slope * slope / bend) } else { b }
}

/// Where a curve falls to a level before it rises again above where it began.
fn cross<'a>(mut points: impl Iterator<Item = &'a (f64, f64)>, level: f64) -> Option<f64> {
    let mut last = points.next()?;
    for point in points {
        if point.1 <= level {
            let share = (last.1 - level) / (last.1 - point.1);
            return Some(last.0 + share * (point.0 - last.0));
        }
        if point.1 > level * std::f64::consts::SQRT_2 {
            return None;
        }
        last = point;
    }
    None
}
