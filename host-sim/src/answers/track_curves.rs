//! What the page of `track` draws beside the answer; every point is at its day.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::track::{Interval, ReadingEstimate, Track, followed};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};

use super::names::coefficient_names;

type Points = Vec<(f64, f64)>;

/// Curves over the record, and samples of its last day.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackCurves {
    /// Residual of the method that keeps the bearings constant.
    pub residual_fixed_um: Points,
    pub feature_sum_um: Points,
    /// Cosine and sine of each probe in turn.
    pub features: Vec<FeatureCurve>,
    pub planes: Vec<PlaneCurve>,
    /// Followed numbers of the bearings in the order of phase I.
    pub coefficients: Vec<CoefficientCurve>,
    /// Samples of the last day, of methods that sample.
    pub posterior: Vec<PosteriorSamples>,
}

/// Cosine or sine component at a probe, µm.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureCurve {
    /// The probe and the component.
    pub name: String,
    pub bearing: String,
    pub measured: Points,
    pub calculated: Points,
}

/// A quantity with the ends of its 95 % interval on the days on which the method states one.
#[derive(Debug, Clone, PartialEq)]
pub struct BandedCurve {
    pub points: Points,
    /// Day, lower and upper end.
    pub interval_95: Vec<[f64; 3]>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct PlaneCurve {
    pub name: String,
    pub size_g_mm: BandedCurve,
    pub angle_deg: BandedCurve,
}

/// A bearing coefficient in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientCurve {
    pub name: String,
    pub unit: &'static str,
    pub curve: BandedCurve,
}

/// Where the samples of a quantity lie on the last day.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorSamples {
    pub name: String,
    pub unit: &'static str,
    pub values: Vec<f64>,
}

impl TrackCurves {
    pub fn of(rotor: &Rotor, record: &[Reading], track: &Track) -> Self {
        let all = &track.estimates;
        Self {
            residual_fixed_um: over_time(&track.fixed, |e| e.residual.e_um),
            feature_sum_um: over_time(all, |e| e.residual.f_um),
            features: features(rotor, record, track),
            planes: (0..rotor.plane.len()).map(|j| PlaneCurve::of(rotor, all, j)).collect(),
            coefficients: coefficients(rotor)
                .enumerate()
                .map(|(i, (name, unit, factor))| CoefficientCurve {
                    name,
                    unit,
                    curve: BandedCurve::of(
                        all,
                        |e| e.logs[i].exp() * factor,
                        |e| {
                            let log = e.spread.as_ref()?.logs[i];
                            Some([log.low.exp() * factor, log.high.exp() * factor])
                        },
                    ),
                })
                .collect(),
            posterior: posterior(rotor, track),
        }
    }
}

fn over_time(estimates: &[ReadingEstimate], value: impl Fn(&ReadingEstimate) -> f64) -> Points {
    estimates.iter().map(|e| (e.time_d, value(e))).collect()
}

/// Names of the coefficients with the unit that they are drawn in and its factor.
fn coefficients(rotor: &Rotor) -> impl Iterator<Item = (String, &'static str, f64)> {
    let numbers = followed(rotor).into_iter();
    coefficient_names(rotor).into_iter().zip(numbers).map(|(name, number)| match number.law.unit {
        "N/m" => (name, "MN/m", 1e-6),
        "N·s/m" => (name, "kN·s/m", 1e-3),
        unit => (name, unit, 1.0),
    })
}

fn features(rotor: &Rotor, record: &[Reading], track: &Track) -> Vec<FeatureCurve> {
    let mut curves = Vec::new();
    for (p, probe) in rotor.probe.iter().enumerate() {
        for (part, sign) in [("cos", false), ("sin", true)] {
            let take = |y: &nalgebra::Complex<f64>| if sign { -y.im * 1e6 } else { y.re * 1e6 };
            let measured = track
                .estimates
                .iter()
                .filter_map(|e| Some((e.time_d, take(record[e.row].probes[p].as_ref()?))));
            curves.push(FeatureCurve {
                name: format!("{} {part}", probe.name),
                bearing: probe.bearing.clone(),
                measured: measured.collect(),
                calculated: over_time(&track.estimates, |e| take(&e.calculated_m[p])),
            });
        }
    }
    curves
}

impl BandedCurve {
    fn of(
        estimates: &[ReadingEstimate],
        value: impl Fn(&ReadingEstimate) -> f64,
        ends: impl Fn(&ReadingEstimate) -> Option<[f64; 2]>,
    ) -> Self {
        let of = |e: &ReadingEstimate| ends(e).map(|[low, high]| [e.time_d, low, high]);
        Self { points: over_time(estimates, value), interval_95: estimates.iter().filter_map(of).collect() }
    }
}

impl PlaneCurve {
    fn of(rotor: &Rotor, estimates: &[ReadingEstimate], j: usize) -> Self {
        let scaled = |interval: Interval, factor: f64| [interval.low * factor, interval.high * factor];
        let degrees = 180.0 / std::f64::consts::PI;
        Self {
            name: rotor.plane[j].name.clone(),
            size_g_mm: BandedCurve::of(
                estimates,
                |e| g_mm_deg(e.unbalance_kg_m[j])[0],
                |e| Some(scaled(e.spread.as_ref()?.magnitude_kg_m[j], G_MM)),
            ),
            angle_deg: BandedCurve::of(
                estimates,
                |e| g_mm_deg(e.unbalance_kg_m[j])[1],
                |e| Some(scaled(e.spread.as_ref()?.angle_rad[j], degrees)),
            ),
        }
    }
}

fn posterior(rotor: &Rotor, track: &Track) -> Vec<PosteriorSamples> {
    let Some(sampling) = &track.sampling else { return Vec::new() };
    let coefficient = |(i, (name, unit, factor)): (usize, (String, &'static str, f64))| PosteriorSamples {
        name,
        unit,
        values: sampling.last.iter().map(|s| s.logs[i].exp() * factor).collect(),
    };
    let mut all: Vec<PosteriorSamples> = coefficients(rotor).enumerate().map(coefficient).collect();
    for (j, plane) in rotor.plane.iter().enumerate() {
        for (k, symbol, unit) in [(0, "U", "g·mm"), (1, "α", "°")] {
            let values = sampling.last.iter().map(|s| g_mm_deg(s.unbalance_kg_m[j])[k]).collect();
            all.push(PosteriorSamples { name: format!("{symbol} of plane {}", plane.name), unit, values });
        }
    }
    all
}
