//! Two probes of one bearing as forward and backward whirl.
//!
//! Rotation takes x into y, so a forward circle has `y = −i x` and a backward one `y = i x`:
//! `F = (x + i y) / 2`, `B = (x − i y) / 2`, with radii |F| and |B|.

use nalgebra::Complex;
use serde::Serialize;

use super::{C, ComparedValue, ComparedValues};
use crate::machine::drawing::Rotor;

/// Two probes closer to parallel than this many degrees do not span a plane.
const LEAST_ANGLE_DEG: f64 = 5.0;

/// Two probes of one bearing that together see x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbePair {
    pub bearing: usize,
    pub probes: [usize; 2],
    /// x and y (rows) from the two probes (columns).
    to_xy: [[f64; 2]; 2],
}

/// The first two probes of each bearing that are not parallel.
pub fn probe_pairs(rotor: &Rotor) -> Vec<ProbePair> {
    let pair = |bearing: usize| {
        let probes: Vec<usize> =
            (0..rotor.probe.len()).filter(|i| rotor.bearing_of(&rotor.probe[*i]) == Some(bearing)).collect();
        let couples = probes.iter().flat_map(|a| probes.iter().map(move |b| [*a, *b])).filter(|[a, b]| a < b);
        couples.into_iter().find_map(|probes| ProbePair::new(rotor, bearing, probes))
    };
    (0..rotor.bearing.len()).filter_map(pair).collect()
}

impl ProbePair {
    fn new(rotor: &Rotor, bearing: usize, probes: [usize; 2]) -> Option<Self> {
        let [a, b] = probes.map(|i| rotor.probe[i].angle_deg.to_radians());
        let determinant = (b - a).sin();
        if determinant.abs() < LEAST_ANGLE_DEG.to_radians().sin() {
            return None;
        }
        let to_xy = [
            [b.sin() / determinant, -a.sin() / determinant],
            [-b.cos() / determinant, a.cos() / determinant],
        ];
        Some(Self { bearing, probes, to_xy })
    }

    /// Motion in x and y from what the two probes read.
    pub fn xy(&self, read: [Complex<f64>; 2]) -> [Complex<f64>; 2] {
        self.to_xy.map(|[a, b]| read[0] * a + read[1] * b)
    }

    /// Forward and backward whirl from what the two probes read.
    pub fn whirl(&self, read: [Complex<f64>; 2]) -> [Complex<f64>; 2] {
        let [x, y] = self.xy(read);
        [(x + C::i() * y) / 2.0, (x - C::i() * y) / 2.0]
    }

    /// Standard deviation of a component of either whirl; the two have the same.
    fn sigma_m(&self, sigmas_m: [f64; 2]) -> f64 {
        let weight = |j: usize| {
            let forward = C::new(self.to_xy[0][j], self.to_xy[1][j]) / 2.0;
            forward.norm() * sigmas_m[j]
        };
        weight(0).hypot(weight(1))
    }

    /// Every reading in which both probes were there.
    pub(super) fn seen(&self, values: &ComparedValues) -> Vec<MeasuredWhirl> {
        let seen = |row: &Vec<Option<ComparedValue>>| {
            let [a, b] = [row[self.probes[0]]?, row[self.probes[1]]?];
            Some(MeasuredWhirl {
                measured_m: self.whirl([a.measured_m, b.measured_m]),
                model_m: self.whirl([a.model_m, b.model_m]),
                sigma_m: self.sigma_m([a.sigma_m, b.sigma_m]),
            })
        };
        values.0.iter().filter_map(seen).collect()
    }
}

/// Forward and backward whirl in one reading.
pub(super) struct MeasuredWhirl {
    pub measured_m: [C; 2],
    pub model_m: [C; 2],
    pub sigma_m: f64,
}

/// Forward and backward whirl at one bearing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WhirlMisfit {
    pub bearing: String,
    pub probes: [String; 2],
    /// Whirl in the direction of rotation.
    pub forward: WhirlPart,
    pub backward: WhirlPart,
}

/// One direction of whirl; radii and errors are root mean squares over the readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WhirlPart {
    /// Measured radius of the circle, µm.
    pub measured_um: f64,
    /// Radius in the model, µm.
    pub model_um: f64,
    /// Model less measurement, µm.
    pub error_um: f64,
    /// Model less measurement over its standard deviation, a component; the noise alone gives 1.
    pub error_sigmas: f64,
}

impl WhirlMisfit {
    pub(super) fn new(rotor: &Rotor, pair: &ProbePair, values: &ComparedValues) -> Self {
        let seen = pair.seen(values);
        let part = |direction: usize| {
            let rms = |term: &dyn Fn(&MeasuredWhirl) -> f64| {
                (seen.iter().map(term).sum::<f64>() / seen.len().max(1) as f64).sqrt()
            };
            let error2 = |s: &MeasuredWhirl| (s.model_m[direction] - s.measured_m[direction]).norm_sqr();
            WhirlPart {
                measured_um: 1e6 * rms(&|s| s.measured_m[direction].norm_sqr()),
                model_um: 1e6 * rms(&|s| s.model_m[direction].norm_sqr()),
                error_um: 1e6 * rms(&error2),
                error_sigmas: rms(&|s| error2(s) / (2.0 * s.sigma_m * s.sigma_m)),
            }
        };
        Self {
            bearing: rotor.bearing[pair.bearing].name.clone(),
            probes: pair.probes.map(|i| rotor.probe[i].name.clone()),
            forward: part(0),
            backward: part(1),
        }
    }
}
