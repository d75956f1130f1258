//! Answer of `compare`.

use rotor_edge_desktop::compare::{Adequacy, Comparison, WhirlPart};
use rotor_edge_desktop::diagnose::BestFit;
use serde::Serialize;

use super::findings::{DeterminedAnswer, NoiseAnswer};
use super::shared::ZERO_TO_PEAK;

/// A model, at its best bearings and planes, against the data; ``verdict`` is adequate or misses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonAnswer {
    pub readings: usize,
    pub residual_um: ResidualAnswer,
    /// What lengths in µm of the motion are: zero to peak.
    pub amplitude_convention: &'static str,
    pub residual_ratio: f64,
    pub relative_error: f64,
    pub chi2_per_value: f64,
    pub chi2_p_value: f64,
    pub neighbours: NeighboursAnswer,
    pub verdict: &'static str,
    pub noise: NoiseAnswer,
    pub determined: DeterminedAnswer,
    /// Whether the phases are those of a shaft that turns the other way.
    pub reversed: bool,
    pub worst: Option<WorstAnswer>,
    pub by_probe: Vec<ByProbe>,
    pub by_speed: Vec<BySpeed>,
    pub by_run: Vec<ByRun>,
    pub whirl: Vec<WhirlAnswer>,
    pub remarks: Vec<String>,
    /// Probability that noise is all there is; an upper bound where it is below one in a million.
    pub nothing_missing: Option<f64>,
}

/// Σ|model − measured| over all components, µm: of all readings, and of one on average.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResidualAnswer {
    pub sum: f64,
    pub mean: f64,
}

/// How alike neighbouring speeds are missed; noise would be zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NeighboursAnswer {
    pub correlation: f64,
    pub z_score: f64,
    pub p_value: f64,
}

/// The reading that is missed most.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstAnswer {
    pub probe: String,
    pub speed_rpm: f64,
    pub run: Option<String>,
    pub error_um: f64,
    pub error_sigmas: f64,
}

/// A probe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ByProbe {
    pub probe: String,
    pub residual_um: f64,
    pub relative_error: f64,
    pub chi2_per_value: f64,
}

/// A speed of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BySpeed {
    pub run: Option<String>,
    pub speed_rpm: f64,
    pub readings: usize,
    pub residual_um: f64,
    pub chi2_per_value: f64,
}

/// A run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ByRun {
    pub run: Option<String>,
    pub readings: usize,
    pub residual_um: f64,
    pub relative_error: f64,
    pub chi2_per_value: f64,
}

/// Both senses of whirl at a bearing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WhirlAnswer {
    pub bearing: String,
    pub forward: WhirlPartAnswer,
    pub backward: WhirlPartAnswer,
}

/// What turns one way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WhirlPartAnswer {
    pub measured_um: f64,
    pub model_um: f64,
    pub error_um: f64,
    pub error_sigmas: f64,
}

impl ComparisonAnswer {
    /// Of a fitted model and what it leaves of the data.
    pub fn of(c: &Comparison, best: &BestFit) -> Self {
        Self {
            readings: c.readings,
            residual_um: ResidualAnswer { sum: c.residual_um.sum, mean: c.residual_um.mean },
            amplitude_convention: ZERO_TO_PEAK,
            residual_ratio: c.residual_ratio,
            relative_error: c.relative_error,
            chi2_per_value: c.chi2_per_value,
            chi2_p_value: c.chi2_p_value,
            neighbours: NeighboursAnswer {
                correlation: c.neighbours.correlation,
                z_score: c.neighbours.z_score,
                p_value: c.neighbours.p_value,
            },
            verdict: match c.verdict {
                Adequacy::Adequate => "adequate",
                Adequacy::Misses => "misses",
            },
            noise: (&best.scatter).into(),
            determined: DeterminedAnswer::of(&best.determined, c.verdict == Adequacy::Adequate),
            reversed: c.reversed,
            worst: c.worst.as_ref().map(|w| WorstAnswer {
                probe: w.probe.clone(),
                speed_rpm: w.speed_rpm,
                run: w.run.clone(),
                error_um: w.error_um,
                error_sigmas: w.error_sigmas,
            }),
            by_probe: by_probe(c),
            by_speed: by_speed(c),
            by_run: by_run(c),
            whirl: (c.whirl.iter())
                .map(|w| WhirlAnswer {
                    bearing: w.bearing.clone(),
                    forward: (&w.forward).into(),
                    backward: (&w.backward).into(),
                })
                .collect(),
            remarks: best.remarks.clone(),
            nothing_missing: c.nothing_missing,
        }
    }
}

fn by_probe(c: &Comparison) -> Vec<ByProbe> {
    (c.by_probe.iter())
        .map(|p| ByProbe {
            probe: p.probe.clone(),
            residual_um: p.residual_um,
            relative_error: p.relative_error,
            chi2_per_value: p.chi2_per_value,
        })
        .collect()
}

fn by_speed(c: &Comparison) -> Vec<BySpeed> {
    (c.by_speed.iter())
        .map(|s| BySpeed {
            run: s.run.clone(),
            speed_rpm: s.speed_rpm,
            readings: s.readings,
            residual_um: s.residual_um,
            chi2_per_value: s.chi2_per_value,
        })
        .collect()
}

fn by_run(c: &Comparison) -> Vec<ByRun> {
    (c.by_run.iter())
        .map(|r| ByRun {
            run: r.run.clone(),
            readings: r.readings,
            residual_um: r.residual_um,
            relative_error: r.relative_error,
            chi2_per_value: r.chi2_per_value,
        })
        .collect()
}

impl From<&WhirlPart> for WhirlPartAnswer {
    fn from(p: &WhirlPart) -> Self {
        Self {
            measured_um: p.measured_um,
            model_um: p.model_um,
            error_um: p.error_um,
            error_sigmas: p.error_sigmas,
        }
    }
}
