//! What can be mistaken for something else: candidates and unknown causes, as directions of the readings.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::model::PlannedReadings;
use super::noise::PlannedNoise;
use super::noise::orthonormal;
use super::strength::EffectState;
use crate::decomposition::{hermitian, transposed_product};
use crate::error::Error;
use crate::fit::hypothesis::PlacedEffect;
use crate::fit::starts_for;

/// Steps over the size of an unknown cause, and its range: the share of the readings' variance that it makes.
const SIZES: usize = 24;
const SIZE_RANGE: [f64; 2] = [1e-3, 1e4];
/// Directions that show less than this share of the largest are rounding errors.
const LEAST_SIZE: f64 = 1e-6;
/// Largest whitened length of a candidate's direction, relative to the same before the model follows it, that counts as followed.
const FOLLOWED: f64 = 1e-6;

/// An effect at a place that a diagnosis fits to the readings.
pub struct Candidate {
    pub placed: PlacedEffect,
    /// Real unknowns.
    pub unknowns: usize,
    /// Whether there is nothing to fit and it concerns the whole machine, so that its prior is even odds.
    pub is_switch: bool,
    shape: Shape,
}

enum Shape {
    /// Of parameters and phasors: orthonormal directions from each start of the search.
    Spans(Vec<DMatrix<f64>>),
    /// Without any: the one change that it makes.
    Fixed(DVector<f64>),
}

impl Candidate {
    /// `None` if its response cannot be computed.
    pub fn of(planned: &PlannedReadings, placed: PlacedEffect) -> Option<Self> {
        let with = planned.with(placed);
        let base = &planned.base;
        let own = placed.effect.parameters(&with.scales).len();
        let phasors = placed.effect.unknowns(with.rotor, placed.place).len();
        let unknowns = own + 2 * phasors;
        let is_switch = unknowns == 0 && placed.place == crate::effects::Place::Machine;
        if unknowns == 0 {
            let state = EffectState::of_strength(&with, placed, 1.0);
            let change = planned.change(&with, &planned.forward(&with).ok()?, &state)?;
            return Some(Self {
                placed,
                unknowns,
                is_switch,
                shape: Shape::Fixed(planned.signal(change).visible),
            });
        }
        let (drawing, fit) = &base.search;
        let none = EffectState::of_strength(&with, placed, 0.0).coordinates(&with);
        let at: Vec<Vec<f64>> = if none.iter().all(|x| x.is_finite()) {
            // small ones of any strength are alike
            vec![fit.x.iter().copied().chain(none).collect()]
        } else {
            // those of the search, from where the bearings are
            starts_for(&base.hypothesis, fit, placed).into_iter().step_by(2).collect()
        };
        let span = |x: &Vec<f64>| {
            let tangent = base.fitter.tangent(&with, x, drawing, &fit.amplitudes).ok()?;
            let (first, width) = (fit.x.len(), tangent.ncols());
            // search coordinates of the model, of the effect, planes and phasors of the model, of the effect
            let mine = (first..first + own).chain(width - 2 * phasors..width);
            let mine = tangent.select_columns(&mine.collect::<Vec<_>>());
            let before: Vec<f64> = mine.column_iter().map(|c| c.norm()).collect();
            let mut left = planned.unfollowed(mine);
            for (mut column, before) in left.column_iter_mut().zip(before) {
                if column.norm() <= FOLLOWED * before {
                    column.fill(0.0);
                }
            }
            Some(orthonormal(left))
        };
        let spans: Vec<DMatrix<f64>> = at.iter().filter_map(span).collect();
        (!spans.is_empty()).then_some(Self { placed, unknowns, is_switch, shape: Shape::Spans(spans) })
    }

    /// What it leaves of each visible signal at its best, in their noise.
    pub fn left(&self, noise: &PlannedNoise, signals: [&DVector<f64>; 2]) -> [DVector<f64>; 2] {
        let there = |stated: &DMatrix<f64>| noise.unfollowed(noise.of_stated(stated));
        match &self.shape {
            Shape::Fixed(own) => {
                let own = there(&DMatrix::from_columns(std::slice::from_ref(own)));
                signals.map(|visible| visible - own.column(0))
            }
            Shape::Spans(spans) => {
                let spans: Vec<Cow<DMatrix<f64>>> = match noise.is_stated() {
                    true => spans.iter().map(Cow::Borrowed).collect(),
                    false => spans.iter().map(|span| Cow::Owned(orthonormal(there(span)))).collect(),
                };
                signals.map(|visible| {
                    let all = spans.iter().map(|span| visible - &**span * span.tr_mul(visible));
                    all.min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_else(|| visible.clone())
                })
            }
        }
    }

    /// How many directions it has in common with another.
    pub fn common(&self, other: &Self) -> f64 {
        match (&self.shape, &other.shape) {
            (Shape::Spans(a), Shape::Spans(b)) => {
                let pairs = a.first().zip(b.first());
                pairs.map_or(0.0, |(a, b)| a.tr_mul(b).norm_squared())
            }
            _ => 0.0,
        }
    }
}

/// Unknown causes as a diagnosis assumes them: a force or stiffness at some place that follows smooth functions of speed, a drawing
/// that is off.
pub struct UnknownCauses {
    /// In the noise of the readings as stated.
    all: Vec<CauseResponse>,
}

/// What an unknown cause makes of a signal.
#[derive(Debug, Clone, Copy, Default)]
pub struct UnknownEvidence {
    /// Twice its average log evidence over nothing but noise.
    pub evidence: f64,
    /// With W what its most probable size follows of the readings: the squared length of s - W s, and sᵀ W s, of a signal s.
    pub left: f64,
    pub followed: f64,
    /// tr W², the variance that noise gives it.
    pub freedom: f64,
}

/// The same of independent unknowns of one size.
#[derive(Debug, Clone, Copy, Default)]
struct BestSize {
    /// Average gain, and how many of them the readings determine.
    gain: f64,
    determined: f64,
    left: f64,
    followed: f64,
    freedom: f64,
}

/// The readings' response to an unknown cause of unit size, in noise units.
struct CauseResponse {
    /// Response to each orthonormal combination of the unknowns, one a column; the columns are orthogonal.
    columns: DMatrix<f64>,
    /// Length of each column.
    sizes: Vec<f64>,
}

impl CauseResponse {
    /// From the response to each unknown, one a column. Combinations whose response is a rounding error are left out.
    fn of(response: &DMatrix<f64>) -> Self {
        let (combinations, sizes) = combinations(response);
        Self { columns: response * combinations, sizes }
    }
}

/// Orthonormal combinations of unknowns, one a column, whose responses are orthogonal, and the lengths of these.
fn combinations(response: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let nothing = || (DMatrix::zeros(response.ncols(), 0), Vec::new());
    if response.is_empty() {
        return nothing();
    }
    let eigen = hermitian(transposed_product(response, response));
    let sizes = eigen.eigenvalues.map(|square| square.max(0.0).sqrt());
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    if !largest.is_finite() || largest <= 0.0 {
        return nothing();
    }
    let kept: Vec<usize> = (0..sizes.len()).filter(|k| sizes[*k] > LEAST_SIZE * largest).collect();
    (eigen.eigenvectors.select_columns(&kept), kept.iter().map(|k| sizes[*k]).collect())
}

/// What the most probable size of independent unknowns makes of a signal: `along` are products of the signal, of this squared length, with
/// responses of these sizes.
fn best_size(sizes: &[f64], along: &DVector<f64>, squared: f64) -> BestSize {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let [low, high] = SIZE_RANGE;
    let at = |k: usize| {
        let variance = low * (high / low).powf(k as f64 / (SIZES - 1) as f64) * (1.0 + squared);
        let mut best = BestSize { left: squared, ..BestSize::default() };
        for (size, along) in sizes.iter().zip(along.iter()) {
            let own = variance * (size / largest).powi(2);
            let (weight, part) = (own / (1.0 + own), (along / size).powi(2));
            best.gain += weight * (part + 1.0) - own.ln_1p();
            best.determined += weight;
            best.left -= part * weight * (2.0 - weight);
            best.followed += part * weight;
            best.freedom += weight * weight;
        }
        best
    };
    (0..SIZES).map(at).max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap_or_default()
}

impl UnknownCauses {
    /// Beside the model of planned readings.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn of(planned: &PlannedReadings) -> Result<Self, Error> {
        let base = &planned.base;
        let (drawing, fit) = &base.search;
        let assumptions = base.fitter.unknown_causes();
        let shown = base.fitter.shown(&base.hypothesis, fit, drawing, &assumptions)?;
        Ok(Self { all: shown.into_iter().map(|s| CauseResponse::of(&planned.visible(s.response))).collect() })
    }

    /// What an unknown cause makes of a signal.
    pub fn evidence(&self, noise: &PlannedNoise, visible: &DVector<f64>) -> UnknownEvidence {
        let squared = visible.norm_squared();
        let of_one = |stated: &CauseResponse| {
            if noise.is_stated() {
                return best_size(&stated.sizes, &stated.columns.tr_mul(visible), squared);
            }
            let response = noise.unfollowed(noise.of_stated(&stated.columns));
            let (combinations, sizes) = combinations(&response);
            best_size(&sizes, &combinations.tr_mul(&response.tr_mul(visible)), squared)
        };
        let fits: Vec<BestSize> = self.all.iter().map(of_one).collect();
        let best = fits.iter().copied().max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap_or_default();
        let weights: f64 = fits.iter().map(|one| (0.5 * (one.gain - best.gain)).exp()).sum();
        let averaged = 2.0 * (weights / fits.len().max(1) as f64).max(f64::MIN_POSITIVE).ln();
        UnknownEvidence {
            evidence: best.gain - noise.sizes.price_of_one(best.determined) + averaged,
            left: best.left.max(0.0),
            followed: best.followed,
            freedom: best.freedom,
        }
    }
}
