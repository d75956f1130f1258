//! What changed between two readings of one speed: the vectors, not the unbalance that a model makes of them.
//!
//! Of a cause that changes the trusted vectors z₀ by D and leaves R unexplained of the present ones z (lengths over all
//! probes), D must exceed what noise of both may be, and R be within that; a factor may leave a fifth of D beside:
//!
//! ```text
//! one factor c = Σ z̄₀z / Σ|z₀|²      D = |c − 1|·√Σ|z₀|²             R = √Σ|z − c z₀|²
//! one probe, one bearing             D = √Σ|z − z₀|² of its probes   R = √Σ|z − z₀|² of the other probes
//! ```

use nalgebra::Complex;

use super::evidence::Observation;
use super::noise::{noise_norm_um, square};
use crate::reading::{MAX_PROBES, ProbeVector};
use crate::scalar;
use crate::state::Reason;

/// A factor explains the change of the vectors but for this part of it: ordinary change since the trusted reading, at most as
/// much as the unbalance may change at once. (A probe is blamed only where the others did not change at all: a bearing's
/// change shows at one probe more than at others.)
const UNEXPLAINED: f32 = 0.2;

/// The vectors of a reading against the trusted ones, over the probes that both have.
pub(super) struct Change {
    /// `Σ z̄₀z`, `Σ|z₀|²` and `Σ|z|²`, µm².
    cross: Complex<f32>,
    before_um2: f32,
    now_um2: f32,
    /// `Σ|z − z₀|²`: of all probes, of the one that changed most, and of those at its bearing, µm².
    all_um2: f32,
    probe_um2: f32,
    bearing_um2: f32,
    /// Bits of the same probes.
    all: u8,
    probe: u8,
    bearing: u8,
    /// Sum and greatest of the features' variances, of the trusted vectors and of these, µm².
    noise_before: [f32; 2],
    noise_now: [f32; 2],
}

impl Change {
    /// Against the trusted vectors with the mask of those that there are, and the variance of their noise relative to that
    /// of one reading.
    pub fn new(
        (known, vectors, variance): (u8, &[ProbeVector; MAX_PROBES], f32),
        observed: &Observation,
        bearings: &[u8; MAX_PROBES],
    ) -> Self {
        let mut change = Self {
            cross: Complex::default(),
            before_um2: 0.0,
            now_um2: 0.0,
            all_um2: 0.0,
            probe_um2: -1.0,
            bearing_um2: 0.0,
            all: known & observed.averaged.reading.valid_mask(),
            probe: 0,
            bearing: 0,
            noise_before: [0.0; 2],
            noise_now: [0.0; 2],
        };
        let averaged = &observed.averaged;
        let valid = change.all;
        let both = || {
            let vectors = vectors.iter().zip(averaged.reading.probes());
            vectors.zip(bearings).zip(0_u8..).filter(move |(_, place)| valid >> place & 1 == 1)
        };
        let mut most_bearing = 0;
        for (((before, now), &bearing), place) in both() {
            let (z0, z) = (before.phasor(), now.phasor());
            let change_um2 = (z - z0).norm_sqr();
            change.cross += z0.conj() * z;
            change.before_um2 += z0.norm_sqr();
            change.now_um2 += z.norm_sqr();
            change.all_um2 += change_um2;
            if change_um2 > change.probe_um2 {
                (change.probe_um2, change.probe, most_bearing) = (change_um2, 1 << place, bearing);
            }
            let variances = [(before, variance), (now, averaged.variance)]
                .map(|(vector, share)| share * square(observed.noise.deviation_um(*vector)));
            for ([sum, most], variance) in
                [&mut change.noise_before, &mut change.noise_now].into_iter().zip(variances)
            {
                *sum += 2.0 * variance;
                *most = scalar::greater(*most, variance);
            }
        }
        for (((before, now), &bearing), place) in both() {
            if bearing == most_bearing {
                change.bearing_um2 += (now.phasor() - before.phasor()).norm_sqr();
                change.bearing |= 1 << place;
            }
        }
        change
    }

    /// The factor of all vectors and what it leaves unexplained, µm.
    pub fn common_factor(&self) -> Option<(Complex<f32>, f32)> {
        let factor = self.cross / self.before_um2;
        let left_um =
            scalar::sqrt(scalar::greater(0.0, self.now_um2 - self.cross.norm_sqr() / self.before_um2));
        let way_um = size_of(factor - 1.0) * scalar::sqrt(self.before_um2);
        self.is_explained(factor.norm_sqr(), way_um, left_um, UNEXPLAINED).then_some((factor, left_um))
    }

    /// The mask of one probe or of those of one bearing, and what they leave unexplained, µm.
    pub fn local(&self) -> Option<(u8, f32)> {
        let places = [(self.probe, self.probe_um2), (self.bearing, self.bearing_um2)];
        places.into_iter().find_map(|(mask, um2)| {
            let left_um = scalar::sqrt(scalar::greater(0.0, self.all_um2 - um2));
            let is_local = mask != self.all
                && self.is_explained(1.0, scalar::sqrt(scalar::greater(0.0, um2)), left_um, 0.0);
            is_local.then_some((mask, left_um))
        })
    }

    /// A cause that changes the vectors by `way_um` and leaves `left_um`, of which `unexplained` is the part that may be
    /// beside noise; the trusted ones' noise counts by `square`.
    #[inline(never)] // once in flash
    fn is_explained(&self, square: f32, way_um: f32, left_um: f32, unexplained: f32) -> bool {
        let ([before_sum, before_most], [sum, most]) = (self.noise_before, self.noise_now);
        let noise_um = noise_norm_um(square * before_sum + sum, square * before_most + most);
        way_um > noise_um && left_um <= noise_um + unexplained * way_um
    }
}

/// [`Reason::Keyphasor`] if a factor turns more than it stretches: its chord `2 sin(φ/2)` on the unit circle against
/// `2 sinh(ln ρ/2)`, which are φ and ln ρ where they are small.
pub(super) fn reason_of(factor: Complex<f32>) -> Reason {
    let size = size_of(factor);
    let chord = size_of(factor / size - 1.0);
    if chord > (size - 1.0).abs() / scalar::sqrt(size) { Reason::Keyphasor } else { Reason::Scale }
}

pub(super) fn size_of(number: Complex<f32>) -> f32 {
    scalar::length([number.re, number.im])
}
