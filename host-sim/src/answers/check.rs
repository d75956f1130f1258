//! Answer of `check`.

use rotor_edge_desktop::check::modes::Mode;
use rotor_edge_desktop::check::peaks::Peak;
use rotor_edge_desktop::check::unbalance::{ProbeResponse, TrialUnbalance, UndampedCritical};
use rotor_edge_desktop::check::{BearingCheck, Check, SpeedCheck};
use rotor_edge_desktop::grade::permissible_g_mm;
use rotor_edge_desktop::machine::drawing::{Plane, Rotor};
use rotor_edge_desktop::units::{rad_s, rpm};
use serde::Serialize;

use super::shared::{PlaneUnbalance, ZERO_TO_PEAK};

/// What a machine's drawing alone says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckAnswer {
    pub name: String,
    pub mass_kg: f64,
    /// From the left end.
    pub centre_of_gravity_m: f64,
    /// None where the weight cannot be shared out.
    pub largest_sag_m: Option<f64>,
    pub range_rpm: [f64; 2],
    /// Speeds that margins refer to; None where neither the command nor the rotor states them.
    pub running_range_rpm: Option<[f64; 2]>,
    /// stable, unstable or not_judged, in the range.
    pub stability: &'static str,
    /// Whether no mode has enough damping to state an amplitude.
    pub undamped: bool,
    /// Undamped.
    pub critical_speeds_rpm: Vec<f64>,
    /// The share of the motion that turns forward.
    pub critical_speeds_forward: Vec<f64>,
    /// Within the range.
    pub damped_critical_speeds: Vec<ModeAnswer>,
    /// Below the range, and above it up to 1.3 times the fastest speed.
    pub damped_critical_speeds_outside: Vec<ModeAnswer>,
    /// Critical speeds of modes without damping.
    pub critical_speeds_without_amplitude: Vec<WithoutAmplitude>,
    pub critical_speed_map: CriticalSpeedMap,
    /// At 25 speeds of the range, ascending; of a range of one speed, at this one.
    pub modes: Vec<ModeAnswer>,
    /// Roots that do not oscillate, at the fastest speed, as rates of growth; negative for decay.
    pub overdamped_roots_rad_s: Vec<f64>,
    /// From the slowest speed of the range to 1.3 times the fastest.
    pub stability_threshold: Option<StabilityThreshold>,
    pub bearings: Vec<CheckedBearing>,
    pub unbalance: Vec<TrialResponse>,
    pub warnings: Vec<String>,
}

/// A damped mode at a speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeAnswer {
    pub speed_rpm: f64,
    pub frequency_rpm: f64,
    /// Negative for a mode that grows, zero for an undamped one.
    pub log_decrement: f64,
    /// forward, backward or mixed.
    pub whirl: &'static str,
}

/// A critical speed that has no amplitude; margins are in percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WithoutAmplitude {
    pub speed_rpm: f64,
    /// Whether unbalance excites it.
    pub excited: bool,
    /// Distance from the running range; negative inside.
    pub margin_percent: Option<f64>,
    /// As API 617 asks of a peak without damping.
    pub needed_percent: Option<f64>,
    pub margin_kept: Option<bool>,
}

/// Forward critical speeds if every bearing had this stiffness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CriticalSpeedMap {
    pub stiffness_n_m: Vec<f64>,
    /// Mean stiffness as drawn.
    pub own_n_m: f64,
    pub speeds_rpm: Vec<Vec<f64>>,
}

/// Where the machine becomes unstable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StabilityThreshold {
    pub speed_rpm: f64,
    /// Zero for a root that grows without oscillation.
    pub frequency_rpm: f64,
    /// Whether it is unstable at the first speed of the range already.
    pub from_the_first: bool,
}

/// A bearing, its static load and what it is over speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedBearing {
    pub name: String,
    pub load_n: Option<f64>,
    /// At the fastest speed.
    pub eccentricity_ratio: Option<f64>,
    /// At the fastest speed.
    pub attitude_deg: Option<f64>,
    pub coefficients: Vec<CoefficientsAnswer>,
}

/// A bearing at a speed: k in N/m, c in N·s/m.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoefficientsAnswer {
    pub speed_rpm: f64,
    pub kxx: f64,
    pub kxy: f64,
    pub kyx: f64,
    pub kyy: f64,
    pub cxx: f64,
    pub cxy: f64,
    pub cyx: f64,
    pub cyy: f64,
    pub eccentricity_ratio: Option<f64>,
    pub attitude_deg: Option<f64>,
}

/// The response to an assumed unbalance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialResponse {
    /// static, couple or own.
    pub trial: &'static str,
    /// What the unbalance is: balance_grade or api_617, twice as much as permitted; or rotor_file.
    pub basis: &'static str,
    pub planes: Vec<PlaneUnbalance>,
    pub probes: Vec<ProbePeaks>,
}

/// Resonances that a probe sees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProbePeaks {
    pub name: String,
    pub peaks: Vec<PeakAnswer>,
}

/// A resonance; margins are in percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PeakAnswer {
    pub speed_rpm: f64,
    /// Zero to peak.
    pub amplitude_um: f64,
    /// What `amplitude_um` is: zero to peak.
    pub amplitude_convention: &'static str,
    pub amplitude_um_pk_pk: f64,
    /// Critical speed of the mode that resonates; None for a maximum between resonances.
    pub critical_speed_rpm: Option<f64>,
    /// By the half-power points; None where one is not reached, or without a resonance.
    pub amplification: Option<f64>,
    /// Distance from the running range; negative inside. None where no margin is needed.
    pub margin_percent: Option<f64>,
    /// As API 617 asks.
    pub needed_percent: Option<f64>,
    pub margin_kept: Option<bool>,
}

impl CheckAnswer {
    /// The modes at the fastest speed of the range, by rising frequency.
    pub fn fastest_modes(&self) -> impl Iterator<Item = &ModeAnswer> {
        let fastest_rpm = self.range_rpm[1];
        self.modes.iter().filter(move |m| (m.speed_rpm - fastest_rpm).abs() <= 1e-9 * fastest_rpm)
    }
}

impl TrialResponse {
    /// The largest unbalance of a plane; the trial has the same at each.
    pub fn each_g_mm(&self) -> f64 {
        self.planes.iter().map(|p| p.unbalance_g_mm).fold(0.0, f64::max)
    }
}

/// stable, unstable or not_judged: a mode without damping is neither.
fn stability(found: &Check) -> &'static str {
    let fastest_rad_s = rad_s(found.range_rpm[1]);
    if found.threshold.as_ref().is_some_and(|t| t.from_the_first || t.speed_rad_s <= fastest_rad_s) {
        return "unstable";
    }
    let mut modes = found.range_speeds.iter().flat_map(|k| &found.campbell.modes[*k]);
    if modes.any(Mode::is_undamped) { "not_judged" } else { "stable" }
}

impl From<&Check> for CheckAnswer {
    fn from(found: &Check) -> Self {
        let statics = found.statics.as_ref().ok();
        let [from, to] = found.range_rpm.map(rad_s);
        let in_range = |m: &&Mode| (from..=to).contains(&m.speed_rad_s);
        let (inside, outside): (Vec<&Mode>, Vec<&Mode>) = found.damped_critical.iter().partition(in_range);
        let answers = |modes: Vec<&Mode>| modes.into_iter().map(ModeAnswer::from).collect();
        Self {
            name: found.rotor.name.clone(),
            mass_kg: found.mass_kg,
            centre_of_gravity_m: found.centre_of_gravity_m,
            largest_sag_m: statics.map(|s| s.sag_m.iter().copied().fold(0.0, f64::max)),
            range_rpm: found.range_rpm,
            running_range_rpm: found.running_rpm,
            stability: stability(found),
            undamped: found.is_undamped,
            critical_speeds_rpm: found.critical.iter().map(|c| rpm(c.speed_rad_s)).collect(),
            critical_speeds_forward: found.critical.iter().map(|c| c.forward).collect(),
            damped_critical_speeds: answers(inside),
            damped_critical_speeds_outside: answers(outside),
            critical_speeds_without_amplitude: (found.undamped_critical.iter())
                .map(WithoutAmplitude::from)
                .collect(),
            critical_speed_map: CriticalSpeedMap {
                stiffness_n_m: found.map.stiffness_n_m.clone(),
                own_n_m: found.map.own_n_m,
                speeds_rpm: (found.map.speed_rad_s.iter())
                    .map(|all| all.iter().copied().map(rpm).collect())
                    .collect(),
            },
            modes: (found.range_speeds.iter())
                .flat_map(|k| &found.campbell.modes[*k])
                .map(ModeAnswer::from)
                .collect(),
            overdamped_roots_rad_s: found.fastest_real_rad_s().to_vec(),
            stability_threshold: found.threshold.as_ref().map(|t| StabilityThreshold {
                speed_rpm: rpm(t.speed_rad_s),
                frequency_rpm: rpm(t.frequency_rad_s),
                from_the_first: t.from_the_first,
            }),
            bearings: found.bearings.iter().map(CheckedBearing::from).collect(),
            unbalance: (found.responses.iter())
                .map(|(trial, responses)| TrialResponse::of(&found.rotor, trial, responses))
                .collect(),
            warnings: found.warnings.clone(),
        }
    }
}

impl From<&Mode> for ModeAnswer {
    fn from(m: &Mode) -> Self {
        Self {
            speed_rpm: rpm(m.speed_rad_s),
            frequency_rpm: rpm(m.frequency_rad_s()),
            log_decrement: m.log_decrement(),
            whirl: m.whirl.name(),
        }
    }
}

impl From<&UndampedCritical> for WithoutAmplitude {
    fn from(c: &UndampedCritical) -> Self {
        Self {
            speed_rpm: rpm(c.speed_rad_s),
            excited: c.is_excited,
            margin_percent: c.margin_percent.map(|m| m[0]),
            needed_percent: c.margin_percent.map(|m| m[1]),
            margin_kept: c.margin_percent.map(|[margin, needed]| margin >= needed),
        }
    }
}

impl From<&BearingCheck> for CheckedBearing {
    fn from(b: &BearingCheck) -> Self {
        // films are stated at the fastest speed that was asked for
        let film = b.at.last();
        Self {
            name: b.name.clone(),
            load_n: b.load_n,
            eccentricity_ratio: film.and_then(|a| a.eccentricity_ratio),
            attitude_deg: film.and_then(|a| a.attitude_deg),
            coefficients: b.at.iter().map(CoefficientsAnswer::from).collect(),
        }
    }
}

impl From<&SpeedCheck> for CoefficientsAnswer {
    fn from(a: &SpeedCheck) -> Self {
        let (k, c) = (a.stiffness_n_m, a.damping_n_s_m);
        Self {
            speed_rpm: a.speed_rpm,
            kxx: k.xx,
            kxy: k.xy,
            kyx: k.yx,
            kyy: k.yy,
            cxx: c.xx,
            cxy: c.xy,
            cyx: c.yx,
            cyy: c.yy,
            eccentricity_ratio: a.eccentricity_ratio,
            attitude_deg: a.attitude_deg,
        }
    }
}

impl TrialResponse {
    fn of(rotor: &Rotor, trial: &TrialUnbalance, responses: &[ProbeResponse]) -> Self {
        let plane = |(p, u): (&Plane, &nalgebra::Complex<f64>)| PlaneUnbalance::of(&p.name, *u);
        let probe = |r: &ProbeResponse| ProbePeaks {
            name: r.probe.clone(),
            peaks: r.peaks.iter().map(PeakAnswer::from).collect(),
        };
        Self {
            trial: trial.name,
            basis: match (trial.name, permissible_g_mm(rotor)) {
                ("own", _) => "rotor_file",
                (_, Some(_)) => "balance_grade",
                (_, None) => "api_617",
            },
            planes: rotor.plane.iter().zip(&trial.planes_kg_m).map(plane).collect(),
            probes: responses.iter().map(probe).collect(),
        }
    }
}

impl From<&Peak> for PeakAnswer {
    fn from(p: &Peak) -> Self {
        Self {
            speed_rpm: p.speed_rpm,
            amplitude_um: p.amplitude_m() * 1e6,
            amplitude_convention: ZERO_TO_PEAK,
            amplitude_um_pk_pk: 2.0 * p.amplitude_m() * 1e6,
            critical_speed_rpm: p.critical_rpm,
            amplification: p.amplification,
            margin_percent: p.margin_percent.map(|m| m[0]),
            needed_percent: p.margin_percent.map(|m| m[1]),
            margin_kept: p.has_margin(),
        }
    }
}
