//! Response to an unbalance: that which a check assumes, or that of the rotor file.
//!
//! The assumed one is twice what the balance grade of the file's `[rated]` permits at the fastest rated speed, or without
//! one twice the residual unbalance that API 617 allows, 2 · 6350 W/N g·mm for a weight of W kg at N rpm, which is
//! the quality grade G 1.3 of ISO 21940-11; once in phase at all planes (static) and, where
//! there are two or more, once with the planes on the two sides of the centre of gravity against each other
//! (couple).
//!
//! Without damping the amplitude at a critical speed has no bound. Curves have a gap there, from where an undamped mode by
//! itself would amplify tenfold.

use nalgebra::{Complex, DVector};
use rayon::prelude::*;

use crate::check::modes::Mode;
use crate::check::peaks::{Peak, PeakContext, Resonance, margin_percent, peaks};
use crate::check::system::System;
use crate::error::Error;
use crate::grade::permissible_g_mm;
use crate::machine::drawing::{Plane, Rotor};
use crate::unbalance::phasor_kg_m;
use crate::units::{rad_s, rpm};

type C = Complex<f64>;

/// Residual unbalance that API 617 allows, g·mm · rpm / kg.
const API_G_MM_RPM_PER_KG: f64 = 6350.0;
/// A trial is this many times what is allowed.
const TRIAL: f64 = 2.0;
/// Speeds of the curve, and extra ones around each lightly damped critical speed.
const SPEEDS: usize = 240;
const AROUND: usize = 24;
/// Share of an undamped critical speed on either side of it that curves leave out: `|1 − (Ω/ω)²| < 0.1`.
const GAP: f64 = 0.05;
/// A mode of which this share or less turns forward is not met by unbalance.
const EXCITED: f64 = 0.01;

/// Unbalance at each plane, kg·m.
#[derive(Debug, Clone)]
pub struct TrialUnbalance {
    /// `static`, `couple` or `own`.
    pub name: &'static str,
    /// Phasor of each plane of the rotor.
    pub planes_kg_m: Vec<C>,
}

/// One probe's answer to one trial.
#[derive(Debug, Clone)]
pub struct ProbeResponse {
    pub probe: String,
    /// Speed in rpm and phasor in m, the peaks among them; NaN in a gap around an undamped critical speed.
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

/// The unbalance that the planes of the rotor state; `None` where none does.
pub fn own(rotor: &Rotor) -> Option<TrialUnbalance> {
    let stated = rotor.plane.iter().any(|p| p.unbalance_g_mm.is_some());
    let phasor = |p: &Plane| phasor_kg_m(p.unbalance_g_mm.unwrap_or(0.0), p.angle_deg.unwrap_or(0.0));
    stated.then(|| TrialUnbalance { name: "own", planes_kg_m: rotor.plane.iter().map(phasor).collect() })
}

/// A critical speed without enough damping to state an amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct UndampedCritical {
    pub speed_rad_s: f64,
    /// Whether unbalance excites it.
    pub is_excited: bool,
    /// As [`Peak::margin_percent`]; `None` also where unbalance does not excite it.
    pub margin_percent: Option<[f64; 2]>,
}

/// Critical speeds that unbalance excites.
fn resonances(critical: &[Mode]) -> Vec<Resonance> {
    let of = |m: &&Mode| m.has_amplitude() && m.can_resonate() && m.forward_share() > EXCITED;
    let resonance =
        |m: &Mode| Resonance { speed_rpm: rpm(m.speed_rad_s), half_width_rpm: rpm(m.eigenvalue.re.abs()) };
    critical.iter().filter(of).map(resonance).collect()
}

/// Those of the critical speeds that have no amplitude.
pub fn undamped(critical: &[Mode], running_rpm: Option<[f64; 2]>) -> Vec<UndampedCritical> {
    let of = |m: &Mode| {
        let is_excited = m.forward_share() > EXCITED;
        let margin = |range| margin_percent(rpm(m.speed_rad_s), f64::INFINITY, range);
        UndampedCritical {
            speed_rad_s: m.speed_rad_s,
            is_excited,
            margin_percent: running_rpm.filter(|_| is_excited).map(margin),
        }
    };
    critical.iter().filter(|m| !m.has_amplitude()).map(of).collect()
}

/// Speeds at which curves are drawn: evenly to the fastest, closer around the critical ones, rad/s.
pub fn speeds_rad_s(fastest_rad_s: f64, critical: &[Mode]) -> Vec<f64> {
    let mut speeds: Vec<f64> = (1..=SPEEDS).map(|k| fastest_rad_s * k as f64 / SPEEDS as f64).collect();
    for mode in critical {
        let half = -mode.eigenvalue.re;
        let reach = (3.0 * half).min(0.9 * mode.speed_rad_s);
        if mode.has_amplitude() && half > 0.0 {
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

/// What responses are asked for.
pub struct ResponseRequest<'a> {
    pub trial: &'a TrialUnbalance,
    /// Speeds of the curves, ascending.
    pub speeds_rad_s: &'a [f64],
    /// Damped critical speeds: those that peaks are resonances of, and those without damping, around which curves have a
    /// gap.
    pub critical: &'a [Mode],
    pub running_rpm: Option<[f64; 2]>,
}

/// Every probe's response over speed, with its peaks.
pub fn responses(rotor: &Rotor, system: &System, asked: &ResponseRequest) -> Vec<ProbeResponse> {
    let at = |speed: &f64| probes_at(system, *speed, &asked.trial.planes_kg_m).ok();
    let undamped = || asked.critical.iter().filter(|m| !m.has_amplitude());
    let in_gap = |speed: &f64| undamped().any(|c| (speed - c.speed_rad_s).abs() < GAP * c.speed_rad_s);
    let resonances = resonances(asked.critical);
    let rows: Vec<Option<Vec<C>>> =
        asked.speeds_rad_s.par_iter().map(|s| if in_gap(s) { None } else { at(s) }).collect();
    let of = |i: usize| {
        let one = |(speed, row): (&f64, &Option<Vec<C>>)| {
            let y = row.as_ref().map_or(C::new(f64::NAN, f64::NAN), |row| row[i]);
            (rpm(*speed), y)
        };
        let mut points: Vec<(f64, C)> = asked.speeds_rad_s.iter().zip(&rows).map(one).collect();
        let probe_at = |speed_rpm: f64| at(&rad_s(speed_rpm)).map(|row| row[i]);
        let peaks = peaks(
            &points,
            PeakContext { resonances: &resonances, running_rpm: asked.running_rpm, at: &probe_at },
        );
        points.extend(peaks.iter().map(|p| (p.speed_rpm, p.phasor_m)));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        ProbeResponse { probe: rotor.probe[i].name.clone(), peaks, points }
    };
    (0..rotor.probe.len()).into_par_iter().map(of).collect()
}
