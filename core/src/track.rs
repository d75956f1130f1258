//! Phase II: the unbalance of each plane from each reading, bounded by what it was before.
//!
//! ```text
//!      plane 1                      plane 2
//!         │  U1 = S/2 + D              │  U2 = S/2 − D
//!   ▲─────┼────────────────────────────┼─────▲        S = U1 + U2        static: a force on the shaft
//! bearing 1                            bearing 2      D = (U1 − U2)/2    dynamic: +D at plane 1, −D at plane 2, a couple
//! ```
//!
//! All are vectors `[U cos α, U sin α]` in g·mm. The static unbalance is the sum of all planes; with one plane the dynamic
//! unbalance is zero, with three or four there is no such pair and it is not a number.

mod rounds;
#[cfg(test)]
mod tests;

use core::error::Error;
use core::fmt;

use heapless::Vec;

use crate::fit::BoundedFit;
use crate::model::{MAX_PLANES, Model, Pair};
use crate::polish::{PolishResult, polish, polish_free, polish_warm};
use crate::reading::{MAX_PROBES, ProbeVector, Reading};
use crate::residual::Residual;
use crate::response::{Motion, Response, ResponseError, SupportAmplitudes};
use crate::scalar;
use crate::swarm::{DEFAULT_PARTICLES, SwarmConfig, search};
use rounds::Rounds;

/// Rounds for hardening supports while a plane is held at its bound: what is found there is not yet the machine's unbalance,
/// and the next reading goes on from the amplitudes found.
const ROUNDS_AT_BOUND: u8 = 2;
/// The certificate holds if the gap is at most this part of `Σ|target|`.
const LARGEST_GAP: f32 = 1e-3;

/// How the unbalance is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackConfig {
    /// Moves of the swarm, should it be needed.
    pub swarm: SwarmConfig,
    /// Seed of the swarm; the number of the reading is added.
    pub seed: u64,
    /// Rounds for the amplitudes at hardening supports, at most.
    pub amplitude_rounds: u8,
    /// Change of the amplitudes, relative to the largest, at which the rounds stop.
    pub amplitude_tolerance: f32,
}

impl Default for TrackConfig {
    fn default() -> Self {
        Self { swarm: SwarmConfig::default(), seed: 1, amplitude_rounds: 8, amplitude_tolerance: 1e-4 }
    }
}

/// Why a reading gave no estimate. The tracker is then as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TrackError {
    /// No probe gave a value.
    Incomplete,
    /// The speed is not a number or outside the model's range.
    Speed,
    /// The model has no finite response at this speed.
    Response,
    /// What the probes left show cannot tell the planes: fewer features than unknowns, or a standard deviation beyond the
    /// bound on a plane.
    Undetermined,
    /// The reading has another number of probes than the model.
    ProbeCount,
}

impl fmt::Display for TrackError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Incomplete => "no probe gave a value",
            Self::Speed => "the speed is not a number or outside the model's range",
            Self::Response => "the model has no finite response at this speed",
            Self::Undetermined => {
                "the probes left cannot tell the planes apart: two features are needed for each plane"
            }
            Self::ProbeCount => "the reading has another number of probes than the model",
        })
    }
}

impl Error for TrackError {}

impl From<ResponseError> for TrackError {
    fn from(_: ResponseError) -> Self {
        Self::Response
    }
}

/// The unbalance a reading shows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Estimate {
    /// `[U cos α, U sin α]` of each plane, g·mm; zero for planes that are not there.
    pub unbalance_g_mm: [Pair; MAX_PLANES],
    pub planes: u8,
    /// Static unbalance, the vector sum of the planes, g·mm.
    pub static_g_mm: Pair,
    /// Dynamic unbalance as found at plane 1 (its opposite is at plane 2), g·mm; zero for one plane, NaN for more than two.
    pub dynamic_g_mm: Pair,
    /// Standard deviation of either part of each plane's unbalance that the stated noise alone causes, by
    /// `σ²(HᵀH)⁻¹` with σ that of the noisiest probe, g·mm; NaN if the model states no noise. That is of least squares: least
    /// absolute residuals scatter by a quarter more, by up to three quarters more with twice as many features as unknowns.
    pub deviation_g_mm: [f32; MAX_PLANES],
    /// The same for features of a standard deviation of 1 µm, whatever noise the model states, g·mm per µm.
    pub deviation_g_mm_per_um: [f32; MAX_PLANES],
    /// What the probes would show for this unbalance; [`ProbeVector::LOST`] beyond the model's probes.
    pub calculated: [ProbeVector; MAX_PROBES],
    pub residual: Residual,
    /// The plane's unbalance lies on its bound: it may be greater than stated.
    pub at_bound: [bool; MAX_PLANES],
    /// Features beyond the unknowns; with zero the residual says nothing about the model.
    pub redundancy: u8,
    /// `Σ|calculated − measured|` that would be left without bounds, µm: tells an unbalance that jumped from a model that
    /// no longer fits.
    pub free_residual_um: f32,
    /// The unbalance that would be found without bounds, g·mm.
    pub free_g_mm: [Pair; MAX_PLANES],
    /// The residual lies at most this far above the least within the bounds, µm: proved by the dual problem.
    pub gap_um: f32,
    /// The swarm was needed.
    pub searched: bool,
    /// Rounds spent on the amplitudes at hardening supports (zero without such).
    pub rounds: u8,
}

/// The unbalance last found: the state of phase II.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracker<const PLANES: usize> {
    last_g_mm: [Pair; PLANES],
    planes: u8,
    /// Where the rounds for hardening supports left off; the next reading goes on from there.
    amplitudes: SupportAmplitudes,
    readings: u64,
}

impl<const PLANES: usize> Tracker<PLANES> {
    /// Starts from what phase I found.
    pub fn new<const SHAPES: usize, const PROBES: usize>(model: &Model<SHAPES, PROBES, PLANES>) -> Self {
        Self::resume(model, &model.initial_unbalance_g_mm)
    }

    /// Starts from the unbalance last found (g·mm, one pair a plane), as after a loss of power. Planes that are not given or
    /// not finite start from what phase I found.
    pub fn resume<const SHAPES: usize, const PROBES: usize>(
        model: &Model<SHAPES, PROBES, PLANES>,
        last_g_mm: &[Pair],
    ) -> Self {
        let mut tracker = Self {
            last_g_mm: [[0.0; 2]; PLANES],
            planes: model.planes.len() as u8,
            amplitudes: SupportAmplitudes::default(),
            readings: 0,
        };
        for (place, (own, &initial)) in
            tracker.last_g_mm.iter_mut().zip(&model.initial_unbalance_g_mm).enumerate()
        {
            let last = last_g_mm.get(place).filter(|last| last.iter().all(|part| part.is_finite()));
            *own = last.copied().unwrap_or(initial);
        }
        tracker
    }

    /// The unbalance `[U cos α, U sin α]` of each plane last found, g·mm.
    pub fn last_g_mm(&self) -> &[Pair] {
        self.last_g_mm.get(..usize::from(self.planes)).unwrap_or_default()
    }

    /// For a model whose supports differ: the next reading finds their amplitudes anew.
    pub fn forget_amplitudes(&mut self) {
        self.amplitudes = SupportAmplitudes::default();
    }

    /// The unbalance of least absolute residual within a bound on each plane, which is at least the model's floor.
    ///
    /// `bound_g_mm`: what each plane's unbalance may have grown to. Lost probes are left out.
    ///
    /// Errors: [`TrackError`].
    pub fn update<const SHAPES: usize, const PROBES: usize>(
        &mut self,
        config: &TrackConfig,
        model: &Model<SHAPES, PROBES, PLANES>,
        reading: &Reading,
        bound_g_mm: &[f32; MAX_PLANES],
    ) -> Result<Estimate, TrackError> {
        if reading.probes().len() != model.probes.len() {
            return Err(TrackError::ProbeCount);
        }
        let features = 2 * reading.valid_mask().count_ones() as usize;
        if features == 0 {
            return Err(TrackError::Incomplete);
        }
        if !model.covers(reading.speed_rpm) {
            return Err(TrackError::Speed);
        }
        let unknowns = 2 * model.planes.len();
        let redundancy = features.checked_sub(unknowns).ok_or(TrackError::Undetermined)? as u8;
        self.solve(config, model, reading, bound_g_mm, redundancy)
    }

    #[inline(never)]
    fn solve<const SHAPES: usize, const PROBES: usize>(
        &mut self,
        config: &TrackConfig,
        model: &Model<SHAPES, PROBES, PLANES>,
        reading: &Reading,
        bound_g_mm: &[f32; MAX_PLANES],
        redundancy: u8,
    ) -> Result<Estimate, TrackError> {
        let speed = reading.speed_rad_s();
        let mut bounds: Vec<f32, PLANES> = Vec::new();
        for bound in bound_g_mm.iter().take(model.planes.len()) {
            // Cannot be full: a model has at most so many planes.
            let _ = bounds.push(scalar::greater(model.unbalance_floor_g_mm, *bound));
        }
        let mut rounds = Rounds::new(self.amplitudes);
        let mut start = self.last_g_mm;
        loop {
            let mut motion = Motion::forces(model, speed);
            motion.solve(model, speed, &rounds.amplitudes)?;
            let at_speed = motion.read(model, speed, &rounds.amplitudes);
            at_speed.check()?;
            let fit = BoundedFit::of_reading(&at_speed, reading, &bounds);
            let mut found = if rounds.count == 0 { polish(&fit, start) } else { polish_warm(&fit, start) };
            start = found.unbalance_g_mm;
            let most = if found.at_bound.contains(&true) {
                config.amplitude_rounds.min(ROUNDS_AT_BOUND)
            } else {
                config.amplitude_rounds
            };
            if model.is_nonlinear() && rounds.count < most {
                let aim = motion.support_amplitudes(model, &found.unbalance_g_mm);
                if rounds.advance(&aim, config.amplitude_tolerance) {
                    continue;
                }
            }
            let noisiest_um = model.noise.deviation_um(largest(reading));
            let per_um = fit.deviations_g_mm(1.0);
            let deviation = per_um.map(|per_um| noisiest_um * per_um);
            if deviation
                .iter()
                .zip(&bounds)
                .any(|(deviation, &bound)| bound > 0.0 && (deviation.is_nan() || *deviation > bound))
            {
                return Err(TrackError::Undetermined);
            }
            let searched = !is_certain(&fit, &found);
            if searched {
                let seed = config.seed.wrapping_add(self.readings);
                let start = search::<DEFAULT_PARTICLES, _, _>(&config.swarm, &fit, start, seed);
                let again = polish(&fit, start);
                if again.residual_um <= found.residual_um {
                    found = again;
                }
            }
            if found.free_residual_um.is_nan() {
                (found.free_residual_um, found.free_g_mm) = if found.at_bound.contains(&true) {
                    polish_free(&fit, start)
                } else {
                    (found.residual_um, found.unbalance_g_mm)
                };
            }
            let solved = Solution {
                at_speed: &at_speed,
                found: &found,
                per_um: &per_um,
                noisiest_um,
                rounds: rounds.count,
                searched,
            };
            let estimate = Estimate::new(&solved, model, reading, redundancy)?;
            self.last_g_mm = found.unbalance_g_mm;
            self.amplitudes = rounds.amplitudes;
            self.readings = self.readings.wrapping_add(1);
            return Ok(estimate);
        }
    }
}

/// The longest vector of a reading; of all, it has the most noise.
fn largest(reading: &Reading) -> ProbeVector {
    let used = reading.probes().iter().filter(|probe| probe.is_finite());
    used.fold(ProbeVector { cos_um: 0.0, sin_um: 0.0 }, |most, &probe| {
        if probe.phasor().norm_sqr() > most.phasor().norm_sqr() { probe } else { most }
    })
}

/// What a reading's rounds ended with, left where it was made: copies are dear without a cache.
struct Solution<'a, const PROBES: usize, const PLANES: usize> {
    at_speed: &'a Response<PROBES, PLANES>,
    found: &'a PolishResult<PLANES>,
    /// Deviations for 1 µm of noise.
    per_um: &'a [f32; PLANES],
    noisiest_um: f32,
    rounds: u8,
    searched: bool,
}

impl Estimate {
    fn new<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
        solved: &Solution<'_, PROBES, PLANES>,
        model: &Model<SHAPES, PROBES, PLANES>,
        reading: &Reading,
        redundancy: u8,
    ) -> Result<Self, TrackError> {
        let Solution { at_speed, found, per_um, noisiest_um, rounds, searched } = solved;
        let mut unbalance_g_mm = [[0.0; 2]; MAX_PLANES];
        let mut static_g_mm = [0.0; 2];
        let planes = model.planes.len();
        for (own, &[x, y]) in unbalance_g_mm.iter_mut().zip(&found.unbalance_g_mm).take(planes) {
            *own = [x, y];
            static_g_mm = [static_g_mm[0] + x, static_g_mm[1] + y];
        }
        let mut free_g_mm = [[0.0; 2]; MAX_PLANES];
        let mut deviation_g_mm_per_um = [f32::NAN; MAX_PLANES];
        let free_planes = found.free_g_mm.iter().zip(*per_um).take(planes);
        for ((own, stated), (&free, &per_um)) in
            free_g_mm.iter_mut().zip(&mut deviation_g_mm_per_um).zip(free_planes)
        {
            (*own, *stated) = (free, per_um);
        }
        let noise_um = if model.noise.is_stated() { *noisiest_um } else { f32::NAN };
        let mut calculated = [ProbeVector::LOST; MAX_PROBES];
        for (vector, shown) in calculated.iter_mut().zip(at_speed.vectors(&found.unbalance_g_mm)) {
            *vector = shown;
        }
        let residual = Residual::new(&calculated, reading.probes()).map_err(|_| TrackError::Response)?;
        let [[a, b], [c, d], ..] = unbalance_g_mm;
        Ok(Self {
            unbalance_g_mm,
            planes: planes as u8,
            static_g_mm,
            dynamic_g_mm: match planes {
                1 => [0.0; 2],
                2 => [0.5 * (a - c), 0.5 * (b - d)],
                _ => [f32::NAN; 2],
            },
            deviation_g_mm: deviation_g_mm_per_um.map(|per_um| noise_um * per_um),
            deviation_g_mm_per_um,
            calculated,
            residual,
            at_bound: found.at_bound,
            redundancy,
            free_residual_um: found.free_residual_um,
            free_g_mm,
            gap_um: found.gap_um,
            searched: *searched,
            rounds: *rounds,
        })
    }
}

fn is_certain<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    found: &PolishResult<PLANES>,
) -> bool {
    found.gap_um <= LARGEST_GAP * fit.target_um().iter().fold(0.0, |sum, target| sum + target.abs())
}
