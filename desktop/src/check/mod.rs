//! What a machine's drawing alone says, before anything is measured on it: weight and loads, critical speeds,
//! damped modes, the response to a trial unbalance, and numbers that can hardly be meant.
//!
//! | module | holds |
//! |---|---|
//! | [`system`] | the machine turning at a speed: mass, damping, stiffness |
//! | [`crate::model::chain`] | all finite elements as a chain of nodes |
//! | [`critical`] | undamped critical speeds and their map over bearing stiffness |
//! | [`modes`] | damped eigenvalues with shapes and sense of whirl |
//! | [`campbell`] | modes over speed, damped critical speeds, threshold of instability |
//! | [`unbalance`] | assumed and own unbalance, forced response |
//! | [`peaks`] | maxima of the response, amplification factors, separation margins |
//! | [`plausibility`] | warnings |

pub mod campbell;
pub mod critical;
pub mod modes;
pub mod peaks;
pub mod plausibility;
pub mod system;
#[cfg(test)]
mod tests;
pub mod unbalance;

use crate::bearing::Law;
use crate::bearing::constant::Coefficients;
use crate::bearing::dynamic_coefficients::DynamicCoefficients;
use crate::bearing::film_law::FilmLaw;
use crate::error::Error;
use crate::machine::drawing::{Bearing, Mount, Plane, Probe, Rotor};
use crate::model::terms::Support;
use crate::shaft::statics::{Statics, statics};
use crate::units::{rad_s, rpm};
use campbell::{Campbell, Threshold};
use critical::{Critical, CriticalMap};
use modes::Mode;
use peaks::Peak;
use system::System;
use unbalance::{ProbeResponse, ResponseRequest, TrialUnbalance, UndampedCritical};

/// Speeds of the range that modes are given at.
const SPEEDS: usize = 25;
/// Speeds from rest to the end of the responses that modes are followed over, beside those of the range.
const SURVEYED: usize = 32;
/// The first of them, as a share of the end and of the first critical speed.
const SLOWEST: f64 = 1.0 / 240.0;
const BELOW_FIRST: f64 = 0.5;
/// Modes up to this many times the fastest speed are in it.
const FREQUENCIES: f64 = 2.0;
/// Unbalance responses run to this many times the fastest speed, past any margin that is asked for.
const BEYOND: f64 = 1.3;
/// How far past its rated speeds a machine is looked at: beyond the margin that API 617 asks for.
const PAST_RATED: f64 = 1.25;
/// Without a stated speed the machine is looked at up to this many times its second critical speed.
const PAST_SECOND: f64 = 1.3;

/// What the bearing does at a speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedCheck {
    pub speed_rpm: f64,
    pub stiffness_n_m: Coefficients,
    pub damping_n_s_m: Coefficients,
    /// Eccentricity over clearance of the shaft in the film; `None` for a bearing without one.
    pub eccentricity_ratio: Option<f64>,
    /// Angle from the load to the line of centres, degrees.
    pub attitude_deg: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct BearingCheck {
    pub name: String,
    /// Static load, N; `None` where the shaft's weight cannot be shared out.
    pub load_n: Option<f64>,
    /// What it does at each speed.
    pub at: Vec<SpeedCheck>,
}

/// The unbalance that a machine is tried with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CheckUnbalance {
    /// Twice what its grade or API 617 permits.
    #[default]
    Assumed,
    /// That which the planes of its file state.
    Own,
}

/// Everything that a drawing says.
pub struct Check {
    /// The rotor that was looked at: with a plane at each disk and two probes at each bearing where the file
    /// has none.
    pub rotor: Rotor,
    /// Speeds that were looked at, rpm.
    pub range_rpm: [f64; 2],
    /// Speeds that the machine runs at, to which margins are given, rpm; `None` where nothing states them.
    pub running_rpm: Option<[f64; 2]>,
    /// Loads and sag; `Err` with the reason where the weight cannot be shared out.
    pub statics: Result<Statics, Error>,
    pub mass_kg: f64,
    /// Centre of gravity from the left end, m.
    pub centre_of_gravity_m: f64,
    /// Places along the shaft that modes are given at, m.
    pub stations_m: Vec<f64>,
    pub critical: Vec<Critical>,
    /// Their map over bearing stiffness.
    pub map: CriticalMap,
    /// Damped modes from rest to the end of the responses.
    pub campbell: Campbell,
    /// Numbers of its speeds that lie evenly over the range.
    pub range_speeds: Vec<usize>,
    /// Damped critical speeds up to the end of the responses.
    pub damped_critical: Vec<Mode>,
    /// Those without enough damping to state an amplitude.
    pub undamped_critical: Vec<UndampedCritical>,
    /// Whether no mode has enough damping to state an amplitude.
    pub is_undamped: bool,
    /// Where the machine becomes unstable, from the first speed of the range to the end of the responses.
    pub threshold: Option<Threshold>,
    /// Unbalances and the responses to them; a machine that is unstable or undamped has no peaks there.
    pub responses: Vec<(TrialUnbalance, Vec<ProbeResponse>)>,
    /// Bearings in the order of the file.
    pub bearings: Vec<BearingCheck>,
    /// Numbers that can hardly be meant.
    pub warnings: Vec<String>,
}

/// Looks a machine over; `running_rpm` is the range it runs in, if it is not that of `[rated]`. Both ends may be one speed,
/// and zero.
///
/// # Errors
/// If the shaft cannot be solved, as with a negative mass, or if the planes state no unbalance of their own.
pub fn check(
    rotor: &Rotor,
    running_rpm: Option<[f64; 2]>,
    unbalance: CheckUnbalance,
) -> Result<Check, Error> {
    let rotor = completed(rotor);
    let system = System::new(&rotor)?;
    let range_rpm = running_rpm.unwrap_or_else(|| default_range_rpm(&rotor, &system));
    let running_rpm = running_rpm.or(rotor.rated.map(|rated| rated.speed_rpm));
    let [from, to] = range_rpm.map(rad_s);
    let statics = statics(&rotor, &rotor.elevations_m());
    let (mass_kg, centre_of_gravity_m) = match &statics {
        Ok(s) => (s.mass_kg, s.centre_of_gravity_m),
        Err(_) => crate::shaft::statics::mass_and_centre(&rotor),
    };
    let critical = critical::critical_speeds(&system, FREQUENCIES * to, 3);
    let map = critical::map(&system, to);
    let speeds = range_speeds(from, to);
    let first = critical.first().map(|c| c.speed_rad_s);
    let campbell = Campbell::new(&system, &surveyed(&speeds, BEYOND * to, first), FREQUENCIES * to)?;
    let range_speeds: Vec<usize> = speeds.iter().filter_map(|s| campbell.at(*s)).collect();
    let damped_critical = campbell.damped_critical_speeds(&system);
    let undamped_critical = unbalance::undamped(&damped_critical, running_rpm);
    let is_undamped = campbell.is_undamped();
    let threshold = campbell.threshold(&system, range_speeds.first().copied().unwrap_or_default());
    let trials = trials(&rotor, unbalance, [mass_kg, centre_of_gravity_m], range_rpm[1])?;
    let curve = unbalance::speeds_rad_s(BEYOND * to, &damped_critical);
    let respond = |trial: TrialUnbalance| {
        let asked =
            ResponseRequest { trial: &trial, speeds_rad_s: &curve, critical: &damped_critical, running_rpm };
        let mut answers = unbalance::responses(&rotor, &system, &asked);
        let is_steady = |p: &Peak| !is_undamped && campbell.is_steady(rad_s(p.speed_rpm), threshold.as_ref());
        answers.iter_mut().for_each(|a| a.peaks.retain(is_steady));
        (trial, answers)
    };
    let responses = trials.into_iter().map(respond).collect();
    let critical_rad_s: Vec<f64> = critical.iter().map(|c| c.speed_rad_s).collect();
    let known = plausibility::CheckContext {
        rotor: &rotor,
        system: &system,
        statics: statics.as_ref().ok(),
        mass_kg,
        fastest_rpm: range_rpm[1],
        critical_rad_s: &critical_rad_s,
    };
    let mut warnings = plausibility::warnings(&known);
    if let Err(why) = &statics {
        warnings.push(format!("[[bearing]] position_m: {why}."));
    }
    let bearings = bearings(&rotor, &system, statics.as_ref().ok(), &speeds);
    let stations_m = system.model.structure.stations.iter().map(|s| s.position_m).collect();
    Ok(Check {
        range_rpm,
        running_rpm,
        statics,
        mass_kg,
        centre_of_gravity_m,
        stations_m,
        critical,
        map,
        campbell,
        range_speeds,
        damped_critical,
        undamped_critical,
        is_undamped,
        threshold,
        responses,
        bearings,
        warnings,
        rotor,
    })
}

impl Check {
    /// Modes at the fastest speed of the range.
    pub fn fastest_modes(&self) -> &[Mode] {
        self.range_speeds.last().map_or(&[], |k| &self.campbell.modes[*k])
    }

    /// Rates of growth at the fastest speed of the range of the roots that do not oscillate, rad/s.
    pub fn fastest_real_rad_s(&self) -> &[f64] {
        self.range_speeds.last().map_or(&[], |k| &self.campbell.real_rad_s[*k])
    }
}

/// The unbalances that a machine of this mass (kg) and centre of gravity (m) is tried with.
fn trials(
    rotor: &Rotor,
    unbalance: CheckUnbalance,
    [mass_kg, centre_m]: [f64; 2],
    fastest_rpm: f64,
) -> Result<Vec<TrialUnbalance>, Error> {
    match unbalance {
        CheckUnbalance::Own => Ok(vec![unbalance::own(rotor).ok_or(Error::NoOwnUnbalance)?]),
        CheckUnbalance::Assumed if fastest_rpm > 0.0 => {
            Ok(unbalance::trials(rotor, mass_kg, centre_m, fastest_rpm))
        }
        // at rest no unbalance is too large
        CheckUnbalance::Assumed => Ok(Vec::new()),
    }
}

/// Speeds that lie evenly over a range, one if it is a single speed.
fn range_speeds(from: f64, to: f64) -> Vec<f64> {
    let mut speeds: Vec<f64> =
        (0..SPEEDS).map(|k| from + (to - from) * k as f64 / (SPEEDS - 1) as f64).collect();
    speeds.dedup();
    speeds
}

/// These speeds and others from below the first critical speed to the end of the responses.
fn surveyed(range_speeds: &[f64], end: f64, first_critical: Option<f64>) -> Vec<f64> {
    let mut all = range_speeds.to_vec();
    if end > 0.0 {
        let slowest = first_critical.map_or(f64::INFINITY, |w| BELOW_FIRST * w).min(SLOWEST * end);
        let apart = 0.25 * end / SURVEYED as f64;
        let evenly = (1..=SURVEYED).map(|k| end * k as f64 / SURVEYED as f64);
        let others = std::iter::once(slowest).chain(evenly);
        let is_new = |s: &f64| range_speeds.iter().all(|r| (r - s).abs() > apart);
        let is_end = |s: &f64| *s == slowest || *s == end;
        all.extend(others.filter(|s| is_new(s) || is_end(s)));
    }
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// The rotor with planes at its disks (or in the middle) and probes at its bearings where it has none; no mark is
/// new, so the mesh stays.
fn completed(rotor: &Rotor) -> Rotor {
    let mut rotor = rotor.clone();
    if rotor.plane.is_empty() {
        let plane = |name: &str, position_m| Plane {
            name: name.into(),
            position_m,
            unbalance_g_mm: None,
            angle_deg: None,
        };
        rotor.plane = rotor.disk.iter().map(|d| plane(&d.name, d.position_m)).collect();
        if rotor.plane.is_empty() {
            rotor.plane = vec![plane("middle", 0.5 * rotor.length_m())];
        }
    }
    if rotor.probe.is_empty() {
        let pair = |b: &Bearing| {
            [("x", 0.0), ("y", 90.0)].map(|(axis, angle_deg)| Probe {
                name: format!("{} {axis}", b.name),
                bearing: b.name.clone(),
                position_m: b.position_m,
                angle_deg,
                used: true,
                mount: Mount::default(),
                gap: None,
            })
        };
        rotor.probe = rotor.bearing.iter().flat_map(pair).collect();
    }
    rotor
}

/// Past the fastest speed that the machine is made for, up to the fastest of its data, or past the second critical speed.
/// Speeds that a machine is looked at where none are stated: past its rated ones, else as fast as its file was fitted to,
/// else past its second critical speed, rpm.
pub(crate) fn default_range_rpm(rotor: &Rotor, system: &System) -> [f64; 2] {
    let rated = rotor.rated.map(|rated| PAST_RATED * rated.speed_rpm[1]);
    let to = rated.or(rotor.fastest_rpm).unwrap_or_else(|| {
        let first = critical::critical_speeds(system, 0.0, 2);
        let second = first.last().map_or(1000.0, |c| rpm(c.speed_rad_s) * PAST_SECOND);
        let round = 10_f64.powf(second.log10().floor()) / 4.0;
        (second / round).ceil() * round
    });
    let first = critical::critical_speeds(system, 0.0, 1);
    let below_first = first.first().map_or(f64::INFINITY, |c| BELOW_FIRST * rpm(c.speed_rad_s));
    [(to / SPEEDS as f64).min(below_first), to]
}

fn bearings(
    rotor: &Rotor,
    system: &System,
    statics: Option<&Statics>,
    speeds_rad_s: &[f64],
) -> Vec<BearingCheck> {
    let four = |m: nalgebra::Matrix2<f64>| Coefficients { xx: m.m11, yy: m.m22, xy: m.m12, yx: m.m21 };
    let of = |(i, (b, support)): (usize, (&Bearing, &Support))| {
        let film = match &b.law {
            Law::Film(law) => Some(law),
            _ => None,
        };
        let curve = film.map(FilmLaw::curve);
        let at = |speed: &f64| {
            let DynamicCoefficients { stiffness: k, damping: c } = support.law.coefficients(*speed);
            let state = curve.as_ref().and_then(|c| c.state(*speed).ok());
            SpeedCheck {
                speed_rpm: rpm(*speed),
                stiffness_n_m: four(k),
                damping_n_s_m: four(c),
                eccentricity_ratio: state.map(|s| s.eccentricity_ratio),
                attitude_deg: state.map(|s| s.attitude_deg),
            }
        };
        // a film may state its load; then that is what it carries
        let stated = film.filter(|f| !f.carries_weight()).map(FilmLaw::load_n);
        BearingCheck {
            name: b.name.clone(),
            load_n: stated.or(statics.map(|s| s.load_n[i])),
            at: speeds_rad_s.iter().map(at).collect(),
        }
    };
    rotor.bearing.iter().zip(&system.model.supports).enumerate().map(of).collect()
}
