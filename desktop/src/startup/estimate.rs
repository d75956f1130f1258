//! Natural speed and damping of each run with their uncertainty, and what follows from them.

use nalgebra::{Complex, Matrix2, Matrix3, Vector2, Vector3};

use super::circle::circle;
use super::half_power::{HalfPower, half_power};
use super::least_squares::{LeastSquares, least_squares};
use super::series::{Point, ProbeDirection, RunUp};
use super::shaft::ShaftSpring;
use super::{Modal, UncertainValue};

type C = Complex<f64>;

/// The three ways, in the order in which they are listed.
pub const METHODS: [&str; 3] = ["half_power", "circle", "least_squares"];
/// Peaks that differ by less than this share are alike.
const LEAST_SPREAD: f64 = 0.9;

/// Natural speed and damping with the covariance that the noise gives them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalEstimate {
    pub modal: Modal,
    /// Covariance of natural speed (rad/s) and damping ratio.
    pub covariance: Matrix2<f64>,
}

impl ModalEstimate {
    /// An estimate with its covariance: each component is moved by its own standard deviation in turn.
    fn of(points: &[Point], estimate: impl Fn(&[Point]) -> Result<Modal, String>) -> Result<Self, String> {
        let modal = estimate(points)?;
        let mut covariance = Matrix2::zeros();
        let mut moved = points.to_vec();
        for i in 0..points.len() {
            for axis in [C::new(1.0, 0.0), C::new(0.0, 1.0)] {
                moved[i].motion_m = points[i].motion_m + axis * points[i].sigma_m;
                if let Ok(there) = estimate(&moved) {
                    let change = Vector2::new(
                        there.natural_rad_s - modal.natural_rad_s,
                        there.damping_ratio - modal.damping_ratio,
                    );
                    covariance += change * change.transpose();
                }
                moved[i].motion_m = points[i].motion_m;
            }
        }
        Ok(Self { modal, covariance })
    }

    fn vector(&self) -> Vector2<f64> {
        Vector2::new(self.modal.natural_rad_s, self.modal.damping_ratio)
    }

    /// The mean of several, each by its information. Where they differ by more than their noise, so
    /// much more is the mean's uncertainty.
    fn mean(all: &[Self]) -> Option<Self> {
        let (mut information, mut sum) = (Matrix2::zeros(), Vector2::zeros());
        for found in all {
            let own = found.covariance.try_inverse()?;
            information += own;
            sum += own * found.vector();
        }
        let covariance = information.try_inverse()?;
        let mean = covariance * sum;
        let off = |f: &Self| {
            let d = f.vector() - mean;
            f.covariance.try_inverse().map_or(0.0, |i| d.dot(&(i * d)))
        };
        let freedom = 2 * all.len().saturating_sub(1);
        let scatter = if freedom > 0 { all.iter().map(off).sum::<f64>() / freedom as f64 } else { 1.0 };
        let modal = Modal { natural_rad_s: mean[0], damping_ratio: mean[1] };
        Some(Self { modal, covariance: covariance * scatter.max(1.0) })
    }
}

/// One run along one direction, estimated three ways; a sentence where a way is closed.
#[derive(Debug, Clone)]
pub struct RunEstimates {
    pub half_power: Result<(HalfPower, ModalEstimate), String>,
    pub circle: Result<ModalEstimate, String>,
    /// The two-degree model at all speeds.
    pub least_squares: Result<LeastSquares, String>,
}

impl RunEstimates {
    pub fn of(points: &[Point]) -> Self {
        Self {
            half_power: half_power(points).and_then(|marks| {
                Ok((marks, ModalEstimate::of(points, |p| half_power(p).map(|h| h.modal))?))
            }),
            circle: ModalEstimate::of(points, circle),
            least_squares: least_squares(points),
        }
    }

    /// By the number of the method.
    pub fn found(&self, method: usize) -> Option<ModalEstimate> {
        match method {
            0 => self.half_power.as_ref().ok().map(|(_, found)| *found),
            1 => self.circle.as_ref().ok().copied(),
            _ => self.least_squares.as_ref().ok().map(LeastSquares::found),
        }
    }
}

impl LeastSquares {
    /// Natural speed and damping, without the force.
    fn found(&self) -> ModalEstimate {
        let variances = Vector2::new(self.natural_rad_s.sd.powi(2), self.damping_ratio.sd.powi(2));
        ModalEstimate { modal: self.modal(), covariance: Matrix2::from_diagonal(&variances) }
    }
}

/// One sentence for each run and direction in which something could not be estimated; the same sentence
/// of several directions is said once.
pub fn unseen(runs: &[RunUp], directions: &[ProbeDirection], seen: &[Vec<RunEstimates>]) -> Vec<String> {
    let mut said: Vec<(String, Vec<String>)> = Vec::new();
    for (run, row) in runs.iter().zip(seen) {
        for (direction, s) in directions.iter().zip(row) {
            let circle_alone = s.circle.as_ref().err().filter(|_| s.half_power.is_ok());
            let Some(why) = s.half_power.as_ref().err().or(circle_alone) else { continue };
            let place = format!("{} {}", run.label(), direction.label);
            match said.iter_mut().find(|(w, _)| w == why) {
                Some((_, places)) => places.push(place),
                None => said.push((why.clone(), vec![place])),
            }
        }
    }
    said.into_iter().map(|(why, places)| format!("Run {}: {why}.", places.join(", "))).collect()
}

/// What natural speed and damping mean for a mass on a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OscillatorParameters {
    pub natural_rad_s: UncertainValue,
    pub damping_ratio: UncertainValue,
    /// Equivalent viscous damping `2 ζ m ω`, N·s/m.
    pub damping_n_s_m: UncertainValue,
    /// Stiffness `m ω²`, N/m.
    pub stiffness_n_m: UncertainValue,
    /// What is in series with the shaft: both bearings together, N/m; `None` if the stiffness is not
    /// below the shaft's.
    pub bearing_stiffness_n_m: Option<UncertainValue>,
}

impl OscillatorParameters {
    fn of(found: &ModalEstimate, mass_kg: f64, spring: &ShaftSpring) -> Self {
        let Modal { natural_rad_s: w, damping_ratio: z } = found.modal;
        let value = |value: f64, by_natural: f64, by_ratio: f64| {
            let gradient = Vector2::new(by_natural, by_ratio);
            UncertainValue { value, sd: gradient.dot(&(found.covariance * gradient)).max(0.0).sqrt() }
        };
        let k = mass_kg * w * w;
        let bearing = spring.in_series_with_n_m(k);
        let amplified = (spring.stiffness_n_m / (spring.stiffness_n_m - k)).powi(2);
        Self {
            natural_rad_s: value(w, 1.0, 0.0),
            damping_ratio: value(z, 0.0, 1.0),
            damping_n_s_m: value(2.0 * z * mass_kg * w, 2.0 * z * mass_kg, 2.0 * mass_kg * w),
            stiffness_n_m: value(k, 2.0 * mass_kg * w, 0.0),
            bearing_stiffness_n_m: bearing.map(|b| value(b, amplified * 2.0 * mass_kg * w, 0.0)),
        }
    }
}

/// One direction over all runs, by method.
#[derive(Debug, Clone, PartialEq)]
pub struct CombinedEstimates {
    /// In the order of [`METHODS`].
    pub by_method: [Option<OscillatorParameters>; 3],
}

impl CombinedEstimates {
    pub(super) fn of<'s>(
        runs: impl Iterator<Item = &'s RunEstimates> + Clone,
        mass_kg: f64,
        spring: &ShaftSpring,
    ) -> Self {
        let by_method = std::array::from_fn(|method| {
            let all: Vec<ModalEstimate> = runs.clone().filter_map(|s| s.found(method)).collect();
            ModalEstimate::mean(&all).map(|mean| OscillatorParameters::of(&mean, mass_kg, spring))
        });
        Self { by_method }
    }

    /// The first method that gave an answer, by its number, and the answer.
    pub fn best(&self) -> Option<(usize, &OscillatorParameters)> {
        self.by_method.iter().enumerate().find_map(|(i, e)| Some((i, e.as_ref()?)))
    }
}

/// A quantity of the resonance over the square of the amplitude at its peak, as a straight line: a bearing
/// `k (1 + κ a²)` moves stiffness and damping of the whole in proportion to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeTrend {
    /// For small motion.
    pub at_rest: UncertainValue,
    /// At the largest peak that was measured.
    pub at_largest: f64,
    /// Slope over its standard deviation.
    pub sigmas: f64,
}

impl AmplitudeTrend {
    /// Through values with their standard deviations, over squares relative to the largest.
    fn through(points: &[(f64, UncertainValue)]) -> Option<Self> {
        let (mut gram, mut slope) = (Matrix2::zeros(), Vector2::zeros());
        for (square, v) in points {
            let row = Vector2::new(1.0, *square) / v.sd;
            gram += row * row.transpose();
            slope += row * (v.value / v.sd);
        }
        let covariance = gram.try_inverse()?;
        let line = covariance * slope;
        Some(Self {
            at_rest: UncertainValue { value: line[0], sd: covariance[(0, 0)].sqrt() },
            at_largest: line[0] + line[1],
            sigmas: line[1] / covariance[(1, 1)].sqrt(),
        })
    }
}

/// Whether the resonance changes with the amplitude. Where bearings that soften give most of the damping,
/// the damping ratio changes and the natural speed may hardly do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeShift {
    pub natural_rad_s: AmplitudeTrend,
    pub damping_ratio: AmplitudeTrend,
    pub largest_m: f64,
}

impl AmplitudeShift {
    pub(super) fn of<'s>(runs: impl Iterator<Item = &'s RunEstimates>) -> Option<Self> {
        let all: Vec<(f64, ModalEstimate)> =
            runs.filter_map(|s| s.half_power.as_ref().ok()).map(|(m, found)| (m.peak[1], *found)).collect();
        let largest_m = all.iter().map(|(peak, _)| *peak).fold(0.0, f64::max);
        let smallest_m = all.iter().map(|(peak, _)| *peak).fold(f64::INFINITY, f64::min);
        // one run, or runs alike, have no slope
        if smallest_m > LEAST_SPREAD * largest_m {
            return None;
        }
        let line = |i: usize| {
            let point = |(peak, found): &(f64, ModalEstimate)| {
                let value = UncertainValue { value: found.vector()[i], sd: found.covariance[(i, i)].sqrt() };
                ((peak / largest_m).powi(2), value)
            };
            AmplitudeTrend::through(&all.iter().map(point).collect::<Vec<_>>())
        };
        Some(Self { natural_rad_s: line(0)?, damping_ratio: line(1)?, largest_m })
    }
}

/// The disk's own unbalance as the two-degree model sees it, over directions and runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnUnbalance {
    pub unbalance_kg_m: C,
    /// Standard deviation of each component: what the noise and the directions' differences make it.
    pub sd_kg_m: f64,
    /// The mass that the trial weights weigh the oscillator with, kg.
    pub modal_mass_kg: f64,
}

impl OwnUnbalance {
    /// From the forces of the least-squares fits: `(U_own + U_added) / m` in every run.
    pub(super) fn of(
        runs: &[RunUp],
        known: &[bool],
        directions: &[ProbeDirection],
        seen: &[Vec<RunEstimates>],
    ) -> Option<Self> {
        let mut by_direction: Vec<(C, f64, f64)> = Vec::new();
        for (d, direction) in directions.iter().enumerate() {
            let (mut gram, mut slope) = (Matrix3::zeros(), Vector3::zeros());
            for ((run, row), _) in runs.iter().zip(seen).zip(known).filter(|(_, known)| **known) {
                let Ok(fit) = &row[d].least_squares else { continue };
                let force = fit.eccentricity_m * C::from_polar(1.0, direction.angle_rad);
                let sd = fit.eccentricity_sd_m;
                for (row, seen) in [
                    (Vector3::new(1.0, 0.0, run.added_kg_m.re), force.re),
                    (Vector3::new(0.0, 1.0, run.added_kg_m.im), force.im),
                ] {
                    gram += row * row.transpose() / (sd * sd);
                    slope += row * (seen / (sd * sd));
                }
            }
            // the third unknown is a factor of small numbers
            let unit = gram.diagonal().map(|g| if g > 0.0 { g.sqrt().recip() } else { 0.0 });
            let scaled = Matrix3::from_fn(|i, j| gram[(i, j)] * unit[i] * unit[j]);
            let Some(inverse) = scaled.try_inverse() else { continue };
            let x = (inverse * slope.component_mul(&unit)).component_mul(&unit);
            let sd = inverse[(0, 0)].max(0.0).sqrt() * unit[0] / x[2];
            if x[2] > 0.0 && sd.is_finite() {
                by_direction.push((C::new(x[0], x[1]) / x[2], sd, x[2].recip()));
            }
        }
        let weight: f64 = by_direction.iter().map(|(_, sd, _)| sd.powi(-2)).sum();
        if by_direction.is_empty() {
            return None;
        }
        let mean: C = by_direction.iter().map(|(u, sd, _)| u / (sd * sd)).sum::<C>() / weight;
        let off: f64 = by_direction.iter().map(|(u, sd, _)| (u - mean).norm_sqr() / (sd * sd)).sum();
        let freedom = 2.0 * by_direction.len().saturating_sub(1).max(1) as f64;
        Some(Self {
            unbalance_kg_m: mean,
            sd_kg_m: (off / freedom).max(1.0).sqrt() / weight.sqrt(),
            modal_mass_kg: by_direction.iter().map(|d| d.2).sum::<f64>() / by_direction.len() as f64,
        })
    }
}
