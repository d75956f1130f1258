//! What several unit tests need: random numbers independent of the swarm's, and problems made of them.

use nalgebra::Complex;

use crate::fit::BoundedFit;
use crate::model::Pair;
use crate::reading::{ProbeVector, Reading};

/// A small linear congruential generator (Knuth's MMIX constants).
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Uniform in −1..1.
    pub fn signed(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    /// Uniform between the ends.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + 0.5 * (self.signed() + 1.0) * (high - low)
    }

    /// Uniform in the exponent.
    pub fn log_between(&mut self, low: f32, high: f32) -> f32 {
        self.between(low.ln(), high.ln()).exp()
    }

    fn phasor(&mut self) -> Complex<f32> {
        Complex::new(self.signed(), self.signed())
    }
}

/// Influence of planes on probes that resemble the first plane's by `likeness` (0 to 1), and a target that an unbalance of
/// about 1 explains up to noise; bounds are `bound` times the true unbalance.
pub(crate) fn random_fit_of<const PROBES: usize, const PLANES: usize>(
    random: &mut Random,
    [likeness, bound, noise]: [f32; 3],
    probes: usize,
) -> BoundedFit<PROBES, PLANES> {
    let truth: [Pair; PLANES] = core::array::from_fn(|_| [random.signed(), random.signed()]);
    let rows: std::vec::Vec<_> = (0..probes)
        .map(|_| {
            let first = random.phasor();
            let coefficients: [Complex<f32>; PLANES] = core::array::from_fn(|plane| match plane {
                0 => first,
                _ => (first * likeness + random.phasor() * (1.0 - likeness)) * 0.3,
            });
            let shown = coefficients.iter().zip(&truth).map(|(c, &[x, y])| c * Complex::new(x, y));
            (coefficients, shown.sum::<Complex<f32>>() + random.phasor() * noise)
        })
        .collect();
    BoundedFit::new(rows.into_iter(), &truth.map(|[x, y]| bound * x.hypot(y)))
}

/// Four probes and two planes.
pub(crate) fn random_fit(random: &mut Random, likeness: f32, bound: f32) -> BoundedFit<4, 2> {
    random_fit_of(random, [likeness, bound, 0.2], 4)
}

/// A standard normal number (Box and Muller).
pub(crate) fn normal(random: &mut Random) -> f32 {
    let mut uniform = || 0.5 * (f64::from(random.signed()) + 1.0);
    let radius = (-2.0 * (uniform() + 1e-12).ln()).sqrt();
    (radius * (core::f64::consts::TAU * uniform()).cos()) as f32
}

/// A reading with its parts rounded to a step, µm; without one as a display shows it, amplitudes to 1 µm peak-to-peak and
/// phases to 1°.
pub(crate) fn rounded(reading: &Reading, step_um: Option<f32>) -> Reading {
    let round = |probe: &ProbeVector| match step_um {
        Some(step_um) => {
            let round = |value: f32| (value / step_um).round() * step_um;
            ProbeVector { cos_um: round(probe.cos_um), sin_um: round(probe.sin_um) }
        }
        None => {
            let amplitude_um = 0.5 * probe.peak_to_peak_um().round();
            let (sin, cos) = probe.lag_deg().round().to_radians().sin_cos();
            ProbeVector { cos_um: amplitude_um * cos, sin_um: amplitude_um * sin }
        }
    };
    let vectors: std::vec::Vec<_> = reading.probes().iter().map(round).collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap()
}
