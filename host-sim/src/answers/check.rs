//! Answer of `check`.

use rotor_edge_desktop::check::modes::Mode;
use rotor_edge_desktop::check::unbalance::{Peak, ProbeResponse, TrialUnbalance};
use rotor_edge_desktop::check::{BearingCheck, Check, SpeedCheck};
use rotor_edge_desktop::machine::drawing::Plane;
use rotor_edge_desktop::units::rpm;
use serde::Serialize;

use super::shared::PlaneUnbalance;

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
    /// Undamped.
    pub critical_speeds_rpm: Vec<f64>,
    /// The share of the motion that turns forward.
    pub critical_speeds_forward: Vec<f64>,
    /// Within the range.
    pub damped_critical_speeds: Vec<ModeAnswer>,
    pub critical_speed_map: CriticalSpeedMap,
    /// At 25 speeds of the range, ascending.
    pub modes: Vec<ModeAnswer>,
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
    /// Negative for a mode that grows.
    pub log_decrement: f64,
    /// forward, backward or mixed.
    pub whirl: &'static str,
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
    /// static or couple.
    pub trial: &'static str,
    pub planes: Vec<PlaneUnbalance>,
    pub probes: Vec<ProbePeaks>,
}

/// Resonances that a probe sees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProbePeaks {
    pub name: String,
    pub peaks: Vec<PeakAnswer>,
}

/// A resonance; margins are in percent of its speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PeakAnswer {
    pub speed_rpm: f64,
    pub amplitude_um: f64,
    pub amplification: Option<f64>,
    /// Distance from the running range; negative inside.
    pub margin_percent: Option<f64>,
    /// As API 617 asks.
    pub needed_percent: Option<f64>,
}

impl CheckAnswer {
    /// The modes at the fastest speed of the range, by rising frequency.
    pub fn fastest_modes(&self) -> impl Iterator<Item = &ModeAnswer> {
        let fastest_rpm = self.range_rpm[1];
        self.modes.iter().filter(move |m| (m.speed_rpm / fastest_rpm - 1.0).abs() < 1e-9)
    }
}

impl TrialResponse {
    /// The largest unbalance of a plane; the trial has the same at each.
    pub fn each_g_mm(&self) -> f64 {
        self.planes.iter().map(|p| p.unbalance_g_mm).fold(0.0, f64::max)
    }
}

impl From<&Check> for CheckAnswer {
    fn from(found: &Check) -> Self {
        let statics = found.statics.as_ref().ok();
        Self {
            name: found.rotor.name.clone(),
            mass_kg: found.mass_kg,
            centre_of_gravity_m: found.centre_of_gravity_m,
            largest_sag_m: statics.map(|s| s.sag_m.iter().copied().fold(0.0, f64::max)),
            range_rpm: found.range_rpm,
            critical_speeds_rpm: found.critical.iter().map(|c| rpm(c.speed_rad_s)).collect(),
            critical_speeds_forward: found.critical.iter().map(|c| c.forward).collect(),
            damped_critical_speeds: found.damped_critical.iter().map(ModeAnswer::from).collect(),
            critical_speed_map: CriticalSpeedMap {
                stiffness_n_m: found.map.stiffness_n_m.clone(),
                own_n_m: found.map.own_n_m,
                speeds_rpm: (found.map.speed_rad_s.iter())
                    .map(|all| all.iter().copied().map(rpm).collect())
                    .collect(),
            },
            modes: found.campbell.modes.iter().flatten().map(ModeAnswer::from).collect(),
            stability_threshold: found.threshold.as_ref().map(|t| StabilityThreshold {
                speed_rpm: rpm(t.speed_rad_s),
                frequency_rpm: rpm(t.frequency_rad_s),
                from_the_first: t.from_the_first,
            }),
            bearings: found.bearings.iter().map(CheckedBearing::from).collect(),
            unbalance: (found.responses.iter())
                .map(|(trial, responses)| TrialResponse::of(&found.rotor.plane, trial, responses))
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
    fn of(planes: &[Plane], trial: &TrialUnbalance, responses: &[ProbeResponse]) -> Self {
        let plane = |(p, u): (&Plane, &nalgebra::Complex<f64>)| PlaneUnbalance::of(&p.name, *u);
        let probe = |r: &ProbeResponse| ProbePeaks {
            name: r.probe.clone(),
            peaks: r.peaks.iter().map(PeakAnswer::from).collect(),
        };
        Self {
            trial: trial.name,
            planes: planes.iter().zip(&trial.planes_kg_m).map(plane).collect(),
            probes: responses.iter().map(probe).collect(),
        }
    }
}

impl From<&Peak> for PeakAnswer {
    fn from(p: &Peak) -> Self {
        Self {
            speed_rpm: p.speed_rpm,
            amplitude_um: p.amplitude_m * 1e6,
            amplification: p.amplification,
            margin_percent: p.margin_percent.map(|m| m[0]),
            needed_percent: p.margin_percent.map(|m| m[1]),
        }
    }
}
